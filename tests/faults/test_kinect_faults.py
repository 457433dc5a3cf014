"""`touchd run` while things go wrong with a (virtual) Kinect under the real libusb."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest
from touchd.control.client import fetch_status
from touchd.control.paths import control_socket_path

from clients.harness import OscDump, PythonTuio
from daemon.running import RunningDaemon, running, wait_until
from virtual_kinect.bus import KinectPlan, Part
from virtual_kinect.faults import Faults, Reply
from virtual_kinect.packages import need_packages
from virtual_kinect.played import Played, held_touch, touchd_on, write_config
from virtual_kinect.umock import UNPRIVILEGED, VirtualBus

A = KinectPlan(serial="A0036")
STREAMING = "Kinect A0036: streaming"
WENT_AWAY = "Kinect A0036: it went away while streaming: check its cable and power"
ABSENT = "no Kinect is plugged in: connect its USB cable and its power supply"
LIFTED_WITHIN_S = 0.2
PATIENCE_S = 60


@pytest.fixture(autouse=True)
def _packages() -> None:
    need_packages()


@pytest.fixture(scope="module")
def touch() -> Played:
    return held_touch()


@contextmanager
def daemon_on(bus: VirtualBus, folder: Path, *clients: str, frames: int = 20) -> Iterator[RunningDaemon]:
    config = write_config(folder / "touchd.yaml", clients, frames=frames)
    with running(config, folder / "state", touchd_on(bus)) as daemon:
        yield daemon
        assert daemon.end(signal.SIGTERM) == 0, daemon.lines


def seconds_until(happened: Callable[[], bool], after: Callable[[], object]) -> float:
    begun_s = time.monotonic()
    after()
    wait_until(happened)
    return time.monotonic() - begun_s


def frames_with_touches(folder: Path) -> int:
    return (folder / "touchd.jsonl").read_text().count('"cursors":[{')


def more_frames_with_touches(folder: Path, than: int) -> bool:
    return frames_with_touches(folder) > than


def source_lines(daemon: RunningDaemon) -> list[str]:
    """Return what the source said; the service says on another thread that a camera is in use."""
    return [line for line in daemon.lines if "Kinect" in line and "source:" not in line and "in use" not in line]


def test_unplugged_while_streaming_every_client_sees_all_touches_removed_and_it_heals_when_plugged_in_again(
    touch: Played, tmp_path: Path
) -> None:
    with (
        PythonTuio() as python_tuio,
        OscDump() as oscdump,
        touch.on_a_bus(tmp_path, [A]) as bus,
        daemon_on(bus, tmp_path, python_tuio.destination, oscdump.destination) as daemon,
    ):
        logs = python_tuio.log, oscdump.log
        lifted_s, back_s, addresses = [], [], []
        for turn in (1, 2, 3):
            wait_until(lambda: all(log.left_over() for log in logs))
            addresses.append(bus.state()["addresses"]["1-1.4"])
            lifted_s.append(seconds_until(lambda: not any(log.left_over() for log in logs), after=bus.unplug))
            daemon.wait_for(WENT_AWAY, turn)
            daemon.wait_for(ABSENT, turn)
            back_s.append(seconds_until(partial(daemon.said, STREAMING, turn + 1), after=bus.plug))
        wait_until(lambda: all(log.left_over() for log in logs))
    print(f"touches removed after {lifted_s} s, streaming again after {back_s} s")  # noqa: T201
    assert min(lifted_s) <= LIFTED_WITHIN_S, lifted_s  # the best of three: others may hold the machine for a moment
    assert len(set(addresses)) == 3
    for log in logs:
        assert log.faults == []
        assert log.left_over() == set()
        assert len(set(log.adds)) == len(log.adds)
    assert not any("is in use" in line for line in daemon.lines[daemon.lines.index(WENT_AWAY) :])


@pytest.mark.parametrize("controls", [0, 3, 12, 24])
def test_unplugged_while_being_opened_it_is_opened_when_it_is_back(
    controls: int, touch: Played, tmp_path: Path
) -> None:
    with touch.on_a_bus(tmp_path, [A], plugged=()) as bus, daemon_on(bus, tmp_path) as daemon:
        daemon.wait_for(ABSENT)
        bus.set_faults(Faults(unplug_after_controls=controls))
        bus.plug()
        wait_until(lambda: not bus.state()["plugged"])
        bus.set_faults(Faults())
        bus.plug()
        daemon.wait_for("state: tracking")
        assert bus.state()["resets"]["1-1.4"] == 0


def test_unplugged_while_calibrating_it_calibrates_when_it_is_back(touch: Played, tmp_path: Path) -> None:
    with touch.on_a_bus(tmp_path, [A]) as bus, daemon_on(bus, tmp_path, frames=40) as daemon:
        daemon.wait_for("state: calibrating")
        bus.unplug()
        daemon.wait_for(WENT_AWAY)
        daemon.wait_for("state: no-frames")
        bus.plug()
        daemon.wait_for("state: calibrating", 2)
        daemon.wait_for("state: tracking")
        assert not daemon.said("Kinect A0036 is in use", 2)


@pytest.mark.parametrize(
    ("faults", "sentence"),
    [
        (
            Faults(claim_errno=errno.EBUSY),
            "Kinect A0036: another program holds it: stop that program, 'touchd doctor' says which it may be",
        ),
        (Faults(silent=True), "Kinect A0036: no frame came for 3 s: check its cable and power supply"),
        (
            Faults(reply=Reply.EMPTY),
            "Kinect A0036: it does not answer command 0x04 (fixed parameters) (100 tries): unplug the camera and plug"
            " it in again",
        ),
        (
            Faults(reply=Reply.NOT_READY),
            "Kinect A0036: it does not answer command 0x04 (fixed parameters) (100 tries): unplug the camera and plug"
            " it in again",
        ),
        (
            Faults(reply=Reply.WRONG_TAG),
            "the Kinect's reply to command 0x04 (fixed parameters) has tag 1 instead of 0: if this repeats, unplug the"
            " Kinect and plug it in again",
        ),
        (
            Faults(iso_memory_bytes=0),
            "Kinect A0036: the system takes no more transfers for its stream (Input/Output Error), most likely because"
            " USB memory has run out: echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb; if that does"
            " not help, plug other cameras into another USB controller",
        ),
        (
            Faults(iso_memory_bytes=600_000),
            "Kinect A0036: the system takes no more transfers for its stream (Input/Output Error), most likely because"
            " USB memory has run out: echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb; if that does"
            " not help, plug other cameras into another USB controller",
        ),
    ],
)
def test_what_goes_wrong_is_told_once_and_heals_without_a_restart(
    faults: Faults, sentence: str, touch: Played, tmp_path: Path
) -> None:
    with touch.on_a_bus(tmp_path, [A]) as bus:
        bus.set_faults(faults)
        with daemon_on(bus, tmp_path) as daemon:
            daemon.wait_for(sentence)
            wait_until(lambda: bus.state()["opens"]["1-1.4"] >= 6)  # it is tried again and again
            bus.set_faults(Faults())
            daemon.wait_for(STREAMING)
        state = bus.state()
    assert source_lines(daemon) == [
        "Kinect A0036: found at usb:1-1.4, opening it",
        sentence,
        STREAMING,
    ]
    assert (state["owners"], state["in_flight"], state["tilts"]) == ([], 0, [])


def test_without_permission_it_says_what_to_install_and_goes_on_once_it_may(touch: Played, tmp_path: Path) -> None:
    with touch.on_a_bus(tmp_path, [A]) as bus:
        for part in Part:
            bus.set_faults(Faults(open_errno=errno.EACCES), part)
        config = write_config(tmp_path / "touchd.yaml", [])
        with running(config, tmp_path / "state", touchd_on(bus, *UNPRIVILEGED)) as daemon:
            daemon.wait_for(
                "Kinect usb:1-1.4: no permission to use it: install touchd's udev rule with 'sudo make install', add"
                " yourself to the group touchd, and log in again; or unplug the camera and plug it in again if you just"
                " did"
            )
            for part in Part:
                bus.set_faults(Faults(), part)
            daemon.wait_for(STREAMING)
            assert daemon.end(signal.SIGTERM) == 0


def test_a_motor_without_a_camera_means_that_the_power_supply_is_missing(touch: Played, tmp_path: Path) -> None:
    dark = KinectPlan(parts=(Part.MOTOR,))
    with touch.on_a_bus(tmp_path, [dark, A], plugged=[0]) as bus, daemon_on(bus, tmp_path) as daemon:
        daemon.wait_for(
            "a Kinect's motor is plugged in at usb:1-1.1, but its camera is not there: connect the Kinect's power"
            " supply"
        )
        bus.unplug(0)
        bus.plug(1)
        daemon.wait_for(STREAMING)


def test_30_percent_packet_loss_is_told_and_touch_goes_on(touch: Played, tmp_path: Path) -> None:
    with PythonTuio() as client, touch.on_a_bus(tmp_path, [A]) as bus:
        bus.set_faults(Faults(drop=0.3))
        with daemon_on(bus, tmp_path, client.destination) as daemon:
            daemon.wait_for("% of its packets were lost in the last 10 s: plug it into another USB port")
            socket = control_socket_path({**os.environ, "STATE_DIRECTORY": str(tmp_path / "state")})
            loss = fetch_status(socket).source.packet_loss
            # Where the machine has more to do than this, more is lost: how much exactly is for test_kinect_source.py.
            assert loss is not None
            assert loss > 0.2
            assert f": {100.0 * loss:.1f} % of its packets were lost" in "\n".join(daemon.lines)
            wait_until(lambda: bool(client.log.adds))
        client.sync()
        assert client.log.left_over() == set()
    assert not daemon.said(STREAMING, 2)


@pytest.mark.parametrize("stopped_s", [0.1, 2.0])
def test_a_stall_of_the_process_itself_heals_by_itself(stopped_s: float, touch: Played, tmp_path: Path) -> None:
    with (
        PythonTuio() as client,
        touch.on_a_bus(tmp_path, [A]) as bus,
        daemon_on(bus, tmp_path, client.destination) as daemon,
    ):
        wait_until(lambda: bool(client.log.adds))
        for _ in range(3):
            daemon.process.send_signal(signal.SIGSTOP)
            time.sleep(stopped_s)
            daemon.process.send_signal(signal.SIGCONT)
            wait_until(partial(more_frames_with_touches, tmp_path, frames_with_touches(tmp_path) + 5))
    assert source_lines(daemon) == [
        "Kinect A0036: found at usb:1-1.4, opening it",
        STREAMING,
    ]


def test_nothing_leaks_where_the_camera_is_opened_again_and_again(touch: Played, tmp_path: Path) -> None:
    with touch.on_a_bus(tmp_path, [A]) as bus:
        done = subprocess.run(
            [sys.executable, "-m", "virtual_kinect.reopening_client", "40"],
            env=bus.environment | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=True,
        )
        state = bus.state()
    (descriptors, memory), (descriptors_in_the_end, memory_in_the_end) = json.loads(done.stdout)
    assert descriptors_in_the_end == descriptors
    assert memory_in_the_end - memory < 10_000_000  # 36 streams' buffers would be 35 MB
    assert (state["claims"]["1-1.4"], state["owners"], state["in_flight"]) == (40, [], 0)
