"""The devices of a Kinect v1 as USB sees them: control requests, registers and the isochronous stream.

Made from the facts of the OpenKinect project's documentation, independently of touchd's driver, which it checks.
Standard library alone: Debian's own Python imports this, too.
"""

import errno
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from virtual_kinect.faults import Faults
from virtual_kinect.shapes import CONFIGURATION, DEVICE, STRING, Shape

IN, VENDOR = 0x80, 0x40  # bits of bmRequestType
GET_DESCRIPTOR, GET_CONFIGURATION = 6, 8


class UsbError(Exception):
    """A USB operation failed; ``errno`` is the kernel's."""

    def __init__(self, number: int) -> None:
        super().__init__(f"{errno.errorcode[number]} ({number})")
        self.errno = number


class Setup(NamedTuple):
    """The setup packet of a control transfer, without its length."""

    request_type: int
    request: int
    value: int = 0
    w_index: int = 0


class Clock(Protocol):
    """USB's time."""

    def microframe(self) -> int:
        """Return the number of the microframe that it is now; there are 8 000 a second."""


@dataclass(slots=True)
class DeviceClock:
    """A clock that stands still unless it is moved: tests are as fast as they can and always the same."""

    now: int = 0

    def microframe(self) -> int:
        return self.now

    def advance(self, microframes: int) -> None:
        self.now += microframes


class Device:
    """A USB device in its place. ``ports`` are the ports from the root hub down; ``address`` is the bus's to give.

    The counters ``opens``, ``closes``, ``claims`` and ``resets`` tell a test what was done to it.
    """

    def __init__(self, shape: Shape, ports: tuple[int, ...], bus: int = 1) -> None:
        self.shape = shape
        self.ports = ports
        self.bus = bus
        self.address = 0
        self.plugged = False
        self.on_fault_unplug: Callable[[], None] = lambda: None
        self.own_driver: str | None = None  # the kernel's driver that binds by itself
        self.kernel_driver: str | None = None
        self.alternate = 0
        self.owner: Handle | None = None
        self.opens = self.closes = self.claims = self.resets = 0
        self.faults = Faults()

    @property
    def name(self) -> str:
        """What the kernel calls it, such as 1-1.4 or usb1."""
        return f"{self.bus}-" + ".".join(map(str, self.ports)) if self.ports else f"usb{self.bus}"

    @property
    def faults(self) -> Faults:
        return self._faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        self._faults = faults
        self._controls = 0

    def check(self) -> None:
        """Raise ENODEV if it is unplugged."""
        if not self.plugged:
            raise UsbError(errno.ENODEV)

    def pull_out(self) -> None:
        """Be unplugged by a fault, in the middle of what is being done."""
        self.on_fault_unplug()
        raise UsbError(errno.ENODEV)

    def control(self, setup: Setup, data: bytes, length: int) -> bytes:
        """Do a control transfer: ``data`` goes out, or up to ``length`` bytes come back. UsbError if it fails."""
        self.check()
        if self._controls == self.faults.unplug_after_controls:
            self.pull_out()
        self._controls += 1
        if self.faults.control_errno is not None and setup.request_type & VENDOR:
            raise UsbError(self.faults.control_errno)
        answer = self.vendor(setup, data) if setup.request_type & VENDOR else self._standard(setup)
        if answer is None:
            raise UsbError(errno.EPIPE)
        return answer[:length] if setup.request_type & IN else b""

    def vendor(self, setup: Setup, data: bytes) -> bytes | None:
        """Answer a vendor request; None stalls the endpoint, as unknown requests do."""
        del setup, data
        return None

    def _standard(self, setup: Setup) -> bytes | None:
        if not setup.request_type & IN:
            return b""
        if setup.request == GET_CONFIGURATION:
            return b"\x01"
        if setup.request != GET_DESCRIPTOR:
            return None
        kind, index = divmod(setup.value, 256)
        if kind == STRING:
            return self.shape.string_descriptor(index)
        return {DEVICE: self.shape.device_descriptor(), CONFIGURATION: self.shape.configuration_descriptor()}.get(kind)

    def iso_packets(self, endpoint: int, first: int, count: int) -> list[bytes]:
        """Return what the endpoint sends in ``count`` microframes from ``first`` on: nothing is b""."""
        del endpoint, first
        self.check()
        return [b""] * count

    def check_endpoint(self, address: int) -> int:
        """Return the most bytes of a packet of an endpoint; ENOENT for one that there is not."""
        self.check()
        for endpoint in self.shape.endpoints:
            if endpoint.address == address:
                return endpoint.packet_bytes
        raise UsbError(errno.ENOENT)

    def attach_kernel_driver(self) -> None:
        """Bind the driver that the kernel has for it, if it has one."""
        self.kernel_driver = self.own_driver

    def close_down(self) -> None:
        """Forget what a device forgets when it loses its power."""
        self.owner, self.alternate = None, 0


class Motor(Device):
    """Motor, LED and accelerometer of a model 1414."""

    def __init__(self, shape: Shape, ports: tuple[int, ...], bus: int = 1) -> None:
        super().__init__(shape, ports, bus)
        self.led = 0
        self.leds: list[int] = []  # every state that the LED was put in
        self.tilts: list[int] = []  # every tilt that was asked for, in half degrees
        self.acceleration = (0, 819, 0)  # x, y, z; 819 counts a g

    def vendor(self, setup: Setup, data: bytes) -> bytes | None:
        del data
        if setup[:2] == (0x40, 0x06) and setup.value <= 6:
            self.led = setup.value
            self.leds.append(setup.value)
            return b""
        if setup[:2] == (0x40, 0x31):
            half_degrees = struct.unpack("<h", struct.pack("<H", setup.value))[0]
            self.tilts.append(half_degrees)
            return b"" if abs(half_degrees) <= 62 else None
        if setup[:2] == (0xC0, 0x32):
            tilt = self.tilts[-1] if self.tilts else 0
            return struct.pack(">hhhhbB", 0, *self.acceleration, tilt, 0)
        return None


class Handle:
    """A device as one program has opened it. All operations raise UsbError with the kernel's errno."""

    def __init__(self, device: Device) -> None:
        device.check()
        if device.faults.open_errno is not None:
            raise UsbError(device.faults.open_errno)
        self.device = device
        self.iso_bytes = 0
        device.opens += 1

    def close(self) -> None:
        self.release()
        self.device.closes += 1

    def claim(self) -> None:
        """Claim interface 0; EBUSY while the kernel's driver or another program has it."""
        device = self.device
        device.check()
        if device.faults.claim_errno is not None:
            raise UsbError(device.faults.claim_errno)
        if device.kernel_driver is not None or device.owner not in {None, self}:
            raise UsbError(errno.EBUSY)
        device.owner = self
        device.claims += 1

    def release(self) -> None:
        if self.device.owner is self:
            self.device.owner = None

    def set_alternate(self, alternate: int) -> None:
        self.device.check()
        self.need_claim()
        if alternate >= self.device.shape.alternates:
            raise UsbError(errno.EINVAL)
        self.device.alternate = alternate

    def need_claim(self) -> None:
        """Raise ENOENT without the claim. The kernel would claim for the program, with a warning in its log."""
        if self.device.owner is not self:
            raise UsbError(errno.ENOENT)

    def detach_kernel_driver(self) -> None:
        self.device.check()
        if self.device.kernel_driver is None:
            raise UsbError(errno.ENODATA)
        self.device.kernel_driver = None

    def reset(self) -> None:
        self.device.check()
        self.device.resets += 1

    def hold_iso_memory(self, length: int) -> None:
        """Take memory for a transfer; ENOMEM where usbfs has no more."""
        if self.iso_bytes + length > self.device.faults.iso_memory_bytes:
            raise UsbError(errno.ENOMEM)
        self.iso_bytes += length

    def free_iso_memory(self, length: int) -> None:
        self.iso_bytes -= length
