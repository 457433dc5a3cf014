import json
from pathlib import Path

import pytest
from touchd.doctor.computer import Computer
from touchd.doctor.listing import list_cameras, listing_json, listing_lines

from fake_computer import FakeComputer
from virtual_kinect.bus import KinectPlan, Model, Part
from virtual_kinect.model import Device
from virtual_kinect.shapes import Shape

TWO_1473 = (KinectPlan(Model.XBOX_1473, "B0042", (1,)), KinectPlan(Model.XBOX_1473, "B0077", (2,)))


def lines(computer: Computer, config: Path | None = None) -> list[str]:
    return listing_lines(list_cameras(computer, config, None))


def config(folder: Path, text: str) -> Path:
    path = folder / "touchd.yaml"
    path.write_text(text)
    return path


def other_camera(vendor_id: int, product_id: int, serial: str | None = None) -> Device:
    device = Device(Shape(product_id, "a camera", serial, vendor_id=vendor_id), (3,))
    device.address = 77
    return device


def test_a_kinect_is_one_line_with_its_place_serial_and_model_and_a_star(tmp_path: Path) -> None:
    assert lines(FakeComputer(tmp_path, [KinectPlan()]).computer()) == [
        "*  usb:1-1.4  A00362A08602047A  Kinect for Xbox 360, model 1414  ready",
        "* the one that touchd would use",
    ]


def test_a_1473_and_a_kinect_for_windows_go_by_their_audio_devices_serial(tmp_path: Path) -> None:
    plans = [KinectPlan(Model.XBOX_1473, "B0042"), KinectPlan(Model.K4W, "C0815", (2,))]
    assert lines(FakeComputer(tmp_path, plans).computer()) == [
        "*  usb:1-1.4  B0042  Kinect for Xbox 360, model 1473  ready",
        "   usb:1-2.4  C0815  Kinect for Windows               ready",
        "* the one that touchd would use",
    ]


def test_the_config_chooses_by_serial_or_by_place(tmp_path: Path) -> None:
    computer = FakeComputer(tmp_path, TWO_1473).computer()
    for wanted in ("B0077", "usb:1-2.4"):
        listing = list_cameras(computer, config(tmp_path, f"source: {{serial: '{wanted}'}}"), None)
        assert [camera.chosen for camera in listing.cameras] == [False, True]


def test_the_stored_surface_chooses_where_the_config_does_not(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, TWO_1473)
    fake.state_folder.mkdir(parents=True)
    header = {"kind": "touchd surface", "version": 1, "camera": {"serial": "B0077"}, "made_from": "Kinect B0077"}
    (fake.state_folder / "surface.touchd").write_text(json.dumps(header) + "\n")
    assert [camera.chosen for camera in list_cameras(fake.computer(), None, None).cameras] == [False, True]


def test_a_serial_that_nothing_answers_to_is_told_with_what_is_there(tmp_path: Path) -> None:
    listing = list_cameras(FakeComputer(tmp_path, TWO_1473).computer(), config(tmp_path, "source: {serial: X1}"), None)
    assert [camera.chosen for camera in listing.cameras] == [False, False]
    assert listing.notes == ("no Kinect answers to source.serial X1; plugged in: B0042, B0077; see 'touchd list'",)
    assert listing.exit_code == 0


def test_another_kind_of_source_would_use_none_of_them(tmp_path: Path) -> None:
    path = config(tmp_path, "source: {kind: synthetic}")
    assert lines(FakeComputer(tmp_path, [KinectPlan()]).computer(), path)[1:] == [
        "the config's source is synthetic, so touchd would use no camera"
    ]


def test_a_broken_config_hides_no_camera(tmp_path: Path) -> None:
    listed = lines(FakeComputer(tmp_path, [KinectPlan()]).computer(), config(tmp_path, "source: {serial: [1]}"))
    assert "A00362A08602047A" in listed[0]
    assert listed[-1] == "the config cannot be read, so source.serial is not known; see touchd check-config"


def test_a_camera_that_may_not_be_used_is_listed_with_its_serial_all_the_same(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.forbid(fake.camera())
    assert lines(fake.computer())[0] == (
        "*  usb:1-1.4  A00362A08602047A  Kinect for Xbox 360, model 1414"
        "  no permission to use /dev/bus/usb/001/005: see touchd doctor"
    )
    assert list_cameras(fake.computer(), None, None).exit_code == 0


@pytest.mark.parametrize(
    ("driver", "detail"),
    [
        ("kinect", "ready: touchd takes it from the kernel's driver gspca_kinect"),
        ("usbfs", "held by a program of another user"),
    ],
)
def test_who_has_the_camera_is_told(tmp_path: Path, driver: str, detail: str) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.bind(fake.camera(), driver)
    assert list_cameras(fake.computer(), None, None).cameras[0].detail == detail


def test_a_program_that_has_the_camera_open_is_named(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path, [KinectPlan()])
    fake.run_process(77, "/usr/bin/freenect-glview", "/dev/bus/usb/001/005")
    assert list_cameras(fake.computer(), None, None).cameras[0].detail == "held by freenect-glview (pid 77)"
    fake.run_process(78, "/opt/touchd/venv/bin/python /opt/touchd/venv/bin/touchd run", "/dev/bus/usb/001/005")
    assert list_cameras(fake.computer(), None, None).cameras[0].use == "touchd"


def test_a_motor_without_its_camera_needs_the_power_supply(tmp_path: Path) -> None:
    listing = list_cameras(FakeComputer(tmp_path, [KinectPlan(parts=(Part.MOTOR,))]).computer(), None, None)
    assert listing_lines(listing) == [
        "   usb:1-1.1  -  Kinect without its camera  only its motor is there: connect the Kinect's power supply"
    ]
    assert listing.exit_code == 69


def test_a_hub_without_a_camera_tells_of_a_1473_without_power(tmp_path: Path) -> None:
    plan = KinectPlan(Model.XBOX_1473, parts=())
    listing = list_cameras(FakeComputer(tmp_path, [plan, KinectPlan(ports=(2,))]).computer(), None, None)
    assert [(camera.place, camera.use) for camera in listing.cameras] == [
        ("usb:1-2.4", "free"),
        ("usb:1-1", "no-camera"),
    ]
    assert listing.exit_code == 0


@pytest.mark.parametrize(
    ("vendor_id", "product_id", "name"),
    [
        (0x8086, 0x0B07, "RealSense D435"),
        (0x8086, 0x0B64, "RealSense L515"),
        (0x045E, 0x097C, "Azure Kinect"),
        (0x2BC5, 0x0401, "Orbbec camera"),
    ],
)
def test_other_depth_cameras_are_named_as_not_supported_yet(
    tmp_path: Path, vendor_id: int, product_id: int, name: str
) -> None:
    fake = FakeComputer(tmp_path)
    fake.add(other_camera(vendor_id, product_id, "923322071108"))
    listing = list_cameras(fake.computer(), None, None)
    assert listing_lines(listing) == [f"   usb:1-3  923322071108  {name}  not supported yet by this version of touchd"]
    assert listing.exit_code == 69


def test_a_webcam_of_the_same_makers_is_no_depth_camera(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.add(other_camera(0x8086, 0x1234))
    assert list_cameras(fake.computer(), None, None).cameras == ()


def test_nothing_plugged_in_is_a_sentence_and_exit_code_69(tmp_path: Path) -> None:
    listing = list_cameras(FakeComputer(tmp_path).computer(), None, None)
    assert listing_lines(listing) == [
        "no depth camera is plugged in: connect a Kinect's USB cable and its power supply"
    ]
    assert listing.exit_code == 69


def test_without_libusb_the_cameras_are_listed_and_what_is_missing_is_said(tmp_path: Path) -> None:
    listed = lines(FakeComputer(tmp_path, [KinectPlan()]).without_libusb())
    assert listed == [
        "   usb:1-1.4  A00362A08602047A  Kinect for Xbox 360, model 1414  ready",
        "libusb is missing, which talks to the camera: apt-get install libusb-1.0-0",
    ]


def test_the_list_is_there_as_json(tmp_path: Path) -> None:
    content = json.loads(listing_json(list_cameras(FakeComputer(tmp_path, [KinectPlan()]).computer(), None, None)))
    assert content == {
        "cameras": [
            {
                "place": "usb:1-1.4",
                "serial": "A00362A08602047A",
                "model": "Kinect for Xbox 360, model 1414",
                "use": "free",
                "detail": "ready",
                "chosen": True,
            }
        ],
        "notes": [],
    }
