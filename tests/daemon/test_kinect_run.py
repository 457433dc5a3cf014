"""`touchd run` with a Kinect: a virtual one under the real libusb."""

import json
import os
import signal
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from touchd.table.scenarios import AREA

from clients.comparison import differences, learned_offset
from clients.harness import OscDump, PythonTuio
from daemon.running import running, wait_until
from virtual_kinect.bus import KinectPlan, Model
from virtual_kinect.packages import need_packages
from virtual_kinect.pictures import gradient_pictures
from virtual_kinect.played import DRAGGED, TOUCHED_AT, Played, drags, held_touch, touchd_on, write_config
from virtual_kinect.umock import VirtualBus

PATIENCE_S = 60
NO_WRITE_EXECUTE = str(Path(__file__).with_name("no_write_execute.py"))
TWO_1473 = (KinectPlan(Model.XBOX_1473, "B0042", (1,)), KinectPlan(Model.XBOX_1473, "B0077", (2,)))


@pytest.fixture(autouse=True)
def _packages() -> None:
    need_packages()


@pytest.fixture(scope="module")
def touch() -> Played:
    return held_touch()


def events_in(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_every_pixel_is_right_and_no_frame_is_missing(tmp_path: Path) -> None:
    pictures = gradient_pictures(5)
    checksums = [zlib.crc32(picture) for picture in pictures]
    with VirtualBus(tmp_path, pictures, patient=True) as bus:
        done = subprocess.run(
            [sys.executable, "-m", "virtual_kinect.source_client", "60"],
            env=bus.environment | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=True,
        )
    seen = json.loads(done.stdout)
    begin = checksums.index(seen[0][2])
    assert seen == [[index, 0, checksums[(begin + index) % 5]] for index in range(60)]


def test_its_touches_arrive_at_real_clients(tmp_path: Path) -> None:
    with (
        PythonTuio() as python_tuio,
        OscDump() as oscdump,
        drags().on_a_bus(tmp_path, patient=True) as bus,
    ):
        config = write_config(tmp_path / "touchd.yaml", [python_tuio.destination, oscdump.destination])
        with running(config, tmp_path / "state", touchd_on(bus)) as daemon:
            wait_until(lambda: len(python_tuio.log.removes) >= 3)
            assert daemon.end(signal.SIGTERM) == 0
        events = events_in(config.with_suffix(".jsonl"))
        for client in (python_tuio, oscdump):
            client.sync()
            assert differences(client.log, events, learned_offset(client.log, events)) == []
    seen_mm = np.array([(cursor["x"], cursor["y"]) for event in events for cursor in event["cursors"]]) * AREA.size_mm
    begin_mm, end_mm = np.array(DRAGGED) * AREA.size_mm
    length_mm = np.linalg.norm(end_mm - begin_mm)
    along, across = (end_mm - begin_mm) / length_mm, (begin_mm - end_mm)[::-1] * (1.0, -1.0) / length_mm
    assert np.abs((seen_mm - begin_mm) @ across).max() < 8.0
    travelled_mm = (seen_mm - begin_mm) @ along
    assert travelled_mm.min() == pytest.approx(0.0, abs=30.0)
    assert travelled_mm.max() == pytest.approx(length_mm, abs=30.0)


def test_sigterm_while_streaming_stops_the_camera_and_lets_it_go(touch: Played, tmp_path: Path) -> None:
    with PythonTuio() as client, touch.on_a_bus(tmp_path) as bus:
        config = write_config(tmp_path / "touchd.yaml", [client.destination])
        with running(config, tmp_path / "state", touchd_on(bus)) as daemon:
            wait_until(lambda: bool(client.log.adds))
            assert daemon.end(signal.SIGTERM) == 0
        client.sync()
        assert client.log.left_over() == set()
        state = bus.state()
    assert state["registers"]["6"] == 0
    assert (state["streaming"], state["in_flight"]) == (False, 0)
    assert state["owners"] == []
    blinking_green, green, off = 4, 1, 0
    assert state["leds"] == [blinking_green, green, off]
    assert state["tilts"] == []
    assert "stopping: SIGTERM" in daemon.lines


def test_the_touch_is_where_the_finger_is(touch: Played, tmp_path: Path) -> None:
    with PythonTuio() as client, touch.on_a_bus(tmp_path) as bus:
        config = write_config(tmp_path / "touchd.yaml", [client.destination])
        with running(config, tmp_path / "state", touchd_on(bus)) as daemon:
            wait_until(lambda: bool(client.log.adds))
            assert daemon.end(signal.SIGTERM) == 0
        positions = client.log.moves[client.log.adds[0]]
    off_mm = np.abs(np.subtract(positions[-1], TOUCHED_AT)) * AREA.size_mm
    assert off_mm.max() < 10.0


def test_it_runs_without_memory_that_is_written_and_executed_as_in_the_service(touch: Played, tmp_path: Path) -> None:
    with PythonTuio() as client, touch.on_a_bus(tmp_path) as bus:
        config = write_config(tmp_path / "touchd.yaml", [client.destination])
        forbidding = touchd_on(bus, sys.executable, NO_WRITE_EXECUTE)
        with running(config, tmp_path / "state", forbidding) as daemon:
            wait_until(lambda: bool(client.log.adds))
            assert daemon.end(signal.SIGTERM) == 0


def test_the_stored_surface_belongs_to_its_camera_which_is_taken_again(touch: Played, tmp_path: Path) -> None:
    with touch.on_a_bus(tmp_path, TWO_1473) as bus:
        named = write_config(tmp_path / "named.yaml", [], source=", serial: B0077")
        with running(named, tmp_path / "state", touchd_on(bus)) as daemon:
            daemon.wait_for("Kinect B0077: streaming")
            daemon.wait_for("state: tracking")
            assert daemon.end(signal.SIGTERM) == 0
        unnamed = write_config(tmp_path / "unnamed.yaml", [])
        with running(unnamed, tmp_path / "state", touchd_on(bus)) as daemon:
            daemon.wait_for("Kinect B0077: streaming")
            daemon.wait_for("state: tracking")
            assert daemon.end(signal.SIGTERM) == 0
        assert f"using the surface in {tmp_path}/state/surface.touchd" in daemon.lines
        assert "state: calibrating" not in " ".join(daemon.lines)
        assert sum(bus.state(0)["claims"].values()) == 0


@pytest.mark.parametrize("wanted", ["B0077", "usb:1-2.4"])
def test_of_two_kinects_the_one_that_the_config_names_is_used(wanted: str, touch: Played, tmp_path: Path) -> None:
    with touch.on_a_bus(tmp_path, TWO_1473) as bus:
        config = write_config(tmp_path / "touchd.yaml", [], source=f", serial: '{wanted}'")
        with running(config, tmp_path / "state", touchd_on(bus)) as daemon:
            daemon.wait_for("Kinect B0077: streaming")
            assert daemon.end(signal.SIGTERM) == 0
        assert (bus.state(0)["claims"]["1-1.4"], bus.state(1)["claims"]["1-2.4"]) == (0, 1)
        resets = [reset for which in (0, 1) for reset in bus.state(which)["resets"].values()]
    assert sum(resets) == 0
