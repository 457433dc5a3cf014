"""``touchd list`` and ``touchd doctor`` on the real libusb and the system's own ways, with umockdev's USB."""

import errno
import json
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from virtual_kinect.bus import KinectPlan, Model, Part
from virtual_kinect.faults import Faults
from virtual_kinect.packages import need_packages
from virtual_kinect.stream import PICTURE_BYTES
from virtual_kinect.umock import UNPRIVILEGED, VirtualBus

PATIENCE_S = 60
PICTURES = (bytes(PICTURE_BYTES),)
TWO_1473 = (KinectPlan(Model.XBOX_1473, "B0042", (1,)), KinectPlan(Model.XBOX_1473, "B0077", (2,)))
LIST, DOCTOR = "list", "doctor"


@pytest.fixture(autouse=True)
def _packages() -> None:
    need_packages()


def environment(bus: VirtualBus, folder: Path) -> dict[str, str]:
    homes = {"HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)}
    return bus.environment | homes | {"XDG_STATE_HOME": str(folder)}


def look(bus: VirtualBus, folder: Path, command: str, before: Iterable[str] = ()) -> dict[str, Any]:
    done = subprocess.run(
        [*before, sys.executable, "-m", "touchd", command, "--json"],
        env=environment(bus, folder),
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.stderr == ""
    seen: dict[str, Any] = json.loads(done.stdout)
    assert done.returncode in {0, seen.get("exit_code", 69)}
    return seen


def found(report: dict[str, Any], section: str) -> list[tuple[str, str]]:
    return [(one["level"], one["text"]) for one in report["findings"] if one["section"] == section]


def test_two_1473_are_listed_by_their_audio_devices_serials(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, PICTURES, TWO_1473) as bus:
        cameras = look(bus, tmp_path, LIST)["cameras"]
    assert [(one["place"], one["serial"], one["chosen"]) for one in cameras] == [
        ("usb:1-1.4", "B0042", True),
        ("usb:1-2.4", "B0077", False),
    ]


def test_a_healthy_kinect_is_no_problem_and_nothing_is_claimed_or_reset(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, PICTURES) as bus:
        report = look(bus, tmp_path, DOCTOR)
        state = bus.state()
    assert found(report, "camera") == [
        ("ok", "Kinect for Xbox 360, model 1414, serial A00362A08602047A, at usb:1-1.4; touchd would use it")
    ]
    assert [one for one in report["findings"] if one["level"] == "problem"] == []
    assert not any((*state["claims"].values(), *state["resets"].values()))
    assert state["registers"] == {}


def test_a_camera_that_may_not_be_opened_is_a_problem_of_permission(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, PICTURES) as bus:
        bus.set_faults(Faults(open_errno=errno.EACCES))
        report = look(bus, tmp_path, DOCTOR, UNPRIVILEGED)
        listed = look(bus, tmp_path, LIST, UNPRIVILEGED)["cameras"]
    assert ("problem", "you may not use /dev/bus/usb/001/005, the camera at usb:1-1.4") in found(report, "permission")
    assert report["exit_code"] == 69
    assert (listed[0]["use"], listed[0]["serial"]) == ("denied", "A00362A08602047A")


def test_a_motor_alone_is_a_problem_of_power(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, PICTURES, (KinectPlan(parts=(Part.MOTOR,)),)) as bus:
        report = look(bus, tmp_path, DOCTOR)
    assert found(report, "power") == [
        ("problem", "of the Kinect at usb:1-1.1 only the motor is there, its camera is not")
    ]


def test_a_kinect_that_was_pulled_out_is_not_found_any_more(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, PICTURES) as bus:
        bus.unplug()
        assert look(bus, tmp_path, LIST)["cameras"] == []
        report = look(bus, tmp_path, DOCTOR)
    assert (report["exit_code"], found(report, "camera")) == (69, [("problem", "no Kinect is plugged in")])
