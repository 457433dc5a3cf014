import errno

import pytest
import usb.core
from touchd.errors import DeviceDenied, DeviceNotFound, SourceError
from touchd.sources.kinect.commands import Model as SoldModel
from touchd.sources.kinect.devices import choose, look_at_usb
from usb.core import USBError

from virtual_kinect.bus import KinectPlan, Model, Part
from virtual_kinect.driven import Driven
from virtual_kinect.faults import Faults

A_1414 = KinectPlan(serial="A0036")
TWO_1473 = (KinectPlan(Model.XBOX_1473, "B0042", (1,)), KinectPlan(Model.XBOX_1473, "B0077", (2,)))


def test_a_1414_has_a_motor_and_a_serial_number_of_its_own() -> None:
    (kinect,) = Driven(A_1414).look().kinects
    assert (kinect.model, kinect.path, kinect.serial) == (SoldModel.XBOX_1414, "usb:1-1.4", "A0036")
    assert kinect.motor is not None
    assert (kinect.identity, kinect.name) == ("A0036", "Kinect A0036")


@pytest.mark.parametrize(("model", "sold"), [(Model.XBOX_1473, SoldModel.XBOX_1473), (Model.K4W, SoldModel.WINDOWS)])
def test_the_others_go_by_the_serial_number_of_their_audio_device(model: Model, sold: SoldModel) -> None:
    (kinect,) = Driven(KinectPlan(model, "B0042")).look().kinects
    assert (kinect.model, kinect.serial, kinect.audio_serial) == (sold, None, "B0042")
    assert (kinect.identity, kinect.motor) == ("B0042", None)


def test_a_kinect_without_any_serial_number_goes_by_its_place() -> None:
    (kinect,) = Driven(KinectPlan(Model.XBOX_1473, parts=(Part.CAMERA,))).look().kinects
    assert kinect.identity == "usb:1-1.4"


def test_looking_claims_and_resets_nothing_and_leaves_nothing_open() -> None:
    there = Driven(A_1414, *(KinectPlan(plan.model, plan.serial, (index + 2,)) for index, plan in enumerate(TWO_1473)))
    there.look()
    assert there.balance() == [0, 0, 0]
    assert sum(device.claims + device.resets for kinect in there.kinects for device in kinect.devices) == 0
    assert there.camera.kernel_driver == "gspca_kinect"


def test_kinects_are_in_the_order_of_their_ports() -> None:
    there = Driven(*(KinectPlan(serial=f"A{port}", ports=(port,)) for port in (10, 9, 1)))
    assert [kinect.path for kinect in there.look().kinects] == ["usb:1-1.4", "usb:1-9.4", "usb:1-10.4"]


@pytest.mark.parametrize("wanted", ["B0077", "usb:1-2.4"])
def test_a_kinect_is_chosen_by_its_audio_devices_serial_number_or_its_place(wanted: str) -> None:
    assert choose(Driven(*TWO_1473).look(), wanted).identity == "B0077"


def test_a_kinect_is_chosen_by_its_cameras_serial_number() -> None:
    there = Driven(TWO_1473[0], KinectPlan(serial="A0036", ports=(2,)))
    assert choose(there.look(), "A0036").path == "usb:1-2.4"


@pytest.mark.parametrize(("preferred", "chosen"), [("B0077", "B0077"), ("gone", "B0042"), (None, "B0042")])
def test_without_a_wish_the_preferred_kinect_is_chosen_and_else_the_first(preferred: str | None, chosen: str) -> None:
    assert choose(Driven(*TWO_1473).look(), None, preferred).identity == chosen


def test_a_wish_counts_more_than_what_is_preferred() -> None:
    assert choose(Driven(*TWO_1473).look(), "B0042", "B0077").identity == "B0042"


@pytest.mark.parametrize(
    ("there", "wanted", "sentence"),
    [
        (Driven(KinectPlan(parts=())), None, "no Kinect is plugged in: connect its USB cable and its power supply"),
        (
            Driven(KinectPlan(parts=(Part.MOTOR,))),
            None,
            "a Kinect's motor is plugged in at usb:1-1.1, but its camera is not there: connect the Kinect's power"
            " supply",
        ),
        (
            Driven(*TWO_1473),
            "B0001",
            "no Kinect answers to source.serial B0001; plugged in: B0042, B0077; see 'touchd list'",
        ),
    ],
)
def test_a_kinect_that_is_not_there_is_told_with_what_to_do(there: Driven, wanted: str | None, sentence: str) -> None:
    with pytest.raises(DeviceNotFound) as caught:
        choose(there.look(), wanted)
    assert str(caught.value) == sentence


def test_a_kinect_that_may_not_be_asked_for_its_serial_number_is_told_as_forbidden() -> None:
    there = Driven(A_1414)
    for part in Part:
        there.set_faults(Faults(open_errno=errno.EACCES), part)
    assert choose(there.look(), None).identity == "usb:1-1.4"
    with pytest.raises(DeviceDenied, match=r"Kinect usb:1-1\.4: no permission to use it: install touchd's udev rule"):
        choose(there.look(), "A0036")


def test_a_system_without_libusb_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_backend(**_: object) -> list[object]:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", no_backend)
    with pytest.raises(SourceError, match=r"libusb is missing, .*: apt-get install libusb-1\.0-0"):
        look_at_usb()


def test_a_bus_that_cannot_be_searched_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(**_: object) -> list[object]:
        raise USBError("Input/Output Error", -1, errno.EIO)

    monkeypatch.setattr(usb.core, "find", broken)
    with pytest.raises(SourceError, match="USB cannot be searched for cameras: Input/Output Error; is /dev/bus/usb"):
        look_at_usb()
