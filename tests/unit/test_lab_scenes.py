from functools import cache
from itertools import pairwise
from math import dist, hypot

import cv2
import numpy as np
import pytest
from touchd.errors import UsageError
from touchd.geometry import map_area
from touchd.lab.scenes import LAB_SCENES, LONG_SCENES, LabScene, TrueTip, lab_scene

HEIGHTS = (750.0, 1000.0, 1500.0)
HOVERING = ("hover", "hover-open", "hover-stereo", "sweep", "stacks")
RENDERED = ("targets-book", "drag-stereo", "crowd", "writing", "dark-sleeve", "dark-hair", "legs", "objects", "stacks")
SHORT = [name for name in LAB_SCENES if name not in LONG_SCENES]  # the others have a test of their own
STEREO = [name for name in LAB_SCENES if name.endswith("-stereo")]


@cache
def scene(name: str, height_mm: float = 750.0, seed: int = 1) -> LabScene:
    return lab_scene(name, height_mm, seed)


def played(of: LabScene, step: int = 1) -> range:
    return range(of.calibration_frames, of.calibration_frames + of.frames, step)


@cache
def tips(name: str, height_mm: float = 750.0, seed: int = 1) -> list[tuple[TrueTip, ...]]:
    of = scene(name, height_mm, seed)
    return [of.truth(index).tips for index in played(of)]


def touching(name: str, height_mm: float = 750.0, seed: int = 1) -> list[TrueTip]:
    return [tip for frame in tips(name, height_mm, seed) for tip in frame if tip.touching]


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", SHORT)
def test_every_scene_plays_at_every_height_and_touches_only_inside_its_area(name: str, height_mm: float) -> None:
    of = scene(name, height_mm)
    assert of.height_mm == height_mm == of.camera.height_mm
    assert all(0.0 <= u <= 639.0 and 0.0 <= v <= 479.0 for u, v in of.corners.corners_px)
    assert (len(of.touches) > 0) is (name not in HOVERING)
    for tip in touching(name, height_mm):
        assert 0.0 < tip.x < 1.0
        assert 0.0 < tip.y < 1.0


@pytest.mark.parametrize("height_mm", [750.0, 1000.0])
@pytest.mark.parametrize("name", ["targets-book", "targets-bowl", "drag-bowl"])
def test_hands_fly_over_what_is_not_flat(name: str, height_mm: float) -> None:
    of, flown = scene(name, height_mm), 0
    for before, now in pairwise(tips(name, height_mm)):
        for was, tip in zip(before, now, strict=False):
            way_mm = hypot(tip.x_mm - was.x_mm, tip.y_mm - was.y_mm)
            if was.finger == tip.finger and not (was.touching or tip.touching) and way_mm > 10.0:
                flown += 1
                assert tip.height_mm > 10.0 * height_mm / 750.0
    assert flown > 30
    assert of.touches


@pytest.mark.parametrize("name", SHORT)
def test_touches_come_down_and_lift_when_their_truth_says(name: str) -> None:
    of = scene(name)
    for index in played(of, 3):
        frame = of.truth(index)
        for tip in frame.tips:
            if tip.tip > 0:
                touch = of.touches[tip.tip - 1]
                assert (tip.down_ns, tip.lift_ns, tip.finger) == (touch.down_ns, touch.lift_ns, touch.finger)
                assert tip.touching is (touch.down_ns <= frame.t_ns < touch.lift_ns)
            if tip.touching:
                assert tip.height_mm == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", SHORT)
def test_fingertips_never_jump(name: str) -> None:
    for before, after in pairwise(tips(name)):
        earlier = {tip.finger: tip for tip in before}
        for tip in after:
            if tip.finger in earlier:
                last = earlier[tip.finger]
                assert dist((tip.x_mm, tip.y_mm), (last.x_mm, last.y_mm)) < 60.0  # 1.8 m/s
                assert abs(tip.z_mm + tip.height_mm - last.z_mm - last.height_mm) < 40.0


@pytest.mark.parametrize("name", SHORT)
def test_a_scene_begins_with_the_empty_surface_and_ends_with_it(name: str) -> None:
    of = scene(name)
    assert not of.truth(of.calibration_frames - 1).tips
    assert not of.truth(of.calibration_frames + of.frames - 1).tips


def test_the_same_seed_gives_the_same_bytes_in_any_order_and_another_seed_another_scene() -> None:
    first, second = lab_scene("pinch", 750.0, 3), lab_scene("pinch", 750.0, 3)
    index = first.calibration_frames + 60
    second.frame(index + 5)
    assert np.array_equal(first.frame(index).raw, second.frame(index).raw)
    assert first.truth(index) == second.truth(index)
    assert first.frame(index).t_ns == first.truth(index).t_ns == index * 1_000_000_000 // 30
    other = lab_scene("pinch", 750.0, 4)
    assert other.camera != first.camera
    assert other.touches != first.touches


@pytest.mark.parametrize("name", ["targets", "targets-tilted", "targets-lens", "targets-book", "targets-bowl"])
def test_area_coordinates_are_those_of_the_undistorted_pixel_in_which_the_touch_point_is_seen(name: str) -> None:
    of = scene(name)
    area = map_area(of.corners, of.camera.intrinsics, of.area.size_mm)
    for tip in touching(name)[::10]:
        x, y, z = of.camera.to_camera(np.array([tip.x_mm, tip.y_mm, tip.z_mm])).tolist()
        assert area.of_point(x, y, z) == pytest.approx((tip.x, tip.y), abs=2e-5)


def test_touch_points_on_a_book_lie_on_its_top() -> None:
    heights = {round(tip.z_mm, 6) for tip in touching("targets-book")}
    assert len(heights) == 2
    assert min(heights) == 0.0
    assert 15.0 <= max(heights) <= 35.0


@pytest.mark.parametrize("name", ["targets", "pinch", "five", "targets-bowl", "targets-stereo"])
def test_a_touching_finger_is_seen_over_its_touch_point(name: str) -> None:
    of = scene(name)
    frame = next(index for index in played(of) if sum(tip.touching for tip in of.truth(index).tips) > 0)
    depth = of.true_depth(frame + 3).depth_mm
    for tip in of.truth(frame + 3).tips:
        point = np.array([tip.x_mm, tip.y_mm, tip.z_mm])
        u, v = of.camera.pixels(point).round().astype(int).tolist()
        rise = float(of.camera.to_camera(point)[2] - depth[v, u])
        assert rise > 6.0


@pytest.mark.parametrize("name", ["targets-unknown-lens", "targets-lens"])
def test_touchd_is_told_of_the_lens_or_not(name: str) -> None:
    of = scene(name)
    assert (of.sensor.intrinsics == of.camera.intrinsics) is (name == "targets-lens")
    k = of.camera.intrinsics
    assert 0.0 < abs(k.cx - 319.5) <= 15.0
    edge = (319.5 / k.fx) ** 2
    assert 0.0 < abs(edge * (k.k1 + edge * k.k2)) <= 0.0251


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_tilted_cameras_lean_by_twenty_to_thirty_five_degrees(seed: int) -> None:
    assert 20.0 <= abs(scene("targets-tilted", 750.0, seed).camera.tilt_deg) <= 35.0
    assert abs(scene("targets", 750.0, seed).camera.tilt_deg) <= 12.0


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_quick_taps_are_as_short_and_as_frequent_as_people_s(height_mm: float) -> None:
    of = scene("taps", height_mm)
    contacts = [(touch.lift_ns - touch.down_ns) / 1e6 for touch in of.touches]
    assert min(contacts) >= 50.0
    assert max(contacts) <= 100.0
    gaps = [(b.down_ns - a.down_ns) / 1e9 for a, b in pairwise(of.touches) if a.finger == b.finger]
    quick = [gap for gap in gaps if gap < 0.5]
    assert len(quick) >= 40
    assert all(0.17 <= gap <= 0.36 for gap in quick)


def test_lines_and_circles_reach_nine_tenths_of_a_metre_a_second() -> None:
    for name in ("drag", "circles"):
        speeds = [tip.speed_mm_s for tip in touching(name)]
        assert 850.0 <= max(speeds) <= 930.0


@pytest.mark.parametrize(("height_mm", "low", "high"), [(750.0, 8.0, 60.0), (1500.0, 16.0, 80.0)])
def test_hovering_fingers_stay_within_their_heights(height_mm: float, low: float, high: float) -> None:
    heights = [tip.height_mm for frame in tips("hover", height_mm) for tip in frame]
    assert not touching("hover", height_mm)
    assert min(heights) == pytest.approx(low)
    assert max(h for h in heights if h <= high + 0.01) == pytest.approx(high, abs=1.0)


def test_two_fingers_pass_each_other_at_45_mm() -> None:
    gaps = [
        hypot(frame[0].x_mm - frame[1].x_mm, frame[0].y_mm - frame[1].y_mm)
        for frame in tips("passing")
        if len(frame) == 2 and all(tip.touching for tip in frame)
    ]
    assert min(gaps) == pytest.approx(45.0, abs=2.0)


def test_pinching_fingers_all_but_meet() -> None:
    gaps = [
        dist((frame[0].x_mm, frame[0].y_mm), (frame[1].x_mm, frame[1].y_mm))
        for frame in tips("pinch")
        if len(frame) == 2 and all(tip.touching for tip in frame)
    ]
    assert 15.9 <= min(gaps) <= 24.0
    assert max(gaps) > 55.0


@pytest.mark.parametrize(
    ("name", "fingers", "people"),
    [("targets", 1, 5), ("five", 5, 1), ("ten", 10, 1), ("crowd", 20, 2), ("two-people", 4, 2), ("flat-palm", 5, 1)],
)
def test_as_many_fingers_of_as_many_people_touch_as_a_scene_says(name: str, fingers: int, people: int) -> None:
    assert max(sum(tip.touching for tip in frame) for frame in tips(name)) == fingers
    assert len({touch.person for touch in scene(name).touches}) == people


def test_a_still_finger_does_not_move_for_a_minute() -> None:
    for name in ("still", "sway"):
        (touch,) = scene(name).touches
        assert (touch.lift_ns - touch.down_ns) / 1e9 == pytest.approx(60.0)
        assert len({(tip.x, tip.y) for tip in touching(name)[2:-2]}) <= 2  # rounding may differ by a bit


def test_stacks_grow_to_44_mm_and_never_count_as_fingertips() -> None:
    of = scene("stacks")
    heights = [[stack.height_mm for stack in of.truth(index).stacks] for index in played(of)]
    assert max(map(max, filter(None, heights))) == 44.0
    assert {len(found) for found in heights} == {0, 3}
    assert not any(tips("stacks"))


def test_a_fingertip_in_a_truth_file_begins_with_the_example_s_keys() -> None:
    first = next(tip for frame in tips("targets") for tip in frame).as_json()
    assert list(first)[:5] == ["tip", "x", "y", "clearance_mm", "touching"]
    assert isinstance(first["x"], float)


@pytest.mark.parametrize("name", STEREO)
def test_stereo_scenes_are_in_millimetres(name: str) -> None:
    assert scene(name).sensor.unit == "mm"


@pytest.mark.parametrize("name", RENDERED)
def test_scenes_of_every_kind_render(name: str) -> None:
    cv2.setNumThreads(1)
    of = lab_scene(name, 750.0, 2)
    index = of.calibration_frames + of.frames // 2
    frame = of.frame(index)
    assert frame.raw.shape == (480, 640)
    assert frame.index == index
    valid = frame.raw != of.sensor.invalid
    assert valid.mean() > 0.3
    assert not np.array_equal(frame.raw, of.frame(of.calibration_frames - 1).raw)


def test_a_name_that_is_none_is_one_sentence_that_names_all() -> None:
    with pytest.raises(UsageError) as caught:
        lab_scene("tabs", 750.0, 1)
    assert str(caught.value).startswith("there is no lab scene 'tabs'; choose one of targets, ")


def test_a_negative_seed_is_one_sentence() -> None:
    with pytest.raises(UsageError, match="a lab scene's seed is a whole number from 0 on, not -1"):
        lab_scene("taps", 750.0, -1)
