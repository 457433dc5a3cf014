"""Hands over the table: whose arm is whose, for how long, and where."""

from math import cos, dist, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.hands.stage import HandStage
from touchd.hands.thumbs import thumb_side
from touchd.model import Frame
from touchd.table.hands import HandPose, open_hand, pointing_hand
from touchd.table.scene import Hand, Place

from tabletop import FRAME_NS, Watch, in_dark_sleeve, tabletop

HEIGHTS = (750.0, 1500.0)


def from_below(at_mm: Place, lift_mm: float = 40.0) -> Hand:
    return pointing_hand(HandPose(at_mm, clearance_mm=lift_mm))


def from_above(at_mm: Place, lift_mm: float = 40.0) -> Hand:
    return pointing_hand(HandPose(at_mm, clearance_mm=lift_mm, heading_deg=180.0))


def from_the_left(at_mm: Place, lift_mm: float = 40.0) -> Hand:
    return pointing_hand(HandPose(at_mm, clearance_mm=lift_mm, heading_deg=90.0))


def ids(stage: HandStage) -> list[int]:
    return [hand.hand_id for hand in stage.hands]


def come_in(watch: Watch, *places: Place) -> HandStage:
    """Move hands in from below until each is where it is to be."""
    for step in range(6):
        stage = watch.see(*(from_below((x, y + 60.0 * (5 - step))) for x, y in places))
    return stage


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_hand_has_one_id_for_as_long_as_its_arm_stays(height_mm: float) -> None:
    watch = Watch(tabletop(height_mm))
    assert ids(come_in(watch, (0.0, 0.0))) == [1]
    for step in range(12):
        assert ids(watch.see(from_below((10.0 * step, -5.0 * step), lift_mm=5.0 * step))) == [1]


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("lift_mm", [0.0, 120.0])
def test_a_hand_tells_where_on_the_surface_it_is_over_and_how_high(height_mm: float, lift_mm: float) -> None:
    top = tabletop(height_mm)
    watch = Watch(top)
    for _ in range(6):
        stage = watch.see(from_below((30.0, -20.0), lift_mm))
    (hand,) = stage.hands
    # Its middle is behind the fingertip, towards the wrist.
    assert dist(top.mm_of((hand.x, hand.y)), (45.0, 45.0)) < 35.0
    assert 15.0 < hand.height_mm - lift_mm < 65.0


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_fingers_that_come_in_one_by_one_are_one_hand(height_mm: float) -> None:
    top = tabletop(height_mm)
    watch = Watch(top)
    for step in range(14):
        stage = watch.see(open_hand(HandPose((0.0, top.scale * 330.0 - 25.0 * step), clearance_mm=60.0)))
    assert ids(stage) == [1]


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_arms_that_cross_keep_their_ids_and_hands(height_mm: float) -> None:
    top = tabletop(height_mm)
    watch = Watch(top)
    for _ in range(6):
        stage = watch.see(from_below((-200.0, 230.0)), from_the_left((80.0, 120.0)))
    first_from_the_left = max(stage.hands, key=lambda hand: hand.x).hand_id
    for step in range(26):
        at = (-200.0 + 25.0 * max(0, step - 10), max(-60.0, 230.0 - 30.0 * step))
        stage = watch.see(from_below(at, 50.0), from_the_left((80.0, 120.0), 5.0))
        assert ids(stage) == [1, 2]
    wandering = min(stage.hands, key=lambda hand: dist(top.mm_of((hand.x, hand.y)), (at[0] + 15.0, at[1] + 65.0)))
    resting = min(stage.hands, key=lambda hand: dist(top.mm_of((hand.x, hand.y)), (10.0, 130.0)))
    assert wandering.hand_id != resting.hand_id
    assert resting.hand_id == first_from_the_left
    assert dist(top.mm_of((wandering.x, wandering.y)), (at[0] + 15.0, at[1] + 65.0)) < 45.0
    assert dist(top.mm_of((resting.x, resting.y)), (10.0, 130.0)) < 45.0


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_an_arm_first_seen_across_another_is_one_more_hand_for_as_long_as_it_stays(height_mm: float) -> None:
    watch = Watch(tabletop(height_mm))
    come_in(watch, (0.0, 0.0))
    for step in range(40):
        stage = watch.see(from_below((0.0, 0.0)), from_the_left((120.0, 60.0), 90.0))
        assert ids(stage) in ([[1], [1, 2]] if step < 14 else [[1, 2]])


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_hands_that_meet_and_part_are_still_who_they_were(height_mm: float) -> None:
    watch = Watch(tabletop(height_mm))
    for _ in range(6):
        stage = watch.see(from_below((10.0, 150.0)), from_above((-20.0, -150.0)))
    came_from_below = [hand.y > 0.5 for hand in stage.hands]
    assert sorted(came_from_below) == [False, True]
    for reach in (110.0, 70.0, 40.0, 15.0, -10.0, -30.0, -30.0, 0.0, 30.0, 70.0, 110.0, 150.0):
        for _ in range(3):
            stage = watch.see(from_below((10.0, reach), 0.0), from_above((-20.0, -reach), 0.0))
    assert ids(stage) == [1, 2]
    assert [hand.y > 0.5 for hand in stage.hands] == came_from_below
    assert {hand.person for hand in stage.hands} == {1, 2}


def test_a_hand_outlives_pictures_without_readings_and_is_gone_a_moment_later() -> None:
    watch = Watch(tabletop(750.0))
    come_in(watch, (0.0, 0.0))
    for _ in range(5):
        assert ids(watch.see_nothing_readable()) == [1]
    assert ids(watch.see(from_below((20.0, 10.0)))) == [1]
    for _ in range(11):
        stage = watch.see()
    assert ids(stage) == []
    assert ids(come_in(watch, (0.0, 0.0))) == [2]


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_hand_in_a_dark_sleeve_is_a_hand_however_still_it_is(height_mm: float) -> None:
    top = tabletop(height_mm)
    watch = Watch(top)
    for step in range(8):
        stage = watch.see(in_dark_sleeve(from_below((0.0, 50.0 * (7 - step)))))
    for _ in range(30):
        stage = watch.see(in_dark_sleeve(from_below((0.0, 0.0), 0.0)))
    assert ids(stage) == [1]
    assert stage.objects == ()


def without_upper_arm(hand: Hand) -> Hand:
    """Return a pointing hand whose arm ends at the elbow."""
    return Hand(hand.solids[:-1], hand.fingertips)


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_an_arm_that_ends_in_the_picture_is_a_hand_however_still_it_is(height_mm: float) -> None:
    top = tabletop(height_mm)
    watch = Watch(top)
    for step in range(40):
        stage = watch.see(without_upper_arm(from_below((-10.0 * max(0, 8 - step), -180.0), 0.0)))
        assert ids(stage) == ([1] if step > 3 else [])
    assert stage.objects == ()
    (hand,) = stage.hands
    assert dist(top.mm_of((hand.x, hand.y)), (15.0, -115.0)) < 35.0


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_fingers_of_an_arm_that_ends_in_the_picture_touch_and_stay(height_mm: float) -> None:
    top = tabletop(height_mm)
    pipeline = top.pipeline()
    touching = []
    for index in range(40):
        hand = without_upper_arm(from_below((0.0, -180.0), 12.0 * max(0, 8 - index)))
        frame = pipeline.step(Frame(index=index, t_ns=(100 + index) * FRAME_NS, raw=top.picture([hand], 100 + index)))
        pipeline.settle()
        touching.append([cursor.session_id for cursor in frame.cursors])
    assert touching[:5] == [[]] * 5
    assert touching[12:] == [[1]] * 28


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_two_arms_of_one_side_are_one_persons_left_and_right(height_mm: float) -> None:
    watch = Watch(tabletop(height_mm))
    for _ in range(6):
        stage = watch.see(from_below((-120.0, 60.0)), from_below((120.0, 60.0)), from_above((0.0, -60.0)))
    people = {hand.person: [h for h in stage.hands if h.person == hand.person] for hand in stage.hands}
    assert sorted(len(hands) for hands in people.values()) == [1, 2]
    pair = next(sorted(hands, key=lambda hand: hand.x) for hands in people.values() if len(hands) == 2)
    assert [hand.side for hand in pair] == ["left", "right"]
    assert next(hands[0].side for hands in people.values() if len(hands) == 1) is None


def test_a_person_is_known_again_a_moment_later_and_forgotten_after_a_while() -> None:
    watch = Watch(tabletop(750.0))
    come_in(watch, (0.0, 0.0))
    for _ in range(30):
        watch.see()
    assert [hand.person for hand in come_in(watch, (40.0, 0.0)).hands] == [1]
    for _ in range(65):
        watch.see()
    assert [hand.person for hand in come_in(watch, (40.0, 0.0)).hands] == [2]


def test_a_head_that_leans_in_is_no_hand() -> None:
    watch = Watch(tabletop(1500.0))
    high = from_below((0.0, 0.0), lift_mm=330.0)
    for _ in range(8):
        stage = watch.see(high)
    assert stage.hands == ()


@pytest.mark.parametrize("side", ["left", "right"])
def test_five_fingertips_tell_a_left_hand_from_a_right_one(side: str) -> None:
    top = tabletop(750.0)
    pipeline = top.pipeline()
    for index in range(30, 48):
        hand = open_hand(HandPose((0.0, 0.0), left=side == "left", heading_deg=20.0))
        frame = pipeline.step(Frame(index, index * FRAME_NS, top.picture([hand], index)))
    assert [hand.side for hand in frame.hands] == [side]


@given(
    turn=st.floats(-35.0, 35.0),
    heading=st.floats(0.0, 360.0),
    order=st.permutations(range(5)),
)
def test_a_hand_and_its_mirror_image_are_told_apart_however_it_is_turned(
    turn: float, heading: float, order: list[int]
) -> None:
    # Forward and to the right of a right hand, from thumb to little finger.
    fan = [(-70.0, -60.0), (-8.0, -28.0), (0.0, 0.0), (-8.0, 27.0), (-28.0, 50.0)]
    ahead = sin(radians(heading)), -cos(radians(heading))
    for mirror, side in ((1.0, "right"), (-1.0, "left")):
        angle = radians(heading + turn)
        tips = [
            (forward * sin(angle) + mirror * right * cos(angle), -forward * cos(angle) + mirror * right * sin(angle))
            for forward, right in fan
        ]
        assert thumb_side([tips[i] for i in order], ahead) == side
        assert thumb_side([tips[i] for i in order[:4]], ahead) is None
