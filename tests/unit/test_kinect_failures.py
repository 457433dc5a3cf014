import errno

import pytest
from touchd.errors import DeviceBusy, DeviceDenied, DeviceLost, SourceError
from touchd.sources.kinect.failures import refused_transfer, told_for
from usb.core import USBError, USBTimeoutError


@pytest.mark.parametrize(
    ("error", "kind", "sentence"),
    [
        (
            USBError("Access denied", -3, errno.EACCES),
            DeviceDenied,
            "Kinect A: no permission to use it: install touchd's udev rule with 'sudo make install', add yourself to"
            " the group touchd, and log in again; or unplug the camera and plug it in again if you just did",
        ),
        (
            USBError("Resource busy", -6, errno.EBUSY),
            DeviceBusy,
            "Kinect A: another program holds it: stop that program, 'touchd doctor' says which it may be",
        ),
        (
            USBError("No such device", -4, errno.ENODEV),
            DeviceLost,
            "Kinect A: it went away while opening it: check its cable and power",
        ),
        (
            USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT),
            DeviceLost,
            "Kinect A: it gives no proper answer while opening it (Operation timed out): check its cable and power",
        ),
        (
            USBError("Overflow", -8, errno.EOVERFLOW),
            SourceError,
            "Kinect A: opening it failed: Overflow; unplug the camera and plug it in again",
        ),
        (
            USBError("Something"),
            SourceError,
            "Kinect A: opening it failed: Something; unplug the camera and plug it in again",
        ),
    ],
)
def test_what_libusb_says_becomes_a_sentence_with_a_remedy(
    error: USBError, kind: type[SourceError], sentence: str
) -> None:
    with pytest.raises(SourceError) as caught, told_for("Kinect A", "opening it"):
        raise error
    assert (type(caught.value), str(caught.value)) == (kind, sentence)


def test_other_errors_pass_untouched() -> None:
    with pytest.raises(ZeroDivisionError), told_for("Kinect A", "opening it"):
        raise ZeroDivisionError


def test_a_refused_transfer_names_usb_memory_and_how_to_get_more() -> None:
    assert str(refused_transfer("Kinect A", "Input/Output Error")) == (
        "Kinect A: the system takes no more transfers for its stream (Input/Output Error), most likely because USB"
        " memory has run out: echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb; if that does not help,"
        " plug other cameras into another USB controller"
    )
