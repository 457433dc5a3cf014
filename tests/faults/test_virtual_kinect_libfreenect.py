"""Debian's own C libfreenect reads the virtual Kinect: an independent check of the model."""

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from touchd.formats.recording import open_recording
from touchd.table.scene import TableCamera

from virtual_kinect.faults import Faults
from virtual_kinect.packages import need_packages
from virtual_kinect.pictures import array_of, gradient_pictures, table_pictures
from virtual_kinect.umock import VirtualBus

PATIENCE_S = 60


@pytest.fixture(autouse=True)
def _packages() -> None:
    need_packages()


@contextmanager
def recorder(bus: VirtualBus, folder: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """Run fakenect-record into ``folder``/recording, its words to ``folder``/words.txt, until it is left."""
    with (folder / "words.txt").open("wb") as words:
        process = subprocess.Popen(
            ["fakenect-record", str(folder / "recording")], env=bus.environment, stdout=subprocess.DEVNULL, stderr=words
        )
        try:
            yield process
            process.send_signal(signal.SIGINT)
            process.wait(PATIENCE_S)
        finally:
            process.kill()
            process.wait()


def wait_for(what: str, condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"no {what} in {PATIENCE_S} s"
        time.sleep(0.02)


def depth_frames(folder: Path) -> int:
    return len(list((folder / "recording").glob("d-*.pgm")))


def test_libfreenect_records_every_frame_to_the_pixel(tmp_path: Path) -> None:
    pictures = table_pictures(TableCamera(800.0), 3, [[]] * 3) + gradient_pictures(4)
    with VirtualBus(tmp_path, pictures, patient=True) as bus, recorder(bus, tmp_path):
        wait_for("30 frames", lambda: depth_frames(tmp_path) >= 30)
    recording = open_recording(tmp_path / "recording")
    raws = [recording.read(index).raw for index in range(len(recording))]
    first = next(i for i, picture in enumerate(pictures) if np.array_equal(array_of(picture), raws[0]))
    for index, raw in enumerate(raws):
        assert np.array_equal(raw, array_of(pictures[(first + index) % len(pictures)])), f"frame {index}"
    ticks = [int(name.split("-")[2].removesuffix(".pgm")) for name in _index(tmp_path)]
    assert {b - a for a, b in pairwise(ticks)} == {2_002_155}


def test_libfreenect_gets_no_frame_from_a_silent_camera_and_ends_when_it_is_pulled_out(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1)) as bus:
        bus.set_faults(Faults(silent=True))
        with recorder(bus, tmp_path) as process:
            wait_for("transfers", lambda: bool(bus.state()["streaming"]))
            assert process.poll() is None
            bus.unplug()
            wait_for("end of the recorder", lambda: process.poll() is not None)
    assert "USB camera marked dead" in (tmp_path / "words.txt").read_text()
    assert depth_frames(tmp_path) == 0


def _index(folder: Path) -> list[str]:
    return [name for name in (folder / "recording" / "INDEX.txt").read_text().split() if name.startswith("d-")]
