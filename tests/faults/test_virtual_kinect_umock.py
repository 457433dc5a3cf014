import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from virtual_kinect.bus import KinectPlan, Model, Part
from virtual_kinect.faults import Faults
from virtual_kinect.packages import need_packages
from virtual_kinect.pictures import gradient_pictures
from virtual_kinect.umock import UNPRIVILEGED, VirtualBus

PATIENCE_S = 60
TWO_1473 = (KinectPlan(Model.XBOX_1473, "B0042", (1,)), KinectPlan(Model.XBOX_1473, "B0077", (2,)))


@pytest.fixture(autouse=True)
def _packages() -> None:
    need_packages()


def run(bus: VirtualBus, *command: str) -> str:
    environment = bus.environment | {"PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def look(bus: VirtualBus, *before: str) -> dict[str, Any]:
    """Return what pyusb with the real libusb sees: see usb_client.py."""
    seen: dict[str, Any] = json.loads(run(bus, *before, sys.executable, "-m", "virtual_kinect.usb_client"))
    return seen


def cameras(seen: dict[str, Any]) -> list[tuple[int, list[int]]]:
    return sorted((address, ports) for _, product, _, address, ports in seen["devices"] if product == 0x02AE)


def test_lsusb_lists_the_virtual_kinect_and_nothing_else(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1)) as bus:
        listed = [line.split()[5] for line in run(bus, "lsusb").splitlines()]
    assert sorted(listed) == ["045e:02ad", "045e:02ae", "045e:02b0", "045e:02c2", "1d6b:0002"]


def test_pyusb_with_the_real_libusb_opens_commands_and_reads_the_camera(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1), patient=True) as bus:
        seen = look(bus)
        state = bus.state()
    assert cameras(seen) == [(5, [1, 4])]
    assert seen["serial"] == "A00362A08602047A"
    assert seen["kernel_driver"] is True
    assert seen["constants"] == pytest.approx([7.5, 2.3, 120.0, 0.1042])
    assert seen["fps"] == 30
    assert seen["packets"] > 0
    assert "errno" not in seen
    assert state["registers"]["6"] == 2
    assert (state["claims"]["1-1.4"], state["in_flight"], state["tilts"]) == (1, 0, [])


def test_real_libusb_sees_two_1473_and_a_kinect_that_only_has_a_motor(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1), TWO_1473) as bus:
        assert cameras(look(bus)) == [(4, [1, 4]), (7, [2, 4])]
        listed = run(bus, "lsusb", "-v", "-d", "045e:02ad")
    assert sorted(line.split()[2] for line in listed.splitlines() if "iSerial" in line) == ["B0042", "B0077"]
    dark = KinectPlan(parts=(Part.MOTOR,))
    with VirtualBus(tmp_path, gradient_pictures(1), (dark,)) as bus:
        assert [device[1] for device in look(bus)["devices"]] == [0x02B0, 0x02C2, 0x0002]


@pytest.mark.parametrize(
    ("faults", "expected"),
    [
        (Faults(open_errno=errno.EACCES), errno.EACCES),
        (Faults(claim_errno=errno.EBUSY), errno.EBUSY),
        (Faults(iso_memory_bytes=0), errno.EIO),  # the kernel says ENOMEM, libusb does not pass it on
        (Faults(unplug_after_controls=12), errno.ENODEV),
    ],
)
def test_faults_reach_pyusb_through_the_real_libusb(tmp_path: Path, faults: Faults, expected: int) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1)) as bus:
        bus.set_faults(faults)
        assert look(bus, *UNPRIVILEGED)["errno"] == expected


def test_a_kinect_comes_and_goes_and_gets_another_address(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1)) as bus:
        bus.unplug()
        assert cameras(look(bus)) == []
        assert bus.state()["plugged"] is False
        bus.plug()
        assert cameras(look(bus)) == [(9, [1, 4])]


def test_a_kinect_pulled_out_by_a_fault_is_not_listed_any_more(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1)) as bus:
        bus.set_faults(Faults(unplug_after_controls=12))
        assert look(bus)["errno"] == errno.ENODEV
        assert bus.state()["plugged"] is False
        assert cameras(look(bus)) == []


def test_a_server_that_has_ended_says_so_with_its_own_words(tmp_path: Path) -> None:
    with VirtualBus(tmp_path, gradient_pictures(1)) as bus, pytest.raises(RuntimeError, match="IndexError"):
        bus.plug(5)


@pytest.mark.parametrize(("ci", "outcome"), [("true", pytest.fail.Exception), ("", pytest.skip.Exception)])
def test_missing_packages_fail_in_ci_and_skip_elsewhere(
    monkeypatch: pytest.MonkeyPatch, ci: str, outcome: type[BaseException]
) -> None:
    monkeypatch.setitem(os.environ, "CI", ci)
    monkeypatch.setitem(os.environ, "PATH", "")
    with pytest.raises(outcome, match="lacks lsusb, fakenect-record, setpriv: apt-get install umockdev"):
        need_packages()
