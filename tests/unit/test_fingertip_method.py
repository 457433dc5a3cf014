"""The fingertip method on rendered hands: what it finds, where, and what it leaves alone."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import cv2
import numpy as np
import pytest
from touchd.contacts.belief import Belief, Beliefs, Known
from touchd.contacts.company import Standing
from touchd.contacts.fingertip import FingertipMethod, Found
from touchd.contacts.fit import Picture, Quality
from touchd.contacts.heights import Box
from touchd.contacts.judge import Judge, Opinion
from touchd.contacts.method import Sighting
from touchd.contacts.recurrent import Said, learned_weights
from touchd.contacts.tips import Guess, Tip
from touchd.errors import ConfigError
from touchd.model import AreaCorners, Floats, Frame, Image16
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.hands import HandPose, open_hand, pointing_hand
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.table import Table

from unit.fingertips import seen_at, standing_at

FRAME_NS = 33_333_333
EMPTY_FRAMES = 30
CAMERA = TableCamera(height_mm=750.0, tilt_deg=8.0, roll_deg=4.0)
AREA = Area(centre_mm=(0.0, 0.0), size_mm=(560.0, 380.0))
CORNERS = [(float(u), float(v)) for u, v in area_corners_px(CAMERA, AREA)]
SETTINGS = PipelineSettings(
    calibration=CalibrationSettings(frames=EMPTY_FRAMES),
    method="fingertip",
    area=AreaCorners((CORNERS[0], CORNERS[1], CORNERS[2], CORNERS[3]), AREA.size_mm),
)

NOTHING = np.zeros((0, 0), np.float32)
PICTURE = Picture(NOTHING, np.zeros((0, 0), np.uint8), Box(0, 0, 0, 0))


@pytest.fixture(scope="module")
def table() -> Table:
    return Table(CAMERA, seed=4)


@pytest.fixture(scope="module")
def pipeline(table: Table) -> Pipeline:
    pipeline = Pipeline(table.sensor, SETTINGS, "a test")
    pipeline.calibrate()
    for index in range(EMPTY_FRAMES):
        pipeline.step(table.render([], index * FRAME_NS, index))
    return pipeline


@pytest.fixture
def method(pipeline: Pipeline) -> FingertipMethod:
    ready = pipeline.ready
    assert ready is not None
    return FingertipMethod(ready.place)


def seen_of(method: FingertipMethod, table: Table, hands: list[Hand], index: int = EMPTY_FRAMES) -> Sighting:
    return method.find(table.render(hands, index * FRAME_NS, index).raw, [])


def off_mm(sighting: Sighting, at_mm: tuple[float, float]) -> list[float]:
    x_mm, y_mm = at_mm[0] + AREA.size_mm[0] / 2, at_mm[1] + AREA.size_mm[1] / 2
    return sorted(float(np.hypot(c.x_mm - x_mm, c.y_mm - y_mm)) for c in sighting.contacts)


def test_an_empty_table_shows_nothing(method: FingertipMethod, table: Table) -> None:
    assert seen_of(method, table, []) == Sighting([], [])


@pytest.mark.parametrize("heading_deg", [0.0, 75.0, 160.0, 250.0, 320.0])
@pytest.mark.parametrize("at", [(-180.0, 100.0), (0.0, 0.0), (170.0, -90.0)])
def test_a_touching_finger_is_one_firm_contact_under_its_tip(
    method: FingertipMethod, table: Table, at: tuple[float, float], heading_deg: float
) -> None:
    sighting = seen_of(method, table, [pointing_hand(HandPose(at, heading_deg=heading_deg))])
    assert [contact.firm for contact in sighting.contacts] == [True]
    assert off_mm(sighting, at)[0] < 4.0


@pytest.mark.parametrize("scale", [0.75, 1.0, 1.15])
def test_hands_of_all_sizes_touch_where_they_do(method: FingertipMethod, table: Table, scale: float) -> None:
    at = (40.0, -30.0)
    assert off_mm(seen_of(method, table, [pointing_hand(HandPose(at, scale=scale))]), at)[0] < 4.0


@pytest.mark.parametrize("clearance_mm", [14.0, 25.0, 45.0])
def test_a_hovering_finger_is_no_contact(method: FingertipMethod, table: Table, clearance_mm: float) -> None:
    hand = pointing_hand(HandPose((0.0, 0.0), clearance_mm=clearance_mm, heading_deg=20.0))
    assert not any(contact.firm for contact in seen_of(method, table, [hand]).contacts)


def test_where_a_finger_surely_hovers_is_said(method: FingertipMethod, table: Table) -> None:
    hand = pointing_hand(HandPose((0.0, 0.0), clearance_mm=18.0))
    lifted_mm = seen_of(method, table, [hand]).lifted_mm
    assert min(np.hypot(x - AREA.size_mm[0] / 2, y - AREA.size_mm[1] / 2) for x, y in lifted_mm) < 10.0


def test_all_five_fingers_of_a_hand_are_found(method: FingertipMethod, table: Table) -> None:
    hand = open_hand(HandPose((0.0, 0.0), scale=1.05))
    sighting = seen_of(method, table, [hand])
    assert len(sighting.contacts) == 5
    for tip in hand.fingertips:
        assert off_mm(sighting, tip.at_mm)[0] < 4.0


def test_a_thing_that_nowhere_rises_like_a_hand_is_no_contact(method: FingertipMethod, table: Table) -> None:
    raw = table.render([], 0, EMPTY_FRAMES).raw.copy()
    raw[200:300, 280:330] -= 6  # about 9 mm: a phone
    raw[200:212, 400:460] -= 8  # a pen
    assert method.find(raw, []).contacts == []


def test_the_same_pictures_give_the_same_contacts(pipeline: Pipeline, table: Table) -> None:
    frames = [table.render([open_hand(HandPose((0.0, 0.0)))], 0, index) for index in range(40, 43)]

    def again() -> list[Sighting]:
        ready = pipeline.ready
        assert ready is not None
        method = FingertipMethod(ready.place)
        return [method.find(frame.raw, [(200.0, 100.0)]) for frame in frames]

    assert again() == again()


def test_pictures_of_noise_alone_do_no_harm(method: FingertipMethod, table: Table) -> None:
    rng = np.random.default_rng(3)
    raw = rng.integers(0, 2048, table.render([], 0, 0).raw.shape, np.uint16)
    assert not any(contact.firm for contact in method.find(raw, [(10.0, 10.0)]).contacts)
    assert method.find(np.full_like(raw, table.sensor.invalid), [(10.0, 10.0)]).contacts == []


def rough(table: Table) -> Image16:
    """Return a picture of the empty table in which noise stands as high as hands, everywhere."""
    bumps = cv2.GaussianBlur(np.random.default_rng(5).standard_normal((480, 640)), (0, 0), 3.0)
    raw: Image16 = (table.render([], 0, 0).raw - 30.0 * np.abs(bumps) / np.abs(bumps).max()).astype(np.uint16)
    return raw


def test_of_a_picture_full_of_noise_no_more_is_looked_at_than_hands_have(method: FingertipMethod, table: Table) -> None:
    found = method.look(rough(table), [])
    assert found is not None
    assert 32 < len(found.tips) <= 96


def test_where_a_touch_was_expected_is_looked_at_in_noise_as_well(method: FingertipMethod, table: Table) -> None:
    inside = [(x_mm, y_mm) for x_mm in range(40, 560, 60) for y_mm in range(40, 380, 60)]
    found = method.look(rough(table), inside)
    assert found is not None
    assert any(not tip.guess.shown for tip in found.tips)


def test_a_tap_of_two_frames_is_a_touch_and_ends_when_the_finger_is_up(pipeline: Pipeline, table: Table) -> None:
    counts = []
    for index, clearance_mm in enumerate((30.0, 20.0, 0.0, 0.0, 16.0, 25.0), start=60):
        hand = pointing_hand(HandPose((30.0, 20.0), clearance_mm=clearance_mm))
        counts.append(len(pipeline.step(table.render([hand], index * FRAME_NS, index)).cursors))
    assert counts[:4] == [0, 0, 1, 1]
    assert counts[-1] == 0


def test_a_method_that_nobody_brings_is_refused_by_name(pipeline: Pipeline) -> None:
    ready = pipeline.ready
    assert ready is not None
    other = Pipeline(pipeline.sensor, replace(SETTINGS, method="guess"), "a test")
    with pytest.raises(
        ConfigError, match=r"touch\.method: there is no method 'guess'; choose one of fingertip, shell, or install"
    ):
        other.use(ready.surface)


def test_the_first_frame_after_calibrating_may_already_show_a_touch(table: Table) -> None:
    pipeline = Pipeline(table.sensor, SETTINGS, "a test")
    pipeline.calibrate()
    frames: list[Frame] = [table.render([], index * FRAME_NS, index) for index in range(EMPTY_FRAMES)]
    frames.append(table.render([pointing_hand(HandPose((0.0, 0.0)))], EMPTY_FRAMES * FRAME_NS, EMPTY_FRAMES))
    assert [len(pipeline.step(frame).cursors) for frame in frames][-2:] == [0, 1]


def over_the_table(clearance_mm: float) -> HandPose:
    return HandPose(at_mm=(20.0, -10.0), heading_deg=10.0, pitch_deg=35.0, clearance_mm=clearance_mm)


@pytest.mark.parametrize("height_mm", [12.0, 20.0, 30.0])
def test_a_fingertip_held_in_the_air_is_told_of_with_its_height_and_the_place_under_it(
    method: FingertipMethod, table: Table, height_mm: float
) -> None:
    hand = pointing_hand(over_the_table(height_mm))
    *_, sighting = (seen_of(method, table, [hand], EMPTY_FRAMES + number) for number in range(3))
    assert sighting.contacts == []
    x_mm, y_mm = 20.0 + AREA.size_mm[0] / 2, -10.0 + AREA.size_mm[1] / 2
    near = [hover for hover in sighting.hovers if np.hypot(hover.x_mm - x_mm, hover.y_mm - y_mm) < 4.0]
    assert len(near) == 1
    assert near[0].height_mm == pytest.approx(height_mm, abs=3.0)
    assert not near[0].firm


def test_a_touching_fingertip_does_not_hover(pipeline: Pipeline, table: Table) -> None:
    for index in range(4):
        height_mm = 24.0 - 8.0 * index
        hand = pointing_hand(over_the_table(height_mm))
        frame = pipeline.step(table.render([hand], (EMPTY_FRAMES + index) * FRAME_NS, EMPTY_FRAMES + index))
        assert (len(frame.cursors), len(frame.hovers)) == ((1, 0) if height_mm <= 0.0 else (0, 1)) or height_mm == 8.0
    pipeline.stall((EMPTY_FRAMES + 9) * FRAME_NS)


class Convinced(Beliefs):
    """Takes everything for a touch, the more likely the farther right it is, and a little off to the right."""

    def update(self, now: Sequence[Standing]) -> list[Belief]:
        """Say so of each."""
        return [Belief(Said(5.0 + 0.01 * one.rest_mm[0], 5.0, 0.0, *turned(one.towards, 2.0)), None) for one in now]


class Doubting(Beliefs):
    """Says the odds of touching and of being a fingertip that it is given, and that each came by 9 mm, at a speed."""

    def __init__(self, odds: float, finger_odds: float, way_px: float) -> None:
        super().__init__(1.0, learned_weights())
        self._said, self._way_px = Said(odds, finger_odds, 9.0, 0.0, 0.0), way_px

    def update(self, now: Sequence[Standing]) -> list[Belief]:
        """Say so of each."""
        was = [standing_at(one.rest_mm[0] - 9.0, 100.0) for one in now]
        state = np.zeros(32, np.float32)
        return [Belief(self._said, Known(one, state, self._said, (self._way_px, 0.0), 0.0)) for one in was]


def turned(towards: tuple[float, float], right_mm: float) -> tuple[float, float]:
    """Return how far along and across a finger it is to go right."""
    return right_mm * towards[0], -right_mm * towards[1]


def test_of_two_too_near_to_be_two_fingers_the_likelier_one_touches_where_it_is_believed_to(
    method: FingertipMethod, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = [(100.0, 100.0), (109.0, 100.0), (140.0, 100.0)]
    standing = iter([standing_at(*place) for place in places])
    monkeypatch.setattr(method, "look", lambda *_: Found([], [], Quality([], [], []), NOTHING, PICTURE))
    monkeypatch.setattr(method._steady, "settle", lambda *_: [seen_at(300.0, 200.0)] * 3)
    monkeypatch.setattr(method, "_standing", lambda _: next(standing))
    method._beliefs = Convinced(1.0, learned_weights())
    told = method.find(np.zeros((480, 640), np.uint16), [])
    assert sorted((contact.x_mm, contact.y_mm) for contact in told.contacts) == [(111.0, 100.0), (142.0, 100.0)]


@pytest.mark.parametrize(
    ("odds", "finger_odds", "way_px", "lifted_mm"),
    [
        (-2.0, 4.0, 1.0, [(91.0, 100.0)]),
        (-1.0, 4.0, 1.0, []),
        (-2.0, -1.0, 1.0, []),
        (-2.0, 4.0, 9.0, []),
        (-5.0, 4.0, 9.0, [(100.0, 100.0)]),
    ],
)
def test_a_finger_that_is_seen_to_lift_has_left_the_place_where_it_touched(
    method: FingertipMethod,
    monkeypatch: pytest.MonkeyPatch,
    odds: float,
    finger_odds: float,
    way_px: float,
    lifted_mm: list[tuple[float, float]],
) -> None:
    monkeypatch.setattr(method, "look", lambda *_: Found([], [], Quality([], [], []), NOTHING, PICTURE))
    monkeypatch.setattr(method._steady, "settle", lambda *_: [seen_at(300.0, 200.0)])
    monkeypatch.setattr(method, "_standing", lambda _: standing_at(100.0, 100.0))
    method._beliefs = Doubting(odds, finger_odds, way_px)
    assert method.find(np.zeros((480, 640), np.uint16), []).lifted_mm == lifted_mm


class NobodyFound(Judge):
    """Takes nothing for a fingertip."""

    def opinions(self, traits: Floats) -> list[Opinion]:
        """Say so of each."""
        return [Opinion(-9.0, -9.0, 0.0, 0.0, 0.0, np.zeros(64, np.float32))] * len(traits)


def begun_at(method: FingertipMethod, table: Table, index: int) -> list[tuple[float, float]]:
    """Return how far (px) from their guesses the fits of a picture begin."""
    tips: list[Tip] = []
    begin = method._memory.begin

    def noted(guess: Guess) -> Tip:
        tips.append(begin(guess))
        return begin(guess)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(method._memory, "begin", noted)
        seen_of(method, table, [pointing_hand(HandPose((30.0, 20.0), pitch_deg=50.0))], index)
    return [(tip.u - tip.guess.u, tip.v - tip.guess.v) for tip in tips]


def test_what_is_taken_for_no_fingertip_is_looked_for_anew_in_the_next_picture(
    method: FingertipMethod, table: Table
) -> None:
    begun_at(method, table, 100)
    assert any(off != (0.0, 0.0) for off in begun_at(method, table, 101))
    method._judge = NobodyFound([])
    begun_at(method, table, 102)
    assert set(begun_at(method, table, 103)) == {(0.0, 0.0)}


def fitted_off_mm(
    method: FingertipMethod, table: Table, pose: HandPose, expected_mm: Sequence[tuple[float, float]]
) -> list[float]:
    """Return how far from where a finger touches fits of one picture rest."""
    found = method.look(table.render([pointing_hand(pose)], EMPTY_FRAMES * FRAME_NS, EMPTY_FRAMES).raw, expected_mm)
    assert found is not None
    places = [method._place_mm(*tip.foot_px) for tip in found.resting]
    return [float(np.hypot(*np.subtract(place, on_area_mm(pose)))) for place in places]


def on_area_mm(pose: HandPose) -> tuple[float, float]:
    return pose.at_mm[0] + AREA.size_mm[0] / 2, pose.at_mm[1] + AREA.size_mm[1] / 2


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, 180.0, 270.0])
def test_a_finger_so_steep_that_it_stands_high_over_its_own_tip_is_looked_at(
    method: FingertipMethod, table: Table, heading_deg: float
) -> None:
    pose = HandPose((30.0, 20.0), heading_deg=heading_deg, pitch_deg=70.0)
    assert min(fitted_off_mm(method, table, pose, [])) < 5.0


def test_what_stands_higher_still_is_looked_at_only_where_a_finger_touched(
    method: FingertipMethod, table: Table
) -> None:
    pose = HandPose((30.0, 20.0), heading_deg=180.0, pitch_deg=85.0)
    assert min(fitted_off_mm(method, table, pose, []), default=inf) > 30.0
    assert min(fitted_off_mm(method, table, pose, [on_area_mm(pose)])) < 10.0
