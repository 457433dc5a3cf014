import json
import math
import os
import resource
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest
from touchd.errors import ExitCode, OutputError
from touchd.model import Cursor, Hand, Hover, State, TableObject, TouchFrame
from touchd.outputs.events import EventWriter, QueuedEventWriter
from touchd.outputs.output import Output, OutputStatus

CURSOR = Cursor(3, 0.1, 1 / 3, 0.25, -0.5, 0.0, 4.5, 60.0, 0.125)
PATIENCE_S = 30.0

Mode = Literal["w", "a"]


def frame(index: int, *cursors: Cursor) -> TouchFrame:
    return TouchFrame(index, index * 1_000_000_000, State.TRACKING, cursors)


def written(path: Path) -> list[int]:
    return [json.loads(line)["frame"] for line in path.read_text(encoding="ascii").splitlines()]


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """Make the system refuse to let any file grow beyond ``size`` bytes, as a full disk would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_line_is_one_compact_object_in_full_precision(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    with EventWriter(path) as writer:
        writer.write(
            replace(
                frame(7, replace(CURSOR, hand=4)),
                hovers=(Hover(2, 0.5, 0.75, 12.5),),
                hands=(Hand(4, 0.5, 1.25, 80.0, "left", 1),),
                objects=(TableObject(9, ((0.0, 0.0), (0.5, 0.0), (0.5, 0.25)), 8.0),),
            )
        )
    assert path.read_text(encoding="ascii") == (
        '{"frame":7,"t":7.0,"state":"tracking","why":null,"cursors":[{"id":3,"x":0.1,"y":0.3333333333333333,'
        '"vx":0.25,"vy":-0.5,"accel":0.0,"height_mm":4.5,"area_mm2":60.0,"angle":0.125,"hand":4}],'
        '"hovers":[{"id":2,"x":0.5,"y":0.75,"height_mm":12.5,"hand":null}],'
        '"hands":[{"id":4,"x":0.5,"y":1.25,"height_mm":80.0,"side":"left","person":1}],'
        '"objects":[{"id":9,"outline":[[0.0,0.0],[0.5,0.0],[0.5,0.25]],"height_mm":8.0}]}\n'
    )


def test_every_frame_has_its_line_in_order_and_readable_before_the_close(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    with EventWriter(path) as writer:
        for index in range(5):
            writer.write(frame(index))
            assert written(path) == list(range(index + 1))


def test_a_file_is_begun_anew_or_added_to_as_asked(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    modes: list[Mode] = ["w", "a", "w", "a", "a"]
    for index, mode in enumerate(modes):
        with EventWriter(path, mode) as writer:
            writer.write(frame(index))
    assert written(path) == [2, 3, 4]


def test_a_path_that_cannot_be_opened_is_named_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "events.jsonl"
    with pytest.raises(OutputError) as refused:
        EventWriter(path)
    assert refused.value.exit_code is ExitCode.CANNOT_WRITE
    assert str(refused.value) == (
        f"Cannot open {path} to write events: No such file or directory; choose a path that can be written."
    )


def test_a_full_disk_is_named_with_the_path() -> None:
    with EventWriter(Path("/dev/full")) as writer, pytest.raises(OutputError) as refused:
        writer.write(frame(0))
    assert refused.value.exit_code is ExitCode.CANNOT_WRITE
    assert str(refused.value) == (
        "Cannot write events to /dev/full: No space left on device; make room or choose another path."
    )


@pytest.mark.parametrize("mode", ["w", "a"])
def test_a_line_that_only_half_fits_leaves_whole_lines_behind(tmp_path: Path, mode: Mode) -> None:
    path = tmp_path / "events.jsonl"
    with EventWriter(path, mode) as writer:
        writer.write(frame(0))
        with files_of_at_most(path.stat().st_size + 10), pytest.raises(OutputError, match="File too large"):
            writer.write(frame(1))
        assert written(path) == [0]
        writer.write(frame(2))
    assert written(path) == [0, 2]


def test_a_number_that_json_lacks_is_a_bug_and_writes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    with EventWriter(path) as writer, pytest.raises(ValueError, match="not JSON compliant"):
        writer.write(frame(0, replace(CURSOR, x=math.nan)))
    assert path.read_bytes() == b""


def test_the_queue_writes_all_it_took_before_it_closes(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    output: Output = QueuedEventWriter(path)
    output.start()
    for index in range(100):
        output.publish(frame(index), 0)
        output.tick(0)
    output.close()
    assert written(path) == list(range(100))
    assert output.status() == OutputStatus(f"events to {path}", sent=100, failed=0, dropped=0, last_error=None)


def test_the_queue_adds_to_what_an_earlier_run_wrote(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    for index in range(2):
        output = QueuedEventWriter(path)
        output.start()
        output.publish(frame(index), 0)
        output.close()
    assert written(path) == [0, 1]


def test_a_full_queue_drops_the_new_and_counts(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    output = QueuedEventWriter(path, capacity=4)
    for index in range(7):  # nothing takes from the queue before the start
        output.publish(frame(index), 0)
    assert output.dropped == 3
    output.start()
    output.close()
    assert written(path) == [0, 1, 2, 3]
    assert output.status().sent == 4


def test_after_the_close_frames_are_dropped_and_counted(tmp_path: Path) -> None:
    output = QueuedEventWriter(tmp_path / "events.jsonl")
    output.start()
    output.close()
    output.publish(frame(0), 0)
    assert output.dropped == 1


def test_an_output_that_never_started_can_be_closed(tmp_path: Path) -> None:
    output = QueuedEventWriter(tmp_path / "events.jsonl")
    output.close()
    assert not (tmp_path / "events.jsonl").exists()


def test_a_disk_that_is_full_costs_the_queue_lines_and_no_more() -> None:
    output = QueuedEventWriter(Path("/dev/full"))
    output.start()
    for index in range(3):
        output.publish(frame(index), 0)
    output.close()
    assert (output.status().sent, output.status().failed) == (0, 3)
    assert output.last_error == (
        "Cannot write events to /dev/full: No space left on device; make room or choose another path."
    )


def test_a_path_that_appears_later_is_written_to_from_then_on(tmp_path: Path) -> None:
    folder = tmp_path / "stick"
    path = folder / "events.jsonl"
    output = QueuedEventWriter(path)
    output.start()
    output.publish(frame(0), 0)
    deadline_s = time.monotonic() + PATIENCE_S
    while output.status().failed == 0:
        assert time.monotonic() < deadline_s
    assert str(output.last_error).startswith(f"Cannot open {path} to write events: No such file or directory;")
    folder.mkdir()
    output.publish(frame(1), 0)
    output.close()
    assert written(path) == [1]


def test_a_frame_that_cannot_be_a_line_does_not_stop_the_queue(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    output = QueuedEventWriter(path)
    output.start()
    output.publish(frame(0, replace(CURSOR, accel=math.inf)), 0)
    output.publish(frame(1), 0)
    output.close()
    assert written(path) == [1]
    assert output.status().failed == 1


def test_a_writer_that_hangs_holds_up_neither_frames_nor_the_close(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)  # opening it for writing waits for a reader
    output = QueuedEventWriter(path, capacity=2, drain_s=0.01)
    output.start()
    for index in range(10):
        output.publish(frame(index), 0)
    output.close()
    assert output.dropped >= 7
    (writer,) = (thread for thread in threading.enumerate() if thread.name == f"events to {path}")
    with path.open(encoding="ascii") as reader:
        lines = reader.readlines()
    writer.join(PATIENCE_S)
    assert [json.loads(line)["frame"] for line in lines][:2] == [0, 1]
    assert len(lines) + output.dropped == 10
