import itertools
from math import dist

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.table.anatomy import (
    INDEX,
    KNUCKLES_MM,
    MIDDLE,
    THUMB,
    Build,
    lowest_of_palm_mm,
    palm_facing,
    reaching,
)
from touchd.table.body import Sleeve, head, leg, with_arm
from touchd.table.postures import FLAT, OPEN, PINCHING, POINTING, WRITING, Aim, Grip, Held, pose
from touchd.table.scene import Capsule, Point, Solid
from touchd.table.vectors import dot, minus, unit

BONES = (43.0, 25.0, 19.0)
UP: Point = (0.0, 0.0, 1.0)


def aim(build: Build, grip: Grip, pitch_deg: float = 40.0, heading_deg: float = 0.0, clearance_mm: float = 0.0) -> Aim:
    scale = 60.0 if grip.by_spread else build.scale
    side = -1.0 if build.left else 1.0
    turn = np.radians(heading_deg)
    balls = []
    for finger, (forward, right) in grip.tips:
        ahead, across = forward * scale, right * scale * side
        x = ahead * np.sin(turn) + across * np.cos(turn)
        y = across * np.sin(turn) - ahead * np.cos(turn)
        balls.append((float(x), float(y), build.tip_radius_mm(finger) + clearance_mm))
    return Aim(heading_deg, pitch_deg, tuple(balls), (0.0, 0.0), clearance_mm)


def stretch(joints: list[Point], bones: tuple[float, float, float]) -> float:
    return dist(joints[0], joints[1]) / bones[0]


def lowest(solids: tuple[Solid, ...]) -> list[float]:
    return [min(s.a_mm[2] - s.radius_a_mm, s.b_mm[2] - s.radius_b_mm) for s in solids if isinstance(s, Capsule)]


def ends(held: Held) -> set[Point]:
    return {solid.b_mm for solid in held.solids if isinstance(solid, Capsule)}


builds = st.builds(
    Build,
    scale=st.floats(0.62, 1.12),
    tip_mm=st.floats(11.0, 17.0),
    breadth=st.just(1.0),
    taper=st.floats(1.05, 1.25),
    follow=st.floats(0.2, 0.7),
    left=st.booleans(),
)


@settings(deadline=None, max_examples=60)
@given(st.floats(52.0, 86.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.2, 0.7))
def test_a_finger_ends_at_its_tip_and_keeps_the_lengths_of_its_bones(
    distance: float, sideways: float, down: float, follow: float
) -> None:
    way = unit((1.0, sideways, down))
    tip = (way[0] * distance, way[1] * distance, way[2] * distance)
    joints = reaching((0.0, 0.0, 0.0), tip, BONES, UP, follow)
    assert joints[-1] == tip
    assert [dist(a, b) for a, b in itertools.pairwise(joints)] == pytest.approx(BONES, rel=1e-3)


def test_a_bent_finger_s_joints_stand_out_on_the_back_of_the_hand() -> None:
    _, middle, last, _ = reaching((0.0, 0.0, 0.0), (60.0, 0.0, 0.0), BONES, UP, 0.5)
    assert middle[2] > 10.0
    assert last[2] > 5.0


def test_a_tip_out_of_reach_lengthens_the_bones_instead_of_being_missed() -> None:
    joints = reaching((0.0, 0.0, 0.0), (100.0, 0.0, 0.0), BONES, UP, 0.5)
    assert joints[-1] == (100.0, 0.0, 0.0)
    assert stretch(joints, BONES) == pytest.approx(100.0 / 87.0, rel=1e-3)


@pytest.mark.parametrize("left", [False, True])
def test_a_palm_s_axes_are_square_and_its_right_is_the_little_finger_s_side(left: bool) -> None:
    palm = palm_facing(30.0, 20.0, 15.0, left)
    axes = np.array([palm.forward, palm.right, palm.up])
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    ahead, right = np.array(palm.forward[:2]), np.array(palm.right[:2])
    # y points down the picture: to the right of a heading is clockwise.
    assert (ahead[0] * right[1] - ahead[1] * right[0] > 0.0) is not left


@settings(deadline=None, max_examples=60)
@given(builds, st.sampled_from([POINTING, OPEN, PINCHING, FLAT, WRITING]), st.floats(15.0, 70.0), st.floats(0.0, 360.0))
def test_fingertips_are_where_they_are_wanted_for_every_hand_and_grip(
    build: Build, grip: Grip, pitch_deg: float, heading_deg: float
) -> None:
    wanted = aim(build, grip, pitch_deg, heading_deg)
    balls = np.array(sorted(ends(pose(build, grip, wanted))))
    for ball in wanted.balls_mm:
        assert np.abs(balls - np.array(ball)).max(1).min() < 1e-9


@settings(deadline=None, max_examples=60)
@given(builds, st.floats(25.0, 70.0))
def test_no_finger_but_the_pointing_one_comes_near_the_table(build: Build, pitch_deg: float) -> None:
    held = pose(build, POINTING, aim(build, POINTING, pitch_deg))
    assert min(lowest(held.solids)[4:19]) >= POINTING.gap_mm - 1.0
    assert min(lowest(held.solids)[19:]) >= 6.0  # the palm


@settings(deadline=None, max_examples=40)
@given(builds, st.sampled_from([OPEN, PINCHING, FLAT]))
def test_hands_hold_their_fingers_without_stretching_them(build: Build, grip: Grip) -> None:
    wanted = aim(build, grip, 4.0 if grip is FLAT else 48.0)
    palm = pose(build, grip, wanted).palm
    for finger, ball in zip(grip.fingers, wanted.balls_mm, strict=True):
        base = palm.at(KNUCKLES_MM[finger], build.scale)
        bones = build.bones_mm(finger)
        assert stretch(reaching(base, ball, bones, UP, build.follow), bones) == pytest.approx(1.0, abs=0.05)


def test_a_flat_hand_lies_on_the_table_all_along() -> None:
    build = Build()
    heights = lowest(pose(build, FLAT, aim(build, FLAT, 4.0)).solids)
    assert max(heights) < 20.0
    assert min(heights) >= -1.0


def test_a_writing_hand_rests_on_its_heel_and_lifts_it_with_the_hand() -> None:
    build = Build()
    down, up = (pose(build, WRITING, aim(build, WRITING, 40.0, clearance_mm=c)) for c in (0.0, 20.0))
    assert lowest_of_palm_mm(down.palm, build) == pytest.approx(0.0, abs=1e-9)
    assert lowest_of_palm_mm(up.palm, build) == pytest.approx(20.0, abs=1e-9)


def test_a_writing_hand_stays_where_its_anchor_is_while_the_finger_moves() -> None:
    build = Build()
    here = aim(build, WRITING)
    there = Aim(here.heading_deg, here.pitch_deg, ((9.0, -7.0, here.balls_mm[0][2]),), (0.0, 0.0), 0.0)
    assert pose(build, WRITING, here).palm == pose(build, WRITING, there).palm


def test_fingertips_are_broader_than_thick() -> None:
    build = Build(tip_mm=14.0, breadth=1.2)
    held = pose(build, POINTING, aim(build, POINTING))
    halves = [s for s in held.solids if isinstance(s, Capsule) and s.radius_b_mm == build.tip_radius_mm(INDEX)]
    across = np.ptp([half.b_mm[0] for half in halves]) + 14.0
    assert across == pytest.approx(1.2 * 14.0)
    assert [half.b_mm[2] for half in halves] == pytest.approx([7.0, 7.0])


def test_thumbs_are_thicker_and_fingers_taper_to_their_tips() -> None:
    build = Build(tip_mm=13.0)
    assert build.tip_radius_mm(THUMB) > build.tip_radius_mm(INDEX) == 6.5
    for finger in range(5):
        assert sorted(build.radii_mm(finger), reverse=True) == list(build.radii_mm(finger))
    assert build.bones_mm(MIDDLE) > build.bones_mm(INDEX)


@pytest.mark.parametrize("scale", [0.65, 1.0])
def test_an_arm_leads_from_the_wrist_over_the_table_towards_its_shoulder(scale: float) -> None:
    build = Build(scale=scale)
    held = pose(build, POINTING, aim(build, POINTING))
    hand = with_arm(held, build, (100.0, 1200.0), 350.0, None)
    forearm, upper, _trunk = (s for s in hand.solids[len(held.solids) :] if isinstance(s, Capsule))
    assert dist(forearm.a_mm, held.palm.wrist_mm) < 30.0
    assert forearm.b_mm == upper.a_mm
    assert upper.b_mm[2] == 350.0
    assert upper.b_mm[1] > forearm.a_mm[1]
    assert min(lowest(hand.solids[len(held.solids) :])) >= 0.0


def test_a_dark_sleeve_is_dark_and_a_light_one_is_not() -> None:
    build = Build()
    held = pose(build, POINTING, aim(build, POINTING))
    dark, light = (with_arm(held, build, (0.0, 1000.0), 350.0, Sleeve(0.2, dark=which)) for which in (True, False))
    assert dark.dark
    assert not light.dark
    assert len(dark.solids) + len(dark.dark) == len(light.solids)


def test_a_head_is_where_it_should_be_with_its_body_behind_it() -> None:
    crown = head((0.0, 0.0, 300.0), (0.0, -1.0), 1.0, dark_hair=True)
    assert len(crown.dark) == 1
    trunk = [s for s in crown.solids if isinstance(s, Capsule)][-1]
    assert dot(minus(trunk.b_mm, (0.0, 0.0, 300.0)), (0.0, 1.0, 0.0)) > 300.0


def test_a_leg_stands_on_the_floor_and_ends_under_or_over_the_table() -> None:
    low, high = leg((0.0, 0.0), -720.0, -300.0, 1.0), leg((0.0, 0.0), -720.0, 50.0, 1.0)
    assert min(lowest(low.solids)) == pytest.approx(-720.0)
    assert len(high.solids) == len(low.solids) + 1
