"""From what libusb says to what a user can act on."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager

from usb.core import USBError

from touchd.errors import DeviceBusy, DeviceDenied, DeviceLost, SourceError

_REMEDY = "check its cable and power"
_SILENT = {errno.ENOENT, errno.EIO, errno.EPIPE, errno.ETIMEDOUT}
_MORE_MEMORY = "echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb"


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
        return denied(name)
    if number == errno.EBUSY:
        return DeviceBusy(f"{name}: another program holds it: stop that program, 'touchd doctor' says which it may be")
    if number == errno.ENODEV:
        return gone(name, doing)
    if number in _SILENT:
        return DeviceLost(f"{name}: it gives no proper answer while {doing} ({reason}): {_REMEDY}")
    return SourceError(f"{name}: {doing} failed: {reason}; unplug the camera and plug it in again")


def denied(name: str) -> DeviceDenied:
    """Return the error for a camera that we may not use."""
    return DeviceDenied(
        f"{name}: no permission to use it: install touchd's udev rule with 'sudo make install', add yourself to the"
        " group touchd, and log in again; or unplug the camera and plug it in again if you just did"
    )


def gone(name: str, doing: str) -> DeviceLost:
    """Return the error for a camera that is not there any more."""
    return DeviceLost(f"{name}: it went away while {doing}: {_REMEDY}")


def refused_transfer(name: str, reason: str) -> SourceError:
    """Return the error for a camera that is there, but of whose stream no transfer can be submitted.

    libusb (1.0.26) reports most of the kernel's reasons, ENOMEM and ENOSPC among them, as an input/output error.
    """
    return SourceError(
        f"{name}: the system takes no more transfers for its stream ({reason}), most likely because USB memory has run"
        f" out: {_MORE_MEMORY}; if that does not help, plug other cameras into another USB controller"
    )
