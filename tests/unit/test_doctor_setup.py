"""What the doctor says of config, surface, outputs, the daemon, Python and the computer."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.doctor.computer import Computer
from touchd.doctor.examine import examine
from touchd.doctor.finding import exit_code_of
from touchd.status.data import Status

from daemon.fake_daemon import FakeControls, serving
from fake_computer import NOW_S, FakeComputer
from statuses import HEALTHY
from virtual_kinect.bus import KinectPlan

NOBODY = "nobody listens at 127.0.0.1:3333"


class Tracking(FakeControls):
    def status(self) -> Status:
        return replace(HEALTHY, pid=812)


def told(computer: Computer, section: str, config: Path | None = None) -> list[tuple[str, str, str | None]]:
    found = examine(computer, config, None)
    return [(str(one.level), one.text, one.remedy) for one in found if one.section == section]


def config(folder: Path, text: str) -> Path:
    path = folder / "touchd.yaml"
    path.write_text(text)
    return path


def loopback(address: bytes) -> str:
    """Return an address as /proc/net/udp writes it."""
    words = [int.from_bytes(address[at : at + 4], sys.byteorder) for at in range(0, len(address), 4)]
    return "".join(f"{word:08X}" for word in words)


def test_the_config_in_force_is_named(tmp_path: Path) -> None:
    computer = FakeComputer(tmp_path).computer()
    path = config(tmp_path, "source: {serial: 'usb:1-1.4'}\n")
    assert told(computer, "config", path) == [("ok", f"{path}; source: kinect usb:1-1.4", None)]


def test_a_bad_config_is_the_gravest_problem(tmp_path: Path) -> None:
    computer = FakeComputer(tmp_path).computer()
    path = config(tmp_path, "source: {kind: kinekt}\n")
    ((level, text, remedy),) = told(computer, "config", path)
    assert level == "problem"
    assert str(path) in text
    assert "\n" not in text
    assert remedy == "touchd check-config says all that is wrong"
    assert exit_code_of(examine(computer, path, None)) == 78


def test_a_config_that_is_not_there_is_a_problem(tmp_path: Path) -> None:
    found = examine(FakeComputer(tmp_path, [KinectPlan()]).computer(), tmp_path / "none.yaml", None)
    assert found[0].text == f"There is no config file {tmp_path / 'none.yaml'}; check the path given with --config."
    assert exit_code_of(found) == 78


def test_a_realsense_in_the_config_is_told_to_be_too_early(tmp_path: Path) -> None:
    path = config(tmp_path, "source: {kind: realsense}\n")
    assert told(FakeComputer(tmp_path).computer(), "config", path) == [
        (
            "problem",
            f"{path}: source.kind is realsense, which this version of touchd cannot read from",
            "use kinect, recording or synthetic",
        )
    ]


def store_surface(fake: FakeComputer, camera: str | None) -> Path:
    path = fake.state_folder / "surface.touchd"
    path.parent.mkdir(parents=True)
    header = {"kind": "touchd surface", "version": 1, "camera": {"serial": camera}, "made_from": f"Kinect {camera}"}
    path.write_text(json.dumps(header) + "\n")
    os.utime(path, (NOW_S - 7300, NOW_S - 7300))
    return path


def test_a_surface_of_the_camera_that_is_there_is_told_with_its_age(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    path = store_surface(fake, "A00362A08602047A")
    text = f"{path}: learned 2 h 1 min ago with A00362A08602047A"
    assert told(fake.computer(), "surface") == [("ok", text, None)]


@pytest.mark.parametrize(
    ("camera", "end"),
    [
        ("B0042", "with B0042; plugged in is A00362A08602047A, so touchd learns another one at its start"),
        (None, "a camera without a name; its file does not tell the camera, so touchd learns another one at its start"),
    ],
)
def test_a_surface_of_another_camera_is_noted(tmp_path: Path, camera: str | None, end: str) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    store_surface(fake, camera)
    ((level, text, remedy),) = told(fake.computer(), "surface")
    assert level == "note"
    assert text.endswith(end)
    assert remedy is not None
    assert remedy.startswith("touchd calibrate")


def test_without_a_surface_it_is_said_when_one_is_learned(tmp_path: Path) -> None:
    assert told(FakeComputer(tmp_path).computer(), "surface") == [
        ("ok", "there is no stored surface that you may see: touchd run learns one at its start", None)
    ]


@pytest.mark.parametrize(
    ("destination", "table", "address", "heard"),
    [
        ("127.0.0.1:3333", "udp", bytes((127, 0, 0, 1)), True),
        ("localhost:3333", "udp", bytes(4), True),
        ("127.0.0.1:3333", "udp6", bytes(16), True),
        ("[::1]:3333", "udp6", bytes(15) + b"\1", True),
        ("[::1]:3333", "udp", bytes(4), False),
        ("127.0.0.1:3333", "udp", bytes((192, 168, 0, 127)), False),
        ("127.0.0.1:3334", "udp", bytes(4), False),
    ],
)
def test_whether_somebody_listens_at_a_destination_is_seen(
    tmp_path: Path, destination: str, table: str, address: bytes, heard: bool
) -> None:
    fake = FakeComputer(tmp_path)
    fake.write("proc/net/udp", "head\n")
    fake.listen(loopback(address), 3333, table)
    path = config(tmp_path, f"outputs: [{{tuio: {{to: ['{destination}']}}}}]\n")
    ((level, text, _),) = told(fake.computer(), "ports", path)
    expected = ("ok", f"a program listens at {destination}")
    assert (level, text) == (expected if heard else ("note", f"nobody listens at {destination}"))


def test_destinations_elsewhere_are_left_alone(tmp_path: Path) -> None:
    path = config(tmp_path, "outputs: [{tuio: {to: ['192.168.0.7:3333', 'wall.example:3333']}}]\n")
    assert [
        (level, text.split(" ")[0]) for level, text, _ in told(FakeComputer(tmp_path).computer(), "ports", path)
    ] == [
        ("ok", "192.168.0.7:3333"),
        ("ok", "wall.example:3333"),
    ]


def test_a_config_without_tuio_is_noted(tmp_path: Path) -> None:
    assert told(FakeComputer(tmp_path).computer(), "ports", config(tmp_path, "outputs: []\n")) == [
        ("note", "the config has no TUIO output", "add outputs: [{tuio: {}}]")
    ]


def test_another_touchd_that_sends_to_a_destination_is_told(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.claim("127.0.0.1:3333", 991)
    fake.run_process(78, "/usr/bin/touchd run", "socket:[991]")
    assert told(fake.computer(), "ports")[1] == (
        "note",
        "touchd (pid 78) sends to 127.0.0.1:3333 already, and most clients cannot tell two senders apart",
        "give each touchd a port of its own",
    )


@pytest.mark.parametrize(("pid", "levels"), [(812, ["ok"]), (78, ["ok", "problem"])])
def test_the_running_daemons_own_claim_is_no_problem_and_anothers_is(
    tmp_path: Path, pid: int, levels: list[str]
) -> None:
    fake = FakeComputer(tmp_path)
    fake.claim("127.0.0.1:3333", 991)
    fake.run_process(pid, "/usr/bin/touchd run", "socket:[991]")
    socket = fake.root / "run/touchd/control.sock"
    socket.parent.mkdir(parents=True)
    with serving(socket, Tracking()):
        assert [level for level, _, _ in told(fake.computer(), "ports")] == levels


def test_several_daemons_are_told_to_be_chosen_from(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    for name in ("touchd-left", "touchd-right"):
        fake.write(f"run/{name}/control.sock", "")
    ((level, text, _),) = told(fake.computer(), "daemon")
    assert level == "note"
    assert text.startswith("several touchd run here; choose one with --socket: ")


def test_a_package_that_does_not_load_is_a_problem(tmp_path: Path) -> None:
    def load(module: str) -> None:
        if module == "cv2":
            raise ImportError("libGL.so.1: cannot open shared object file")

    computer = replace(FakeComputer(tmp_path, [KinectPlan()]).computer(), load=load)
    level, text, remedy = told(computer, "python")[0]
    assert level == "problem"
    assert text.endswith(": cv2 does not load (libGL.so.1: cannot open shared object file)")
    assert remedy == f"{sys.executable} -m pip install --force-reinstall touchd"
    assert exit_code_of(examine(computer, None, None)) == 69


@pytest.mark.parametrize(("machine", "told_of"), [("aarch64", True), ("x86_64", False)])
def test_realsenses_missing_package_for_arm_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, machine: str, told_of: bool
) -> None:
    monkeypatch.setattr("platform.machine", lambda: machine)
    computer = replace(FakeComputer(tmp_path).computer(), is_installed=lambda _: False)
    text = told(computer, "python")[1][1]
    assert text.startswith("not installed, and not needed by this version: aiohttp, mcap, evdev, pyrealsense2")
    assert ("on ARM" in text) == told_of


def test_without_libusb_the_package_to_install_is_named(tmp_path: Path) -> None:
    computer = FakeComputer(tmp_path).without_libusb()
    text = "libusb is missing, which talks to the camera"
    assert ("problem", text, "apt-get install libusb-1.0-0") in told(computer, "python")


@pytest.mark.parametrize(("driver", "level"), [("acpi-cpufreq", "note"), ("intel_pstate", "ok")])
def test_a_governor_that_keeps_the_processor_slow_is_noted(tmp_path: Path, driver: str, level: str) -> None:
    fake = FakeComputer(tmp_path)
    fake.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n")
    fake.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_driver", f"{driver}\n")
    found_level, text, _ = told(fake.computer(), "computer")[1]
    assert found_level == level
    assert text.startswith("2 processor cores, governor powersave")


def test_too_little_memory_and_a_clock_that_is_not_set_are_noted(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.write("proc/meminfo", "MemTotal: 1000000 kB\nMemAvailable: 90000 kB\n")
    computer = replace(fake.computer(), now_s=lambda: 0.0)
    assert told(computer, "computer") == [
        ("note", "0.1 of 1.0 GB of memory free, touchd takes 0.12", "end other programs"),
        ("ok", "2 processor cores, governor schedutil", None),
        (
            "note",
            "the clock says 1970-01-01: it is not set, so ages of files, and the log's times, are wrong",
            "sudo timedatectl set-ntp true",
        ),
    ]


def test_a_computer_without_any_of_these_files_is_examined_all_the_same(tmp_path: Path) -> None:
    computer = replace(FakeComputer(tmp_path).computer(), root=tmp_path / "nothing")
    found = examine(computer, None, None)
    assert {one.section for one in found} >= {"config", "daemon", "camera", "USB memory", "ports", "python"}
    assert [one.text for one in found if one.level == "problem"] == ["no Kinect is plugged in"]
