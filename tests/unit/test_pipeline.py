from dataclasses import replace

import numpy as np
import pytest
from touchd.geometry import KINECT_INVALID, kinect_v1_sensor
from touchd.model import AreaCorners, Frame, State
from touchd.pipeline import Pipeline
from touchd.ready import MissingArea, PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.crowd import contact_scene
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.relief import Book, Ground
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.table import Table

FRAME_NS = 33_333_333
CAMERA = TableCamera(height_mm=800.0, tilt_deg=10.0)
AREA = Area(centre_mm=(0.0, 0.0), size_mm=(600.0, 400.0))
CORNERS = [(float(u), float(v)) for u, v in area_corners_px(CAMERA, AREA)]
SETTINGS = PipelineSettings(
    calibration=CalibrationSettings(frames=20),
    area=AreaCorners((CORNERS[0], CORNERS[1], CORNERS[2], CORNERS[3]), AREA.size_mm),
)


@pytest.fixture(scope="module")
def empty() -> list[Frame]:
    table = Table(CAMERA, seed=1)
    return [table.render([], index * FRAME_NS, index) for index in range(20)]


@pytest.fixture(scope="module")
def touched() -> list[Frame]:
    table = Table(CAMERA, seed=1)
    hands = contact_scene(2, AREA)
    return [table.render(hands, index * FRAME_NS, index) for index in range(20, 26)]


@pytest.fixture
def pipeline(empty: list[Frame]) -> Pipeline:
    pipeline = Pipeline(Table(CAMERA, seed=1).sensor, SETTINGS, "a test")
    pipeline.calibrate()
    for frame in empty:
        pipeline.step(frame)
    return pipeline


def test_without_a_surface_it_says_so_and_finds_nothing(touched: list[Frame]) -> None:
    pipeline = Pipeline(kinect_v1_sensor(), SETTINGS, "a test")
    result = pipeline.step(touched[0])
    assert (result.state, result.why, result.cursors) == (
        State.NO_SURFACE,
        "no surface was learned: calibrate",
        (),
    )


def test_it_calibrates_on_exactly_the_frames_that_it_was_told_to(empty: list[Frame], touched: list[Frame]) -> None:
    pipeline = Pipeline(Table(CAMERA, seed=1).sensor, SETTINGS, "a test")
    pipeline.calibrate()
    results = [pipeline.step(frame) for frame in (*empty, touched[0])]
    assert [r.state for r in results] == [State.CALIBRATING] * 20 + [State.TRACKING]
    assert results[4].why == "frame 5 of 20"


def test_two_fingers_are_two_touches_that_stay(pipeline: Pipeline, touched: list[Frame]) -> None:
    for frame in touched:
        result = pipeline.step(frame)
        assert [cursor.session_id for cursor in result.cursors] == [1, 2]


def test_a_stall_ends_every_touch_and_a_finger_still_there_gets_a_new_id(
    pipeline: Pipeline, touched: list[Frame]
) -> None:
    pipeline.step(touched[0])
    stalled = pipeline.stall(touched[0].t_ns + 150_000_000)
    assert (stalled.state, stalled.cursors, stalled.index) == (State.NO_FRAMES, (), 20)
    assert [cursor.session_id for cursor in pipeline.step(touched[1]).cursors] == [3, 4]


def test_recalibrating_ends_every_touch(pipeline: Pipeline, touched: list[Frame]) -> None:
    pipeline.step(touched[0])
    pipeline.calibrate()
    result = pipeline.step(touched[1])
    assert (result.state, result.cursors) == (State.CALIBRATING, ())


def test_a_stored_surface_is_used_as_it_is(pipeline: Pipeline, touched: list[Frame]) -> None:
    assert pipeline.ready is not None
    other = Pipeline(pipeline.sensor, SETTINGS, "a test")
    other.use(pipeline.ready.surface)
    assert other.step(touched[0]) == pipeline.step(touched[0])


def test_the_report_tells_what_the_surface_is_worth(pipeline: Pipeline) -> None:
    assert pipeline.ready is not None
    report = pipeline.ready.report
    assert report.coverage > 0.99
    assert report.distance_mm == pytest.approx(800.0, abs=2.0)
    assert report.tilt_deg == pytest.approx(10.0, abs=0.5)
    assert report.flatness_mm < 2.0
    assert 0.2 < report.noise_mm < 1.0
    assert 0.0 < report.near_mm < report.far_mm < 20.0
    assert report.moved == 0.0
    assert report.problems == ()
    assert report.lines() == [
        f"surface: 800 mm away, tilted 10°, flat to {report.flatness_mm:.1f} mm; {report.coverage:.1%} of the area "
        f"usable, noise {report.noise_mm:.2f} mm, touches are looked for {report.near_mm:.1f} to "
        f"{report.far_mm:.1f} mm above it"
    ]


def test_a_hand_during_calibration_is_a_warning_and_a_mask() -> None:
    table = Table(CAMERA, seed=2)
    hands = contact_scene(5, AREA)
    pipeline = Pipeline(table.sensor, SETTINGS, "a test")
    pipeline.calibrate()
    for index in range(20):
        pipeline.step(table.render(hands if 6 <= index < 12 else [], index * FRAME_NS, index))
    assert pipeline.ready is not None
    report = pipeline.ready.report
    assert report.moved > 0.01
    assert any(
        problem.startswith("something moved over") and problem.endswith("recalibrate with nothing above the surface")
        for problem in report.problems
    )
    after = [pipeline.step(table.render([], index * FRAME_NS, index)) for index in range(20, 30)]
    assert all(result.cursors == () for result in after)


def test_a_covered_camera_is_named_as_such() -> None:
    pipeline = Pipeline(kinect_v1_sensor(), replace(SETTINGS, calibration=CalibrationSettings(frames=3)), "a test")
    pipeline.calibrate()
    blind = np.full((480, 640), KINECT_INVALID, np.uint16)
    results = [pipeline.step(Frame(index, index * FRAME_NS, blind)) for index in range(5)]
    assert [r.state for r in results] == [State.CALIBRATING] * 3 + [State.TRACKING] * 2
    assert pipeline.ready is not None
    assert pipeline.ready.report.problems[0].startswith("no pixel of the area can see a touch; is the camera covered")


def test_without_an_area_the_whole_picture_is_the_area(empty: list[Frame], touched: list[Frame]) -> None:
    pipeline = Pipeline(Table(CAMERA, seed=1).sensor, replace(SETTINGS, area=None), "a test")
    pipeline.calibrate()
    for frame in empty:
        pipeline.step(frame)
    (left, right) = sorted(pipeline.step(touched[0]).cursors, key=lambda cursor: cursor.x)
    expected = CAMERA.pixels(np.array([(*hand.fingertips[0].at_mm, 0.0) for hand in contact_scene(2, AREA)]))
    expected = expected[np.argsort(expected[:, 0])] / np.array([639.0, 479.0])
    assert [(left.x, left.y), (right.x, right.y)] == [pytest.approx(p, abs=0.012) for p in expected.tolist()]
    assert pipeline.ready is not None
    assert pipeline.ready.notes == ()


def test_for_a_daemon_without_an_area_the_flat_region_is_guessed_and_said(empty: list[Frame]) -> None:
    settings = replace(SETTINGS, area=None, missing_area=MissingArea.FLAT_REGION)
    pipeline = Pipeline(Table(CAMERA, seed=1).sensor, settings, "a test")
    pipeline.calibrate()
    for frame in empty:
        pipeline.step(frame)
    assert pipeline.ready is not None
    assert pipeline.ready.notes == ("area guessed: run touchd align",)
    width_mm, height_mm = pipeline.ready.area.size_mm
    assert width_mm == pytest.approx(640 / 575.8 * 800, rel=0.1)
    assert height_mm == pytest.approx(480 / 575.8 * 800, rel=0.1)


def test_an_area_size_over_three_percent_off_is_a_note_that_says_both(empty: list[Frame]) -> None:
    corners = SETTINGS.area
    assert corners is not None
    wrong = replace(SETTINGS, area=replace(corners, size_mm=(640.0, 400.0)))
    pipeline = Pipeline(Table(CAMERA, seed=1).sensor, wrong, "a test")
    pipeline.calibrate()
    for frame in empty:
        pipeline.step(frame)
    assert pipeline.ready is not None
    (note,) = pipeline.ready.notes
    assert note.startswith("area.size_mm says 640 x 400 mm but the camera measures 599 x 400 mm, 6% off")


BOOK_MM = 30.0
BOOK = Ground((Book((0.0, 0.0), (240.0, 180.0), BOOK_MM),))


def test_a_finger_on_a_book_that_lay_there_during_calibration_is_a_touch() -> None:
    table = Table(CAMERA, seed=3, ground=BOOK)
    pipeline = Pipeline(table.sensor, SETTINGS, "a test")
    pipeline.calibrate()
    down = [pointing_hand(HandPose((0.0, 0.0), clearance_mm=BOOK_MM + gap_mm)) for gap_mm in (30.0, 12.0, 0.0, 0.0)]
    hands: list[list[Hand]] = [[]] * 25 + [[hand] for hand in down]
    *before, coming, touching = [
        pipeline.step(table.render(shown, index * FRAME_NS, index)).cursors for index, shown in enumerate(hands)
    ]
    assert not any(before)
    (cursor,) = touching
    assert [each.session_id for each in coming] in ([], [cursor.session_id])
    assert cursor.height_mm < 6.0
    assert np.hypot(cursor.x - 0.5, cursor.y - 0.5) * AREA.size_mm[0] < 12.0


def test_the_paper_s_method_sees_what_lies_in_the_shell_over_a_book() -> None:
    table = Table(CAMERA, seed=3, ground=BOOK)
    pipeline = Pipeline(table.sensor, replace(SETTINGS, method="shell"), "a test")
    pipeline.calibrate()
    for index in range(25):
        pipeline.step(table.render([], index * FRAME_NS, index))
    frame = table.render([], 25 * FRAME_NS, 25)
    raw = frame.raw.copy()
    raw[235:247, 300:312] -= np.uint16(round(9.0 / float(table.sensor.step_mm[655])))
    (cursor,) = pipeline.step(replace(frame, raw=raw)).cursors
    assert cursor.height_mm == pytest.approx(9.0, abs=2.0)
