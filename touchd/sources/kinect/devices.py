"""Which Kinects are plugged in, and which of them is meant."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import usb.backend
import usb.core
from usb.core import USBError

from touchd.errors import DeviceNotFound, SourceError
from touchd.sources.kinect.commands import NO_SERIAL, PART_OF_PRODUCT, VENDOR_ID, Model, Part, camera_model

PATH_PREFIX = "usb:"
_NO_LIBUSB = "libusb is missing, which talks to the camera: apt-get install libusb-1.0-0"


@dataclass(frozen=True, slots=True)
class KinectDevice:
    """A camera, and the other devices of the same Kinect where they are there."""

    camera: usb.core.Device
    motor: usb.core.Device | None
    model: Model
    path: str  # where it is plugged in: usb:1-1.4
    serial: str | None  # the camera's own; None where it has none or may not be asked
    audio_serial: str | None

    @property
    def identity(self) -> str:
        """What tells it from other Kinects for longest: a serial number, else where it is plugged in."""
        return self.serial or self.audio_serial or self.path

    def answers_to(self, wanted: str) -> bool:
        """Return whether a user who wrote ``wanted`` as source.serial means this one."""
        return wanted in {self.serial, self.audio_serial, self.path}


@dataclass(frozen=True, slots=True)
class UsbPresence:
    """All parts of Kinects on the bus, also of those whose camera is not there."""

    kinects: tuple[KinectDevice, ...]
    without_camera: tuple[str, ...]  # the paths of motors that have no camera beside them


def look_at_usb(backend: usb.backend.IBackend | None = None) -> UsbPresence:
    """Look at the bus; nothing is claimed or reset. Raises SourceError where there is no libusb."""
    try:
        found = list(usb.core.find(find_all=True, idVendor=VENDOR_ID, backend=backend))
    except usb.core.NoBackendError as error:
        raise SourceError(_NO_LIBUSB) from error
    parts = [(PART_OF_PRODUCT[device.idProduct], device) for device in found if device.idProduct in PART_OF_PRODUCT]
    cameras = sorted((device for part, device in parts if part is Part.CAMERA), key=usb_path)
    motors = [device for part, device in parts if part is Part.MOTOR]
    alone = [usb_path(motor) for motor in motors if not any(_belong_together(motor, camera) for camera in cameras)]
    return UsbPresence(tuple(_kinect(camera, parts) for camera in cameras), tuple(sorted(alone)))


def choose(presence: UsbPresence, wanted: str | None, preferred: str | None = None) -> KinectDevice:
    """Return the Kinect that source.serial names; without it the ``preferred`` one if it is there, else the first.

    Raises DeviceNotFound.
    """
    for named in filter(None, (wanted, None if wanted else preferred)):
        for kinect in presence.kinects:
            if kinect.answers_to(named):
                return kinect
    if wanted is None and presence.kinects:
        return presence.kinects[0]
    if presence.kinects:
        there = ", ".join(kinect.identity for kinect in presence.kinects)
        raise DeviceNotFound(f"no Kinect answers to source.serial {wanted}; plugged in: {there}; see 'touchd list'")
    if presence.without_camera:
        raise DeviceNotFound(
            f"a Kinect's motor is plugged in at {presence.without_camera[0]}, but its camera is not there: connect the"
            " Kinect's power supply"
        )
    raise DeviceNotFound("no Kinect is plugged in: connect its USB cable and its power supply")


def usb_path(device: usb.core.Device) -> str:
    """Return where a device is plugged in, as the kernel writes it: usb:1-1.4."""
    ports = ".".join(map(str, device.port_numbers or (0,)))
    return f"{PATH_PREFIX}{device.bus}-{ports}"


def _kinect(camera: usb.core.Device, parts: Sequence[tuple[Part, usb.core.Device]]) -> KinectDevice:
    beside = {part: device for part, device in parts if _belong_together(device, camera)}
    audio = beside.get(Part.AUDIO)
    return KinectDevice(
        camera=camera,
        motor=beside.get(Part.MOTOR),
        model=camera_model(camera.idProduct, camera.bcdDevice),
        path=usb_path(camera),
        serial=_serial_of(camera),
        audio_serial=None if audio is None else _serial_of(audio),
    )


def _belong_together(a: usb.core.Device, b: usb.core.Device) -> bool:
    """Return whether two devices hang on the same hub, as those inside a Kinect do."""
    return a.bus == b.bus and (a.port_numbers or ())[:-1] == (b.port_numbers or ())[:-1]


def _serial_of(device: usb.core.Device) -> str | None:
    # Without permission, or gone in this very moment: it then has no serial number for us.
    with suppress(USBError, ValueError):
        serial = device.serial_number
        if serial and serial != NO_SERIAL:
            return str(serial)
    return None
