"""A rendered finger from the air to the surface and back, as a client of profile 25Dcur is told of it."""

import pytest
from touchd.listen.checker import Checker, Seen
from touchd.listen.rules import Finding
from touchd.model import AreaCorners, Frame, TouchFrame
from touchd.outputs.fingertips import Fingertips
from touchd.outputs.profiles import CURSOR_25D
from touchd.outputs.screen import Screen
from touchd.outputs.tuio import TuioEncoder
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.table import Table

FRAME_NS = 33_333_333
CAMERA = TableCamera(height_mm=750.0, tilt_deg=6.0)
AREA = Area(centre_mm=(0.0, 0.0), size_mm=(500.0, 350.0))
EMPTY_FRAMES = 20
PLACE = (0.4, 0.6)
DESCENT_MM = [36.0, 33.0, 30.0, 26.0, 22.0, 17.0, 12.0]
GAPS_MM = [*DESCENT_MM, *[0.0] * 8, *DESCENT_MM[::-1]]


def settings() -> PipelineSettings:
    a, b, c, d = ((float(u), float(v)) for u, v in area_corners_px(CAMERA, AREA))
    return PipelineSettings(
        calibration=CalibrationSettings(frames=EMPTY_FRAMES), area=AreaCorners((a, b, c, d), AREA.size_mm)
    )


@pytest.fixture(scope="module")
def told() -> list[TouchFrame]:
    """Return what the pipeline says of a finger that comes down, rests and lifts."""
    table = Table(CAMERA, seed=3)
    pipeline = Pipeline(table.sensor, settings(), "a test")
    pipeline.calibrate()
    hands = [pointing_hand(HandPose(AREA.at(*PLACE), clearance_mm=gap_mm)) for gap_mm in GAPS_MM]
    scenes: list[list[Hand]] = [[] for _ in range(EMPTY_FRAMES)] + [[hand] for hand in hands]
    frames: list[Frame] = [table.render(scene, i * FRAME_NS, i) for i, scene in enumerate(scenes)]
    return [pipeline.step(frame) for frame in frames][EMPTY_FRAMES:]


def test_it_hovers_touches_and_hovers_again(told: list[TouchFrame]) -> None:
    words = ["touch" if frame.cursors else "hover" if frame.hovers else "nothing" for frame in told]
    assert [word for i, word in enumerate(words) if i == 0 or word != words[i - 1]] == ["hover", "touch", "hover"]
    assert words.count("touch") in range(8, 10)


def test_each_frame_tells_the_area_s_size_for_outputs_that_need_lengths(told: list[TouchFrame]) -> None:
    assert {frame.area_mm for frame in told} == {AREA.size_mm}


def test_the_touch_knows_its_hover_and_the_second_hover_its_touch(told: list[TouchFrame]) -> None:
    touch = next(frame.cursors[0] for frame in told if frame.cursors)
    first, last = told[0].hovers[0], told[-1].hovers[0]
    assert (touch.hover_id, last.session_id) == (first.hover_id, touch.session_id)


def test_it_is_one_cursor_and_no_rule_for_senders_is_broken(told: list[TouchFrame]) -> None:
    view = Fingertips(Screen(), full_mm=40.0)
    encoder, checker = TuioEncoder("touchd-test-main@127.0.0.1", 0, 100, CURSOR_25D), Checker()
    notes = [
        note
        for frame in told
        for datagram in encoder.next_frame(view.of(frame)).split(1472)
        for note in checker.feed(datagram, ("127.0.0.1", 40_000), frame.t_ns)
    ]
    assert [note.sentence() for note in notes if isinstance(note, Finding)] == []
    heights = [note.event.z or 0.0 for note in notes if isinstance(note, Seen)]
    assert {note.event.session_id for note in notes if isinstance(note, Seen)} == {1}
    assert heights[0] == pytest.approx(36.0 / 40.0, abs=0.1)
    assert min(heights) == 0.0
    assert heights[-1] == pytest.approx(36.0 / 40.0, abs=0.1)
