"""What the doctor says of the camera: plugged in, power, permission, driver, who holds it."""

import os
from pathlib import Path

import pytest
from touchd.doctor.examine import examine
from touchd.doctor.finding import Finding, exit_code_of
from touchd.status.data import Status

from daemon.fake_daemon import FakeControls, serving
from fake_computer import FakeComputer
from statuses import HEALTHY
from virtual_kinect.bus import KinectPlan, Model, Part

OWN_GROUP = os.getegid()
REPLUG = (
    "the rule has not been applied: unplug the Kinect and plug it in again, or sudo udevadm control --reload && "
    "sudo udevadm trigger --subsystem-match=usb"
)


class Tracking(FakeControls):
    def status(self) -> Status:
        return HEALTHY


def findings(fake: FakeComputer, section: str, config: Path | None = None) -> list[Finding]:
    return [one for one in examine(fake.computer(), config, None) if one.section == section]


def told(fake: FakeComputer, section: str, config: Path | None = None) -> list[tuple[str, str, str | None]]:
    return [(str(one.level), one.text, one.remedy) for one in findings(fake, section, config)]


def test_a_healthy_computer_has_no_problem(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.install_rule(OWN_GROUP)
    found = examine(fake.computer(), None, None)
    assert [one for one in found if one.level != "ok"] == []
    assert exit_code_of(found) == 0


def test_the_camera_is_told_with_the_one_that_touchd_would_use(tmp_path: Path) -> None:
    plans = [KinectPlan(), KinectPlan(Model.XBOX_1473, "B0042", (2,))]
    assert told(FakeComputer(tmp_path, plans), "camera") == [
        ("ok", "Kinect for Xbox 360, model 1414, serial A00362A08602047A, at usb:1-1.4; touchd would use it", None),
        ("ok", "Kinect for Xbox 360, model 1473, serial B0042, at usb:1-2.4", None),
    ]


def test_no_kinect_is_a_problem_with_exit_code_69(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    assert told(fake, "camera") == [
        ("problem", "no Kinect is plugged in", "connect its USB cable and its power supply")
    ]
    assert exit_code_of(examine(fake.computer(), None, None)) == 69


def test_no_kinect_is_no_problem_for_the_synthetic_table(tmp_path: Path) -> None:
    path = tmp_path / "touchd.yaml"
    path.write_text("source: {kind: synthetic}\n")
    found = examine(FakeComputer(tmp_path).computer(), path, None)
    assert [one.level for one in found if one.section == "camera"] == ["note"]
    assert exit_code_of(found) == 0


def test_a_serial_that_nothing_answers_to_is_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "touchd.yaml"
    path.write_text("source: {serial: X1}\n")
    text = "no Kinect answers to source.serial X1; plugged in: A00362A08602047A; see 'touchd list'"
    assert ("problem", text, "correct source in the config") in told(
        FakeComputer(tmp_path, [KinectPlan()]), "camera", path
    )


@pytest.mark.parametrize(
    ("plan", "place", "part"),
    [
        (KinectPlan(parts=(Part.MOTOR,)), "usb:1-1.1", "motor"),
        (KinectPlan(Model.XBOX_1473, parts=(Part.AUDIO,)), "usb:1-1.2", "audio"),
        (KinectPlan(Model.XBOX_1473, parts=()), "usb:1-1", "hub"),
    ],
)
def test_parts_without_a_camera_tell_of_a_missing_power_supply(
    tmp_path: Path, plan: KinectPlan, place: str, part: str
) -> None:
    ((level, text, remedy),) = told(FakeComputer(tmp_path, [plan]), "power")
    assert level == "problem"
    assert text == f"of the Kinect at {place} only the {part} is there, its camera is not"
    assert remedy is not None
    assert remedy.startswith("connect the Kinect's power supply, USB alone does not suffice")


def test_a_camera_at_usb_1_is_too_slow(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.set_attribute(fake.camera(), "speed", "12")
    assert told(fake, "power") == [
        (
            "problem",
            "the camera at usb:1-1.4 runs at 12 Mbit/s, its depth needs 480",
            "use a USB 2 or USB 3 port, another cable, and no USB 1 hub",
        )
    ]


def test_without_the_udev_rule_the_remedy_is_to_install_it(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.forbid(fake.camera())
    rule, camera = told(fake, "permission")
    assert rule[0] == "note"
    assert camera == (
        "problem",
        "you may not use /dev/bus/usb/001/005, the camera at usb:1-1.4",
        "sudo make install, in touchd's folder; then become a member: sudo usermod -aG touchd ada, then log out and in"
        " again",
    )


@pytest.mark.parametrize(
    ("group_id", "user", "remedy"),
    [
        (OWN_GROUP + 1, "ada", REPLUG),
        (OWN_GROUP, "ada", "sudo usermod -aG touchd ada, then log out and in again"),
        (OWN_GROUP, "bob", "you are a member of the group touchd from the next login on: log out and in again"),
    ],
)
def test_with_the_rule_the_remedy_is_the_step_that_is_missing(
    tmp_path: Path, group_id: int, user: str, remedy: str
) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()], user=user)
    fake.install_rule(group_id)
    fake.forbid(fake.camera())
    assert told(fake, "permission")[-1][::2] == ("problem", remedy)


def test_a_rule_whose_group_does_not_exist_is_told(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.install_rule(OWN_GROUP)
    fake.write("etc/group", "root:x:0:\n")
    assert told(fake, "permission")[0] == (
        "note",
        "/etc/udev/rules.d/60-touchd.rules gives Kinects to the group touchd, which does not exist",
        "sudo systemd-sysusers",
    )


def test_a_service_without_its_user_is_a_problem(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.write("usr/local/lib/systemd/system/touchd.service", "")
    text = "/usr/local/lib/systemd/system/touchd.service runs as user touchd, who does not exist"
    assert ("problem", text, "sudo systemd-sysusers") in told(fake, "permission")
    fake.write("etc/passwd", "touchd:x:990:990::/var/lib/touchd:/usr/sbin/nologin\n")
    assert [one[0] for one in told(fake, "permission")] == ["note"]


def test_a_camera_without_its_device_file_is_told(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    (fake.root / "dev/bus/usb/001/005").unlink()
    assert told(fake, "permission")[-1] == (
        "problem",
        "usb:1-1.4 has no file /dev/bus/usb/001/005 here, through which programs use it",
        "in a container: pass /dev/bus/usb and /sys in",
    )


def test_the_kernels_driver_is_no_problem_and_its_blacklist_is_named(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    assert told(fake, "driver") == [("ok", "the kernel's gspca_kinect is not loaded", None)]
    fake.write("sys/module/gspca_kinect/refcnt", "0\n")
    assert told(fake, "driver") == [("ok", "the kernel's gspca_kinect is loaded and has no camera", None)]
    fake.bind(fake.camera(), "kinect")
    assert told(fake, "driver") == [
        (
            "ok",
            "the kernel's gspca_kinect has usb:1-1.4: touchd takes the camera from it by itself",
            "only if other programs must not see it as a webcam: echo blacklist gspca_kinect | sudo tee"
            " /etc/modprobe.d/touchd.conf",
        )
    ]


def test_a_program_that_holds_the_camera_is_named_with_its_pid(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.bind(fake.camera(), "usbfs")
    fake.run_process(77, "/usr/bin/freenect-glview", "/dev/bus/usb/001/005")
    assert told(fake, "in use") == [
        ("problem", "usb:1-1.4 is held by freenect-glview (pid 77)", "stop that program"),
    ]


def test_a_program_at_a_camera_that_touchd_does_not_want_is_only_noted(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan(), KinectPlan(Model.XBOX_1473, "B0042", (2,))])
    fake.run_process(77, "/usr/bin/freenect-glview", fake.node(fake.camera(1)))
    assert [one[0] for one in told(fake, "in use")] == ["ok", "note"]


def test_where_other_users_programs_cannot_be_seen_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.run_process(1, "/sbin/init")

    def forbidden(_folder: object) -> None:
        raise PermissionError

    monkeypatch.setattr("os.scandir", forbidden)
    assert told(fake, "in use") == [
        ("ok", "no program has usb:1-1.4 open; only root sees all programs: sudo touchd doctor", None)
    ]


def test_a_running_touchd_that_holds_the_camera_is_no_problem(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan(serial="A00364A04287049A")])
    fake.install_rule(OWN_GROUP + 1)
    fake.forbid(fake.camera())
    fake.bind(fake.camera(), "usbfs")
    socket = fake.root / "run/touchd/control.sock"
    socket.parent.mkdir(parents=True)
    with serving(socket, Tracking()):
        found = examine(fake.computer(), None, None)
    assert ("in use", "ok", "usb:1-1.4 is in use by the running touchd") in [
        (one.section, str(one.level), one.text) for one in found
    ]
    assert [one.text for one in found if one.section == "daemon"] == [
        "touchd runs (pid 812); ok: tracking at 30.0 frames/s, 2 touches"
    ]
    assert exit_code_of(found) == 0


def test_another_touchd_that_holds_the_camera_is_told_by_its_pid(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.bind(fake.camera(), "usbfs")
    fake.run_process(78, "/usr/bin/python3 -m touchd run", "/dev/bus/usb/001/005")
    assert told(fake, "in use") == [("ok", "usb:1-1.4 is in use by touchd (pid 78)", None)]
