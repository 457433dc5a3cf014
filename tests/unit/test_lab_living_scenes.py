"""The scenes of a surface that lives: drift, knocks, blindness, things, resting arms, hovers."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise
from math import dist

import cv2
import numpy as np
import pytest
from touchd.lab.scenes import LONG_SCENES, LabScene, TrueThing, TrueTip, TruthFrame, lab_scene
from touchd.lab.scenes.handling import TOUCHABLE_AFTER_S
from touchd.lab.scenes.living import EMPTY_MS
from touchd.table.scene import Capsule, Hand, Point

THINGS = ("phone", "cup", "book", "paper", "laptop")
HEIGHTS = (750.0, 1500.0)
FRAME_S = 1 / 30


@pytest.fixture(autouse=True)
def one_thread() -> None:
    cv2.setNumThreads(1)


@cache
def scene(name: str, height_mm: float = 750.0, seed: int = 1) -> LabScene:
    return lab_scene(name, height_mm, seed)


@cache
def truths(name: str, height_mm: float = 750.0, seed: int = 1) -> list[TruthFrame]:
    of = scene(name, height_mm, seed)
    return [of.truth(of.calibration_frames + at) for at in range(of.frames)]


def difference(name: str, index: int, height_mm: float = 750.0) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """By how many raw steps a frame reads nearer than the first one, NaN where either has no reading."""
    of = scene(name, height_mm)
    first, then = (of.frame(i).raw.astype(np.float64) for i in (3, index))
    first[first == of.sensor.invalid] = np.nan
    then[then == of.sensor.invalid] = np.nan
    return first - then


def lying(frame: TruthFrame) -> TrueThing | None:
    return next((thing for thing in frame.things if not thing.held), None)


def touching(frame: TruthFrame) -> list[TrueTip]:
    return [tip for tip in frame.tips if tip.touching]


def middle_of(thing: TrueThing) -> tuple[float, float]:
    (ax, ay), _, (bx, by), _ = thing.outline
    return (0.5 * (ax + bx), 0.5 * (ay + by))


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_readings_drift_by_three_steps_in_25_s_and_not_quite_evenly(height_mm: float) -> None:
    of = scene("drift", height_mm)
    end = of.calibration_frames + of.frames - 1
    half = of.calibration_frames + round(12.5 / FRAME_S)
    off = difference("drift", end, height_mm)
    assert abs(float(np.nanmean(off))) == pytest.approx(3.0, abs=0.15)
    assert abs(float(np.nanmedian(difference("drift", half, height_mm)))) == pytest.approx(1.5, abs=0.6)
    blocks = np.nanmean(off[:, :620].reshape(4, 120, 4, 155), axis=(1, 3))
    assert 0.1 < float(np.ptp(blocks)) < 1.0


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_knocked_camera_reads_three_steps_more_from_side_to_side_and_the_table_moves_in_its_picture(
    height_mm: float,
) -> None:
    of = scene("knock", height_mm)
    end = of.calibration_frames + of.frames - 1
    off = difference("knock", end, height_mm)
    left, right = np.nanmean(off[:, 4:44]), np.nanmean(off[:, -60:-20])
    assert abs(float(left - right)) == pytest.approx(3.0, abs=0.6)
    before, after = of.camera_at(0), of.camera_at(end)
    assert before == of.camera
    assert np.allclose(before.eye_mm(), after.eye_mm())
    corner = of.area.corners_mm()[0]
    assert dist(before.pixels(corner), after.pixels(corner)) > 2.0


def test_a_knock_comes_from_one_frame_to_the_next_while_fingers_touch() -> None:
    frames = truths("knock")
    first = next(i for i, frame in enumerate(frames) if frame.upset == "knocked")
    of = scene("knock")
    assert touching(frames[first - 1])
    assert touching(frames[first])
    assert of.camera_at(of.calibration_frames + first - 1) == of.camera
    assert of.camera_at(of.calibration_frames + first) != of.camera


def test_touches_are_asked_for_again_when_the_table_was_empty_for_three_seconds() -> None:
    frames = truths("knock")
    last = max(i for i, frame in enumerate(frames) if frame.upset == "knocked")
    empty = [i for i in range(last) if frames[i].tips]
    assert (last - max(empty)) * FRAME_S >= EMPTY_MS / 1e3
    assert sum(touch.down_ns > frames[last].t_ns for touch in scene("knock").touches) >= 10


def test_a_blind_camera_reads_nothing_while_a_finger_touches_and_sees_again() -> None:
    of, frames = scene("blind"), truths("blind")
    spans = [i for i, frame in enumerate(frames) if frame.upset == "blind"]
    starts = [i for i in spans if i - 1 not in spans]
    assert len(starts) == 2
    for start in starts:
        assert touching(frames[start + 5])
        seen = of.frame(of.calibration_frames + start + 5).raw != of.sensor.invalid
        assert seen.mean() < 0.01
    assert (of.frame(of.calibration_frames + spans[-1]).raw != of.sensor.invalid).mean() > 0.9


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_near_head_covers_a_part_of_the_picture_and_none_of_the_other_fingers(height_mm: float) -> None:
    of = scene("near-head", height_mm)
    index = of.calibration_frames + round(3.6 / FRAME_S)
    lost = of.frame(index).raw == of.sensor.invalid
    assert 0.08 < lost.mean() < 0.6
    for tip in of.truth(index).tips:
        u, v = of.camera.pixels(np.array([tip.x_mm, tip.y_mm, tip.z_mm])).round().astype(int).tolist()
        if tip.hand < 2:
            assert lost[max(v - 6, 0) : v + 7, max(u - 6, 0) : u + 7].mean() < 0.5


@pytest.mark.parametrize("name", THINGS)
def test_a_thing_is_carried_in_lies_is_pushed_and_taken_away(name: str) -> None:
    frames = truths(name)
    held = [lying(frame) is None for frame in frames if frame.things]
    changes = sum(a is not b for a, b in pairwise(held))
    assert (held[0], held[-1], changes) == (True, True, 4)
    places = {middle_of(thing) for frame in frames if (thing := lying(frame)) is not None}
    assert len(places) == 2
    size = scene(name).area.size_mm
    first, second = (np.array(place) * size for place in sorted(places))
    assert 50.0 < float(np.linalg.norm(first - second)) < 100.0
    assert not frames[-1].things


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", THINGS)
def test_a_thing_is_touched_beside_then_on_it_after_its_time_and_where_it_lay(name: str, height_mm: float) -> None:
    frames = truths(name, height_mm)
    put = next(frame.t_ns for frame in frames if lying(frame) is not None)
    gone = max(frame.t_ns for frame in frames if frame.things)
    begun = {tip.tip: (frame.t_ns, tip.z_mm) for frame in reversed(frames) for tip in touching(frame)}
    on = [t_ns for t_ns, z_mm in begun.values() if z_mm > 0.0]
    assert len(on) in (3, 4)  # a sheet of paper is pushed from above
    assert (min(on) - put) / 1e9 >= TOUCHABLE_AFTER_S
    assert sum(t_ns < put + 1e9 * TOUCHABLE_AFTER_S for t_ns, _ in begun.values()) == 3
    assert sum(t_ns > gone for t_ns, _ in begun.values()) == 4
    assert {round(z_mm, 6) for _, z_mm in begun.values()} == {0.0, round(lying_height(frames), 6)}


def lying_height(frames: list[TruthFrame]) -> float:
    return next(thing.height_mm for frame in frames if (thing := lying(frame)) is not None)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("phone", 7.0, 9.0),
        ("cup", 80.0, 95.0),
        ("book", 20.0, 40.0),
        ("paper", 0.1, 1.0),
        ("laptop", 20.0, 20.0),
    ],
)
def test_things_are_as_high_as_such_things_are_and_seen_where_the_truth_says(
    name: str, low: float, high: float
) -> None:
    of, frames = scene(name), truths(name)
    at = next(i for i, frame in enumerate(frames) if lying(frame) is not None and not frame.tips)
    thing = lying(frames[at])
    assert thing is not None
    assert low <= thing.height_mm <= high
    index = of.calibration_frames + at
    rise = of.empty_depth(index).depth_mm - of.true_depth(index).depth_mm
    x, y = middle_of(thing)
    (ax, ay), (bx, _), _, (_, dy) = of.corners.corners_px
    u, v = round(ax + x * (bx - ax)), round(ay + y * (dy - ay))
    assert float(np.median(rise[v - 4 : v + 5, u - 4 : u + 5])) == pytest.approx(thing.height_mm, abs=1.5)


@pytest.mark.parametrize("name", THINGS)
def test_a_finger_that_holds_a_thing_may_be_taken_for_a_touch_where_it_is_low_over_the_surface(name: str) -> None:
    surface_mm = 0.0
    for frame in truths(name):
        if name != "cup" and lying(frame) is not None:  # a cup is taken by its side
            surface_mm = lying_height(truths(name))
        for tip in frame.tips:
            assert not (tip.either and tip.touching)
            if tip.either:
                assert tip.height_mm < surface_mm + 15.0
                assert frame.things


@pytest.mark.parametrize("name", THINGS)
def test_no_fingertip_goes_through_a_thing(name: str) -> None:
    over = 0
    for frame in truths(name):
        thing = lying(frame)
        if thing is None:
            continue
        footprint = np.array(thing.footprint, np.float32)
        for tip in frame.tips:
            if cv2.pointPolygonTest(footprint, (tip.x, tip.y), measureDist=False) > 0.0:
                over += 1
                assert tip.z_mm + tip.height_mm > thing.height_mm - 1e-6
    assert over


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", ["phone", "book", "laptop"])
def test_no_finger_of_a_hand_that_takes_a_thing_by_its_upper_side_goes_into_it(name: str, height_mm: float) -> None:
    of, over = scene(name, height_mm), 0
    begin_ns = truths(name, height_mm)[0].t_ns
    for frame in truths(name, height_mm):
        if not frame.things or not any(tip.either for tip in frame.tips):
            continue
        (thing,) = frame.things
        footprint = np.array(thing.footprint, np.float32)
        for x_mm, y_mm, low_mm in lowest_of_fingers(of.play.hands(frame.t_ns - begin_ns)):
            if cv2.pointPolygonTest(footprint, on_area(of, x_mm, y_mm), measureDist=False) > 0.0:
                over += 1
                assert low_mm > thing.height_mm - 0.1
    assert over > 30


def on_area(of: LabScene, x_mm: float, y_mm: float) -> tuple[float, float]:
    (x, y), (width, height) = of.area.centre_mm, of.area.size_mm
    return (x_mm - x) / width + 0.5, (y_mm - y) / height + 0.5


def lowest_of_fingers(hands: Sequence[Hand]) -> Iterator[tuple[float, float, float]]:
    """Yield the places of all joints, and how high their undersides are."""
    for solid in (solid for hand in hands for solid in hand.solids):
        if isinstance(solid, Capsule):
            for (x, y, z), radius in ((solid.a_mm, solid.radius_a_mm), (solid.b_mm, solid.radius_b_mm)):
                yield x, y, z - radius


def test_a_resting_forearm_lies_on_the_table_for_a_minute_while_both_hands_touch() -> None:
    of = scene("forearm")
    first = min(tip.down_ns or 0 for frame in truths("forearm") for tip in touching(frame) if tip.hand == 0)
    last = max(touch.lift_ns for touch in of.touches if touch.hand == 0)
    assert (last - first) / 1e9 > 58.0
    assert {touch.hand for touch in of.touches} == {0, 1}
    middle = of.calibration_frames + of.frames // 2
    rise = of.empty_depth(middle).depth_mm - of.true_depth(middle).depth_mm
    low = cv2.erode(((rise > 15.0) & (rise < 110.0)).astype(np.uint8), np.ones((15, 15), np.uint8))
    assert int(low.sum()) > 2000  # a broad thing that rises no higher than an arm that lies


@pytest.mark.parametrize("seed", [404, 502])
def test_no_finger_draws_through_the_arm_that_rests(seed: int) -> None:
    of = scene("forearm", seed=seed)
    begin_ns = of.frame(of.calibration_frames).t_ns
    ways = 0
    for frame in truths("forearm", seed=seed)[::3]:
        for tip in (tip for tip in touching(frame) if tip.hand == 1):
            resting = min(of.play.hands(frame.t_ns - begin_ns), key=elbow_mm)
            assert off_limbs_mm(resting, (tip.x_mm, tip.y_mm, tip.z_mm)) > 40.0
            ways += tip.speed_mm_s > 100.0
    assert ways > 50


def elbow_mm(hand: Hand) -> float:
    """Return how high the thicker end is of the limb behind the wrist."""
    return min(solid.b_mm[2] for solid in hand.solids if isinstance(solid, Capsule) and solid.radius_b_mm > 30.0)


def off_limbs_mm(hand: Hand, place: Point) -> float:
    """Return how far a place is from the surface of the nearest limb or finger."""
    limbs = [solid for solid in hand.solids if isinstance(solid, Capsule)]
    a, b = (np.array([getattr(limb, end) for limb in limbs]) for end in ("a_mm", "b_mm"))
    way, off = b - a, np.array(place) - a
    along = np.clip(np.sum(off * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-9), 0.0, 1.0)
    thin, thick = (np.array([getattr(limb, end) for limb in limbs]) for end in ("radius_a_mm", "radius_b_mm"))
    return float(np.min(np.linalg.norm(off - along[:, None] * way, axis=1) - thin - along * (thick - thin)))


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_hovering_fingers_are_held_at_heights_that_touchd_follows_and_then_touch(height_mm: float) -> None:
    frames = truths("hover-height", height_mm)
    heights = Counter(round(tip.height_mm, 6) for frame in frames for tip in frame.tips if tip.height_mm < 40.0)
    lowest = 8.0 if height_mm == 750.0 else 16.0
    assert all(heights[round(height, 6)] * FRAME_S > 0.7 for height in np.linspace(lowest, 36.0, 8).tolist())
    assert len(scene("hover-height", height_mm).touches) == 8


def test_some_of_the_touches_that_follow_a_hover_come_down_in_motion() -> None:
    frames = truths("hover-height")
    landing = {tip.tip: tip.speed_mm_s for frame in reversed(frames) for tip in touching(frame)}
    assert sum(speed > 100.0 for speed in landing.values()) == 4


def test_four_hands_belong_to_two_people_and_each_has_its_side() -> None:
    tips = [tip for frame in truths("four-hands") for tip in frame.tips]
    assert {(tip.hand, tip.person, tip.side) for tip in tips} == {
        (0, 0, "right"),
        (1, 0, "left"),
        (2, 1, "right"),
        (3, 1, "left"),
    }


def test_hands_of_four_meet_each_other_at_times() -> None:
    near: set[tuple[int, int]] = set()
    for frame in truths("four-hands"):
        down = touching(frame)
        near |= {(a.hand, b.hand) for a in down for b in down if dist((a.x_mm, a.y_mm), (b.x_mm, b.y_mm)) < 200.0}
    assert {(0, 1), (2, 3), (0, 3), (1, 2)} <= near


@pytest.mark.parametrize("name", LONG_SCENES)
def test_long_scenes_last_ten_minutes_and_touch_only_inside_their_area(name: str) -> None:
    of = scene(name, 1500.0)
    assert 600.0 <= of.frames * FRAME_S < 620.0
    frames = [of.truth(of.calibration_frames + at) for at in range(0, of.frames, 61)]
    assert all(0.0 < tip.x < 1.0 and 0.0 < tip.y < 1.0 for frame in frames for tip in touching(frame))
    assert not frames[0].tips


def test_a_held_finger_stays_within_a_millimetre_but_never_quite_still() -> None:
    of = scene("held")
    (touch,) = of.touches
    assert (touch.lift_ns - touch.down_ns) / 1e9 == pytest.approx(600.0, abs=2.0)
    frames = [of.truth(of.calibration_frames + at) for at in range(60, of.frames - 60, 97)]
    places = np.array([(tip.x_mm, tip.y_mm) for frame in frames for tip in frame.tips])
    assert 0.3 < float(np.ptp(places, axis=0).max()) < 1.0
    assert len(np.unique(places.round(6), axis=0)) > 0.9 * len(places)


def test_a_long_drift_has_a_tap_every_few_seconds() -> None:
    downs = [touch.down_ns / 1e9 for touch in scene("drift-long").touches]
    assert max(b - a for a, b in pairwise(downs)) < 8.0
    assert len(downs) > 150


def test_what_happens_besides_fingertips_is_told_frame_by_frame() -> None:
    quiet, laid = truths("phone")[0], next(frame for frame in truths("phone") if lying(frame) is not None)
    assert quiet.happening() is None
    told = laid.happening()
    assert told is not None
    assert (told["frame"], told["upset"]) == (laid.index, None)
    assert set(told["things"][0]) == {"id", "kind", "outline", "footprint", "height_mm", "held"}
    knocked = next(frame for frame in truths("knock") if frame.upset is not None)
    assert knocked.happening() == {"frame": knocked.index, "upset": "knocked", "things": []}
