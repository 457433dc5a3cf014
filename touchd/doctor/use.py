"""Whether a camera may be used, and who uses it."""

from dataclasses import dataclass
from enum import StrEnum

from touchd.doctor.computer import Computer
from touchd.doctor.depth_cameras import PluggedKinect
from touchd.doctor.open_files import Process
from touchd.doctor.survey import Survey

KERNEL_DRIVER = "kinect"  # the name that the kernel's module gspca_kinect has in sysfs
PROGRAM = "usbfs"  # likewise, where a program has claimed the device


class Use(StrEnum):
    """What can be said of a camera."""

    FREE = "free"
    KERNEL_DRIVER = "kernel-driver"
    TOUCHD = "touchd"
    HELD = "held"
    DENIED = "denied"
    NO_CAMERA = "no-camera"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True, slots=True)
class CameraUse:
    """How a camera fares, and the processes that have it open as far as that may be seen."""

    use: Use
    by: tuple[Process, ...] = ()

    @property
    def who(self) -> str:
        """Who holds it, in words."""
        return ", ".join(map(str, self.by)) or "a program of another user"


def use_of(computer: Computer, found: Survey, kinect: PluggedKinect) -> CameraUse:
    """Return who uses a Kinect, or whether it could be used."""
    camera = kinect.camera
    holders = found.open_files.holders(camera.node)
    if PROGRAM in camera.drivers or holders:
        ours = any(process.is_touchd for process in holders) or (not holders and _is_the_daemons(found, kinect))
        return CameraUse(Use.TOUCHD if ours else Use.HELD, holders)
    if not computer.may_use(computer.at(camera.node)):
        return CameraUse(Use.DENIED)
    return CameraUse(Use.KERNEL_DRIVER if KERNEL_DRIVER in camera.drivers else Use.FREE)


def _is_the_daemons(found: Survey, kinect: PluggedKinect) -> bool:
    """Return whether the daemon that answers reads this camera; its own files may be hidden from us."""
    if found.status is None or found.status.source.kind != "kinect" or found.status.source.waiting is not None:
        return False
    name = found.status.source.name
    return any(identity in name for identity in (kinect.serial, kinect.camera.place) if identity is not None)
