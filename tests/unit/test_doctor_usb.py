"""What the doctor says of the way from the camera to the program: USB memory, controller, hubs, autosuspend."""

from pathlib import Path

import pytest
from touchd.doctor.examine import examine

from fake_computer import FakeComputer
from virtual_kinect.bus import KinectPlan

SERIALS = ("A1", "A2", "A3")
THREE = tuple(KinectPlan(serial=serial, ports=(port,)) for port, serial in enumerate(SERIALS, 1))
LIMIT = "sys/module/usbcore/parameters/usbfs_memory_mb"


def told(fake: FakeComputer, section: str) -> list[tuple[str, str, str | None]]:
    found = examine(fake.computer(), None, None)
    return [(str(one.level), one.text, one.remedy) for one in found if one.section == section]


@pytest.mark.parametrize(
    ("limit", "level", "text"),
    [
        ("16", "ok", "16 MB for all programs together; 3 Kinects need 3.2 MB"),
        ("0", "ok", "no limit for all programs; 3 Kinects need 3.2 MB"),
        ("4", "note", "4 MB for all programs together; 3 Kinects need 3.2 MB"),
        ("2", "problem", "2 MB for all programs together; 3 Kinects need 3.2 MB"),
    ],
)
def test_usb_memory_must_hold_the_streams_of_all_kinects(tmp_path: Path, limit: str, level: str, text: str) -> None:
    fake = FakeComputer(tmp_path, THREE)
    fake.write(LIMIT, limit)
    ((found_level, found_text, remedy),) = told(fake, "USB memory")
    assert (found_level, found_text) == (level, text)
    assert (remedy is None) == (level == "ok")
    assert remedy is None or f"echo 64 | sudo tee /{LIMIT}; for good: usbcore.usbfs_memory_mb=64" in remedy


def test_a_memory_limit_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    (fake.root / LIMIT).unlink()
    assert told(fake, "USB memory") == [("note", f"/{LIMIT} cannot be read; 1 Kinect needs 1.1 MB", None)]


@pytest.mark.parametrize(
    ("controller", "text"),
    [
        ((0x8086, 0x1E31, "xhci_hcd"), "usb:1-1.4: Intel 8086:1e31, xhci_hcd (USB 3)"),
        ((0x1912, 0x0014, "xhci_hcd"), "usb:1-1.4: Renesas 1912:0014, xhci_hcd (USB 3)"),
        ((0x4321, 0x0001, "new_hcd"), "usb:1-1.4: maker 4321:0001, new_hcd"),
        ((None, None, "dwc2"), "usb:1-1.4: dwc2 (DesignWare USB 2)"),
    ],
)
def test_a_controller_of_which_nothing_is_known_is_named(
    tmp_path: Path, controller: tuple[int | None, int | None, str], text: str
) -> None:
    assert told(FakeComputer(tmp_path, [KinectPlan()], controller), "controller") == [("ok", text, None)]


@pytest.mark.parametrize(
    ("controller", "begin", "source", "remedy"),
    [
        ((None, None, "dwc_otg"), "dwc_otg (Raspberry Pi up to 3", "raspberrypi/linux/issues/238", "Raspberry Pi 4"),
        ((0x1106, 0x3483, "xhci_hcd"), "VIA 1106:3483", "libfreenect/issues/639", "second USB device"),
        ((0x1B21, 0x1142, "xhci_hcd"), "ASMedia 1b21:1142", "libfreenect2/issues/146", "another port"),
        ((None, None, "vhci_hcd"), "vhci_hcd (USB over the network)", "libfreenect/issues/592", "plugged into"),
    ],
)
def test_what_was_reported_of_a_controller_is_told_with_where_and_what_to_do(
    tmp_path: Path, controller: tuple[int | None, int | None, str], begin: str, source: str, remedy: str
) -> None:
    ((level, text, to_do),) = told(FakeComputer(tmp_path, [KinectPlan()], controller), "controller")
    assert level == "note"
    assert text.startswith(f"usb:1-1.4: {begin}")
    assert f"https://github.com/{'OpenKinect/' if source.startswith('lib') else ''}{source}" in text
    assert to_do is not None
    assert remedy in to_do


def test_more_than_two_kinects_on_a_bus_are_too_many(tmp_path: Path) -> None:
    assert told(FakeComputer(tmp_path / "two", THREE[:2]), "controller")[2:] == []
    assert told(FakeComputer(tmp_path / "three", THREE), "controller")[3:] == [
        (
            "note",
            "usb:1-1.4, usb:1-2.4, usb:1-3.4 share one USB bus, which has room for the depth of 2",
            "plug the others into ports of another controller",
        )
    ]


def test_a_chain_of_hubs_is_told(tmp_path: Path) -> None:
    assert told(FakeComputer(tmp_path / "one", [KinectPlan(ports=(1, 2))]), "controller")[1:] == []
    assert told(FakeComputer(tmp_path / "two", [KinectPlan(ports=(1, 2, 3))]), "controller")[1:] == [
        (
            "note",
            "usb:1-1.2.3.4: 2 hubs lie between the computer and the Kinect, some may be the computer's own",
            "if frames are dropped, plug it in at the computer itself",
        )
    ]


def test_parts_that_may_be_suspended_are_told_with_the_files_to_change(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    assert told(fake, "autosuspend") == [("ok", "the system leaves the Kinect's parts awake", None)]
    fake.set_attribute(fake.camera(), "power/control", "auto")
    assert told(fake, "autosuspend") == [
        (
            "note",
            "the system may suspend usb:1-1.4, and Kinects were reported to disconnect again and again then",
            "echo on | sudo tee /sys/bus/usb/devices/1-1.4/power/control",
        )
    ]


@pytest.mark.parametrize(
    ("config", "told_of"),
    [
        ("# TLP\n", True),
        ("USB_AUTOSUSPEND=1\n", True),
        ('USB_AUTOSUSPEND="0"\n', False),
        ("TLP_ENABLE=0\n", False),
        ('USB_DENYLIST="045e:02ae 045e:02b0"\n', False),
    ],
)
def test_tlp_is_told_of_unless_it_leaves_kinects_out(tmp_path: Path, config: str, told_of: bool) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.write("etc/tlp.conf", config)
    texts = [text for _, text, _ in told(fake, "autosuspend")]
    assert ("TLP is installed, and does not leave out Kinects" in texts) == told_of
    fake.set_attribute(fake.camera(), "power/control", "auto")
    remedy = told(fake, "autosuspend")[0][2]
    assert remedy is not None
    assert ("USB_DENYLIST=" in remedy) == told_of
