"""From what libusb says to what a user can act on."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager

from usb.core import USBError

from touchd.errors import DeviceBusy, DeviceDenied, DeviceLost, SourceError

_GONE = {errno.ENODEV, errno.ENOENT, errno.EIO, errno.EPIPE, errno.ETIMEDOUT}


@contextmanager
def told_for(name: str, doing: str) -> Iterator[None]:
    """Raise what libusb raises as a SourceError that names the camera, what was being done, and the remedy."""
    try:
        yield
    except USBError as error:
        raise usb_failure(name, doing, error.errno, error.strerror or str(error)) from error


def usb_failure(name: str, doing: str, number: int | None, reason: str) -> SourceError:
    """Return the error for the system's error ``number`` and its ``reason`` in words."""
    if number == errno.EACCES:
        return DeviceDenied(
            f"{name}: no permission to use it: install touchd's udev rule with 'sudo make install', add yourself to the"
            " group touchd, and log in again; or unplug the camera and plug it in again if you just did"
        )
    if number == errno.EBUSY:
        return DeviceBusy(f"{name}: another program holds it: stop that program, 'touchd doctor' says which it may be")
    if number == errno.ENOMEM:
        return SourceError(
            f"{name}: the system has no USB memory left for its stream ({doing}): "
            "echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb"
        )
    if number in _GONE:
        return DeviceLost(
            f"{name}: it went away or does not answer while {doing} ({reason}): check its cable and power"
        )
    return SourceError(f"{name}: {doing} failed: {reason}; unplug the camera and plug it in again")
