from itertools import pairwise
from math import dist

import cv2
import numpy as np
import pytest
from touchd.errors import UsageError
from touchd.model import AreaCorners
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.actors import Actor, Circle, Pinch
from touchd.table.hands import HandPose, pinching_hand
from touchd.table.scenario_names import DEFAULT_SCENARIO, SCENARIOS
from touchd.table.scenarios import AREA, CAMERA, area_corners, scenario
from touchd.table.script import Moment, Script
from touchd.table.show import Show, frame_index, frame_time_ns
from touchd.table.table import Table

from golden.truth import score

SIMPLE = [name for name in SCENARIOS if name != "mixed"]


def one_loop(name: str, seed: int = 1) -> list[Moment]:
    show = Show(name, seed, empty_frames=0)
    return [show.moment(index) for index in range(show.loop_frames)]


def touching_at_once(moments: list[Moment]) -> int:
    return max(sum(tip.touching for tip in moment.truth) for moment in moments)


def test_the_default_scenario_is_one_of_those_that_are_listed() -> None:
    assert DEFAULT_SCENARIO in SCENARIOS


@pytest.mark.parametrize("name", SIMPLE)
def test_every_scenario_shows_hands_within_a_second_and_takes_six_to_eleven(name: str) -> None:
    moments = one_loop(name)
    assert any(moment.truth for moment in moments[:30])
    assert 6 * 30 <= len(moments) <= 11 * 30


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", SIMPLE)
def test_all_touches_lie_well_within_the_area(name: str, seed: int) -> None:
    touching = [tip for moment in one_loop(name, seed) for tip in moment.truth if tip.touching]
    assert all(0.02 <= tip.x <= 0.98 and 0.02 <= tip.y <= 0.98 for tip in touching)


@pytest.mark.parametrize(
    ("name", "fingers"),
    [("taps", 1), ("drag", 1), ("pinch", 2), ("hover", 0), ("circles", 1), ("two-hands", 2), ("ten", 10)],
)
def test_as_many_fingers_touch_at_once_as_the_scenario_says(name: str, fingers: int) -> None:
    assert touching_at_once(one_loop(name)) == fingers


@pytest.mark.parametrize("name", SIMPLE)
def test_no_fingertip_jumps(name: str) -> None:
    for before, after in pairwise(one_loop(name)):
        if len(before.hands) == len(after.hands):
            tips = zip(before.hands, after.hands, strict=True)
            moved = [dist(a.at_mm, b.at_mm) for x, y in tips for a, b in zip(x.fingertips, y.fingertips, strict=True)]
            assert max(moved, default=0.0) < 50.0  # 1.5 m/s at 30 Hz


def test_the_mixed_scenario_is_a_minute_of_all_the_others() -> None:
    mixed = scenario("mixed", 1)
    assert 50.0 <= mixed.end_ns / 1e9 <= 70.0
    assert touching_at_once(one_loop("mixed")) == 10
    touches = {tip.tip for moment in one_loop("mixed") for tip in moment.truth if tip.touching}
    each = [{tip.tip for moment in one_loop(name) for tip in moment.truth if tip.touching} for name in SIMPLE]
    assert len(touches) == sum(map(len, each))


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_same_seed_plays_the_same_and_another_one_something_else(name: str) -> None:
    first, second, other = (scenario(name, seed).at(2_000_000_000) for seed in (5, 5, 6))
    assert first == second
    assert first != other


def test_a_scenario_that_does_not_exist_is_one_sentence_that_names_all() -> None:
    with pytest.raises(UsageError) as caught:
        scenario("pich", 1)
    assert str(caught.value) == (
        "there is no scenario 'pich'; choose one of taps, drag, pinch, hover, circles, two-hands, ten, mixed"
    )


def test_a_negative_seed_is_one_sentence() -> None:
    with pytest.raises(UsageError, match="a scenario's seed is a whole number from 0 on, not -1"):
        scenario("taps", -1)


def test_the_area_is_seen_whole_and_its_size_is_given() -> None:
    corners = area_corners()
    assert corners.size_mm == (600.0, 420.0)
    assert all(0.0 <= u <= 639.0 and 0.0 <= v <= 479.0 for u, v in corners.corners_px)
    assert isinstance(corners, AreaCorners)


def test_a_show_begins_with_the_empty_table_and_never_shows_it_so_long_again() -> None:
    show = Show("taps", 1, empty_frames=100)
    shown = [bool(show.moment(index).truth) for index in range(100 + 10 * show.loop_frames)]
    begin = shown.index(True)
    assert begin >= 100
    silences = "".join("x" if hands else "." for hands in shown[begin:]).split("x")
    assert max(map(len, silences)) < 100


def test_a_show_plays_its_scenario_over_and_over_and_rests_after_every_third_time() -> None:
    show = Show("taps", 1, empty_frames=0)
    loop = show.loop_frames
    assert [show.moment(index) for index in range(0, loop, 7)] == [
        show.moment(index) for index in range(2 * loop, 3 * loop, 7)
    ]
    rest = [show.moment(index).hands for index in range(3 * loop, 3 * loop + 45)]
    assert rest == [()] * 45
    assert show.moment(3 * loop + 45 + 60) == show.moment(60)


def test_frames_are_a_thirtieth_of_a_second_apart_for_ever() -> None:
    assert [frame_time_ns(index) for index in (0, 1, 2, 3)] == [0, 33_333_333, 66_666_666, 100_000_000]
    assert frame_time_ns(30 * 86_400) == 86_400_000_000_000
    assert [frame_index(t_ns) for t_ns in (0, 33_333_334, 99_999_999, 100_000_000)] == [0, 1, 2, 3]


@pytest.mark.parametrize("spread_mm", [30.0, 60.0, 120.0])
def test_a_pinching_hand_s_tips_are_as_far_apart_as_it_says_with_the_place_between_them(spread_mm: float) -> None:
    index, thumb = pinching_hand(HandPose((50.0, 20.0), heading_deg=30.0, spread_mm=spread_mm)).fingertips
    assert dist(index.at_mm, thumb.at_mm) == pytest.approx(spread_mm, rel=1e-3)
    assert np.add(index.at_mm, thumb.at_mm) / 2 == pytest.approx([50.0, 20.0])


def test_a_pinch_draws_its_tips_apart_and_turns_them() -> None:
    pinch = Pinch((0.0, 0.0), 40.0, 100.0, 1000.0, turn_deg=90.0)
    part = Script(CAMERA, AREA, [Actor(HandPose((0.0, 0.0)), (pinch,), shape=pinching_hand)])
    moments = (part.at(t) for t in range(0, part.end_ns, 5_000_000))
    touching = [moment for moment in moments if any(tip.touching for tip in moment.truth)]
    ways = [np.subtract(hand.fingertips[0].at_mm, hand.fingertips[1].at_mm) for (hand,) in (m.hands for m in touching)]
    assert np.hypot(*ways[0]) == pytest.approx(40.0, abs=0.5)
    assert np.hypot(*ways[-1]) == pytest.approx(100.0, abs=0.5)
    turned = np.degrees(np.arctan2(*ways[-1][::-1]) - np.arctan2(*ways[0][::-1]))
    assert turned == pytest.approx(90.0, abs=1.0)


def test_a_circle_goes_round_its_centre_and_ends_where_it_began() -> None:
    part = Script(CAMERA, AREA, [Actor(HandPose((0.0, 0.0)), (Circle((10.0, 20.0), 50.0, 2.0, 3000.0),))])
    moments = (part.at(t) for t in range(0, part.end_ns, 10_000_000))
    path = [m.hands[0].fingertips[0].at_mm for m in moments if any(tip.touching for tip in m.truth)]
    assert {round(dist(place, (10.0, 20.0)), 6) for place in path} == {50.0}
    assert path[0] == pytest.approx((10.0, -30.0), abs=0.1)
    assert path[-1] == pytest.approx((10.0, -30.0), abs=0.1)
    assert max(x for x, _ in path) == pytest.approx(60.0, abs=0.5)


@pytest.mark.parametrize(("name", "touches"), [("pinch", 6), ("hover", 0), ("ten", 30)])
def test_every_touch_of_a_scenario_is_found_once_and_none_that_is_not_there(name: str, touches: int) -> None:
    cv2.setNumThreads(1)
    table, show = Table(CAMERA, 1), Show(name, 1, empty_frames=60)
    settings = PipelineSettings(calibration=CalibrationSettings(frames=60), area=area_corners())
    pipeline = Pipeline(table.sensor, settings, "a test")
    pipeline.calibrate()
    moments = [show.moment(index) for index in range(60 + show.loop_frames)]
    frames = (table.render(m.hands, frame_time_ns(index), index) for index, m in enumerate(moments))
    events = [pipeline.step(frame).as_event() for frame in frames]
    found = score(events, [[tip.as_json() for tip in moment.truth] for moment in moments], AREA.size_mm)
    assert (found.touches, found.found, found.splits, found.false_cursors) == (touches, touches, 0, 0)
    assert max(found.errors_mm, default=0.0) <= 8.0
