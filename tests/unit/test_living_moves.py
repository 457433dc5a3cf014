"""A surface that was moved, or that is hidden: touches end and say why, and go on by themselves."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from touchd.cli import run_command_line
from touchd.formats.libfreenect import write_libfreenect
from touchd.geometry import KINECT_INVALID, ZeroPlane, raw_of_depth, whole_picture
from touchd.model import Floats, Frame, Mask, State, TouchFrame
from touchd.ready import prepare
from touchd.state import load_surface, save_surface
from touchd.surface.watch import WHY_BLIND, WHY_COVERED, WHY_MOVED
from touchd.table.scene import Block, Capsule, Hand, TableCamera
from touchd.table.table import Table

from living_tables import AT_MM, Desk, cursor_counts, finger, off_raw
from shifting_table import SHAPE, gradient, off_by, uneven

DOWN_G = (0.0, 0.1, 0.99)


def moved_by(degrees_worth: float) -> Floats:
    """Return what a camera reads that was turned by so much: a slope in two directions, and a little farther off."""
    down = np.linspace(-0.4, 0.6, SHAPE[0], dtype=np.float32)[:, None]
    return gradient(degrees_worth) + degrees_worth * down


def states(results: list[TouchFrame]) -> list[State]:
    return [result.state for result in results]


@pytest.mark.parametrize("method", ["fingertip", "shell"])
@pytest.mark.parametrize("height_mm", [750.0, 1500.0])
def test_after_a_knock_no_touch_lives_longer_than_100_ms_and_taps_are_right_again_within_a_second(
    height_mm: float, method: str
) -> None:
    desk = Desk(height_mm, method)
    (before,) = desk.play(5, finger())[-1].cursors
    desk.shift(gradient(3.0))
    knocked = desk.play(12, finger())
    assert max(cursor_counts(knocked[3:8]), default=0) == 0
    assert {cursor.session_id for frame in knocked[:3] for cursor in frame.cursors} <= {before.session_id}
    assert State.PAUSED in states(knocked[:4])
    assert {frame.why for frame in knocked if frame.state is State.PAUSED} == {WHY_MOVED}
    assert states(desk.play(30))[-1] is State.TRACKING
    assert np.abs(off_raw(desk, gradient(3.0))).mean() < 0.2
    (cursor,) = desk.play(4, finger())[-1].cursors
    assert (cursor.x, cursor.y) == pytest.approx((before.x, before.y), abs=0.02)


def knocked_desk(height_mm: float, method: str, right_deg: float, down_deg: float) -> Desk:
    """A table that was touched, whose camera was then turned on the spot and has got used to it."""
    desk = Desk(height_mm, method)
    desk.play(5, finger())
    desk.play(60)
    camera = replace(desk.table.camera, knocked_deg=(right_deg, down_deg))
    desk.table = Table(camera, seed=4)
    desk.play(150)
    return desk


@pytest.mark.parametrize("method", ["fingertip", "shell"])
@pytest.mark.parametrize("height_mm", [750.0, 1500.0])
def test_after_a_knock_the_corners_follow_so_that_touches_are_where_they_were(height_mm: float, method: str) -> None:
    (before,) = Desk(height_mm, method).play(5, finger())[-1].cursors
    desk = knocked_desk(height_mm, method, 0.9, -0.7)
    after = desk.play(5, finger())[-1]
    (cursor,) = after.cursors
    width_mm, depth_mm = after.area_mm
    # By 12 mm and 24 mm, were the corners where they had been.
    assert abs(cursor.x - before.x) * width_mm < 0.004 * height_mm
    assert abs(cursor.y - before.y) * depth_mm < 0.004 * height_mm
    ready = desk.pipeline.ready
    assert ready is not None
    (note,) = ready.notes
    assert re.fullmatch(
        r"the camera was knocked, and the corners of the area followed, by up to 1\d px: if touches lie beside the "
        r"fingers, run touchd align",
        note,
    )


def test_corners_that_followed_stay_so_through_restarts_until_the_area_itself_is_given_anew(tmp_path: Path) -> None:
    desk = knocked_desk(750.0, "shell", 0.9, -0.7)
    ready = desk.pipeline.ready
    assert ready is not None
    other = prepare(ready.surface, replace(ready.settings, method="fingertip"))
    assert other.corners == ready.corners != ready.settings.area
    assert other.notes == ready.notes
    aligned = prepare(ready.surface, replace(ready.settings, area=whole_picture(ready.surface.sensor)))
    assert aligned.corners == whole_picture(ready.surface.sensor)
    assert aligned.notes == ()
    save_surface(tmp_path / "surface", ready.surface)
    stored = load_surface(tmp_path / "surface", ready.surface.sensor)
    again = prepare(stored, ready.settings)
    assert (again.corners, again.notes) == (ready.corners, ready.notes)


@pytest.mark.parametrize("shift", [gradient(24.0), moved_by(-18.0), np.full(SHAPE, -9.0, np.float32)])
def test_a_large_move_is_found_too(shift: Floats) -> None:
    desk = Desk(750.0, "shell")
    desk.play(4)
    desk.shift(shift)
    assert desk.play(4)[-1].state is State.PAUSED
    assert sum(cursor_counts(desk.play(60))) == 0
    assert np.abs(off_raw(desk, shift)).mean() < 0.2
    assert cursor_counts(desk.play(3, finger())) == [1, 1, 1]


def test_the_surface_is_told_anew_once_it_was_learned_again() -> None:
    desk = Desk(750.0, "shell")
    desk.play(62)
    ready = desk.pipeline.ready
    assert ready is not None
    desk.shift(gradient(3.0))
    desk.play(90)
    after = desk.pipeline.ready
    assert after is not None
    assert after.surface is not ready.surface
    moved = (after.surface.reference - ready.surface.reference)[ready.surface.valid]
    assert moved == pytest.approx(gradient(3.0)[ready.surface.valid], abs=2.0)
    assert after.method is ready.method
    assert after.notes == (
        "the camera was knocked, and the corners of the area followed, by up to 4 px: if touches lie beside the "
        "fingers, run touchd align",
    )
    vitals = desk.pipeline.vitals
    assert vitals is not None
    assert vitals.moves == 1
    assert vitals.drift_mm < 1.0


def test_a_table_that_does_not_get_empty_is_used_as_it_is_after_two_seconds() -> None:
    desk = Desk(750.0, "shell")
    desk.play(2, finger())
    desk.shift(gradient(3.0))
    assert sum(cursor_counts(desk.play(55, finger())[3:])) == 0
    assert cursor_counts(desk.play(20, finger()))[-1] == 1


def test_a_camera_that_is_colder_than_when_the_surface_was_learned_is_no_moved_one() -> None:
    desk = Desk(750.0, "shell")
    desk.shift(uneven(2.0))
    desk.play(90)
    assert np.abs(off_raw(desk, uneven(2.0))).mean() < 0.2
    assert desk.pipeline.vitals is not None
    assert desk.pipeline.vitals.moves == 0
    assert desk.pipeline.ready is not None
    assert desk.pipeline.ready.notes == ()


def test_a_thin_sheet_over_a_third_of_the_table_is_no_move() -> None:
    desk = Desk(750.0, "shell")
    desk.play(2)
    sheet = Hand((Block((-100.0, 0.0, 0.0), (400.0, 420.0, 1.8), 0.0),), ())
    assert {result.why for result in desk.play(30, sheet)} == {None}


def test_a_camera_that_goes_on_moving_is_waited_for() -> None:
    desk = Desk(750.0, "shell")
    desk.play(2)
    for step in range(20):
        desk.shift(gradient(1.5 * step))
        result = desk.play(1)[0]
    assert (result.state, result.why) == (State.PAUSED, WHY_MOVED)
    assert desk.play(20)[-1].state is State.TRACKING


def sleeve(x_mm: float) -> Hand:
    return Hand((Capsule((x_mm, -80.0, 60.0), (x_mm, 700.0, 90.0), 45.0, 55.0),), ())


def test_arms_that_sweep_in_and_out_are_no_move() -> None:
    desk = Desk(750.0, "shell")
    for step in range(30):
        arms = [sleeve(-300.0 + 20.0 * step), sleeve(40.0), sleeve(250.0 - 10.0 * step)]
        assert desk.play(1, *arms if step % 10 else ())[0].state is State.TRACKING
    vitals = desk.pipeline.vitals
    assert vitals is not None
    assert vitals.moves == 0


def played(desk: Desk, count: int, where: Mask, reading: int, *hands: Hand) -> list[TouchFrame]:
    """Play frames of which a part reads something else."""
    results = []
    for _ in range(count):
        frame = desk.frame(hands)
        results.append(desk.pipeline.step(replace(frame, raw=np.where(where, np.uint16(reading), frame.raw))))
    return results


EVERYWHERE = np.ones(SHAPE, np.bool_)


@pytest.mark.parametrize("far_mm", [None, 350.0])
def test_a_blocked_camera_pauses_touches_says_why_and_goes_on_by_itself(far_mm: float | None) -> None:
    desk = Desk(750.0, "shell")
    near = KINECT_INVALID if far_mm is None else int(raw_of_depth(desk.table.sensor, np.array(far_mm))[()])
    desk.play(3, finger())
    blocked = played(desk, 8, EVERYWHERE, near)
    assert states(blocked[3:]) == [State.PAUSED] * 5
    assert {frame.why for frame in blocked[3:]} == {WHY_BLIND if far_mm is None else WHY_COVERED}
    assert max(cursor_counts(blocked[3:])) == 0
    after = desk.play(8)
    assert states(after[4:]) == [State.TRACKING] * 4
    assert np.abs(off_raw(desk, 0.0)).mean() < 0.05
    assert cursor_counts(desk.play(2, finger())) == [1, 1]


def test_under_a_partly_blocked_picture_touches_end_there_and_the_rest_works() -> None:
    desk = Desk(750.0, "shell")
    there = finger(at_mm=(-AT_MM[0] - 120.0, AT_MM[1]))
    assert cursor_counts(desk.play(3, finger(), there))[-1] == 2
    left = np.indices(SHAPE)[1] < SHAPE[1] // 2
    blocked = played(desk, 6, left, KINECT_INVALID, finger(), there)
    assert states(blocked) == [State.TRACKING] * 6
    assert len(blocked[-1].cursors) == 1
    assert blocked[-1].cursors[0].x > 0.5


def test_a_camera_that_feels_a_jolt_pauses_at_once_and_goes_on_where_nothing_was_moved() -> None:
    desk = Desk(750.0, "shell", accel_g=DOWN_G)
    desk.play(10, finger())
    desk.accel_g = (0.4, 0.1, 0.8)
    (jolted,) = desk.play(1, finger())
    assert (jolted.state, jolted.why, jolted.cursors) == (State.PAUSED, WHY_MOVED, ())
    desk.accel_g = DOWN_G
    assert states(desk.play(12))[-1] is State.TRACKING
    assert np.abs(off_raw(desk, 0.0)).mean() < 0.15


def test_a_replay_tells_of_a_knock_in_its_events(tmp_path: Path) -> None:
    table = Table(TableCamera(750.0, tilt_deg=6.0), seed=4)
    frames = []
    for index in range(70):
        hands = [finger()] if 30 <= index < 44 else []
        frames.append(table.render(hands, index * 33_333_333, index, off_by(gradient(3.0) if index >= 40 else 0.0)))
    write_libfreenect(tmp_path / "recording", frames, ZeroPlane())
    config, told = tmp_path / "touchd.yaml", tmp_path / "events.jsonl"
    config.write_text("calibration: {frames: 20}\ntouch: {method: shell}\n")
    replay = ["replay", str(tmp_path / "recording"), "--config", str(config), "--events", str(told)]
    assert run_command_line(replay) == 0
    events = [json.loads(line) for line in told.read_text().splitlines()]
    paused = [event["frame"] for event in events if event["state"] == "paused"]
    assert 40 <= paused[0] <= 42
    assert paused == list(range(paused[0], paused[-1] + 1))
    assert len(paused) < 15
    assert {event["why"] for event in events if event["state"] == "paused"} == {WHY_MOVED}
    assert events[-1]["state"] == "tracking"


def test_a_surface_that_cannot_be_found_again_is_learned_from_the_beginning() -> None:
    desk = Desk(750.0, "shell")
    desk.play(2)
    elsewhere = (700.0 + 150.0 * np.sin(np.indices(SHAPE)[1] / 40.0)).astype(np.uint16)
    index = desk.frames
    results = [desk.pipeline.step(Frame(index + i, (index + 10 * i) * 33_333_333, elsewhere)) for i in range(25)]
    assert State.PAUSED in states(results)
    assert results[-1].state is State.CALIBRATING
