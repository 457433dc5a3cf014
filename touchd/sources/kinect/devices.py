"""Which Kinects are plugged in, and which of them is meant."""

import errno
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import usb.backend
import usb.core
import usb.util
from usb.core import USBError

from touchd.errors import DeviceNotFound, SourceError
from touchd.sources.kinect.commands import INTERFACE, NO_SERIAL, PART_OF_PRODUCT, VENDOR_ID, Model, Part, camera_model
from touchd.sources.kinect.failures import denied

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
    forbidden: bool = False  # whether the system does not let us open it

    @property
    def name(self) -> str:
        """What to call it in messages."""
        return f"Kinect {self.identity}"

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
    """Look at the bus; nothing is claimed or reset, nor left open. Raises SourceError where that cannot be done."""
    try:
        found = list(usb.core.find(find_all=True, idVendor=VENDOR_ID, backend=backend))
    except usb.core.NoBackendError as error:
        raise SourceError(_NO_LIBUSB) from error
    except USBError as error:
        raise SourceError(f"USB cannot be searched for cameras: {error.strerror}; is /dev/bus/usb there?") from error
    parts = [(PART_OF_PRODUCT[device.idProduct], device) for device in found if device.idProduct in PART_OF_PRODUCT]
    cameras = sorted((device for part, device in parts if part is Part.CAMERA), key=_place)
    motors = sorted((device for part, device in parts if part is Part.MOTOR), key=_place)
    alone = [usb_path(motor) for motor in motors if not any(_belong_together(motor, camera) for camera in cameras)]
    kinects = tuple(_kinect(camera, parts) for camera in cameras)
    for _, device in parts:
        usb.util.dispose_resources(device)
    return UsbPresence(kinects, tuple(alone))


def choose(presence: UsbPresence, wanted: str | None, preferred: str | None = None) -> KinectDevice:
    """Return the Kinect that source.serial names; without it the ``preferred`` one if it is there, else the first.

    Raises DeviceNotFound, DeviceDenied where none can be told by its serial number as we may not ask for it.
    """
    for named in filter(None, (wanted, None if wanted else preferred)):
        for kinect in presence.kinects:
            if kinect.answers_to(named):
                return kinect
    if wanted is None and presence.kinects:
        return presence.kinects[0]
    for kinect in presence.kinects:
        if kinect.forbidden:
            raise denied(kinect.name)
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


def _place(device: usb.core.Device) -> tuple[int, tuple[int, ...]]:
    # Not by path, in which port 10 comes before port 9; and libusb lists devices in no order.
    return device.bus, tuple(device.port_numbers or ())


def _kinect(camera: usb.core.Device, parts: Sequence[tuple[Part, usb.core.Device]]) -> KinectDevice:
    beside = {part: device for part, device in parts if _belong_together(device, camera)}
    audio = beside.get(Part.AUDIO)
    forbidden = _forbidden(camera)
    return KinectDevice(
        camera=camera,
        motor=beside.get(Part.MOTOR),
        model=camera_model(camera.idProduct, camera.bcdDevice),
        path=usb_path(camera),
        serial=None if forbidden else _serial_of(camera),
        audio_serial=None if audio is None else _serial_of(audio),
        forbidden=forbidden,
    )


def _belong_together(a: usb.core.Device, b: usb.core.Device) -> bool:
    """Return whether two devices hang on the same hub, as those inside a Kinect do."""
    return a.bus == b.bus and (a.port_numbers or ())[:-1] == (b.port_numbers or ())[:-1]


def _forbidden(camera: usb.core.Device) -> bool:
    try:
        camera.is_kernel_driver_active(INTERFACE)
    except USBError as error:
        return bool(error.errno == errno.EACCES)
    except NotImplementedError:  # not every system has kernel drivers to ask about
        return False
    return False


def _serial_of(device: usb.core.Device) -> str | None:
    # Gone in this very moment, or not ours to ask: it then has no serial number for us.
    with suppress(USBError, ValueError):
        serial = device.serial_number
        if serial and serial != NO_SERIAL:
            return str(serial)
    return None
