"""The kernel's usbfs, as far as libusb uses it, over opened virtual devices. Standard library alone.

Numbers and layouts are those of linux/usbdevice_fs.h on a 64-bit machine.
"""

import errno
import struct
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from virtual_kinect.isochronous import Finished, IsochronousQueue
from virtual_kinect.model import Clock, Device, Handle, Setup, UsbError

ISOCHRONOUS, CONTROL = 0, 2  # urb types
URB_BYTES, PACKET_BYTES = 56, 12  # a urb is followed by the descriptions of its packets
URB_BUFFER_AT, URB_STATUS_AT = 16, 4
REAP_AFTER_DISCONNECT = 0x10  # a capability
NO_DEVICE = errno.ESHUTDOWN  # how urbs end when the device is pulled out
_NOT_DONE = -errno.EXDEV  # the status of a packet whose time never came


class Urb(NamedTuple):
    """What a submitted urb says."""

    kind: int
    endpoint: int
    buffer_length: int
    packets: int


class Reaped(NamedTuple):
    """A urb to give back, by its address in the client; ``pieces`` are what to write into its buffer, and where."""

    address: int
    status: int
    actual_length: int
    errors: int
    lengths: tuple[int, ...]
    pieces: tuple[tuple[int, bytes], ...]


def parse_urb(data: bytes) -> Urb:
    kind, endpoint = data[0], data[1]
    (buffer_length,) = struct.unpack_from("<i", data, 24)
    (packets,) = struct.unpack_from("<i", data, 36)
    return Urb(kind, endpoint, buffer_length, packets if kind == ISOCHRONOUS else 0)


def packet_sizes(data: bytes, packets: int) -> tuple[int, ...]:
    """Return how much room the client gives each packet."""
    return tuple(struct.unpack_from("<I", data, URB_BYTES + PACKET_BYTES * i)[0] for i in range(packets))


def packet_results(sizes: Sequence[int], reaped: Reaped) -> bytes:
    """Return the packet descriptions as they go back to the client."""
    status = _NOT_DONE if reaped.status else 0
    lengths = reaped.lengths or (0,) * len(sizes)
    return b"".join(struct.pack("<IIi", size, length, status) for size, length in zip(sizes, lengths, strict=True))


@dataclass(frozen=True, slots=True)
class _Submitted:
    endpoint: int
    sizes: tuple[int, ...]


class OpenFile:
    """A device node as one client has opened it. Its methods raise UsbError with the errno of the ioctl."""

    def __init__(self, device: Device, clock: Clock, *, patient: bool) -> None:
        self.handle = Handle(device)
        self._patient = patient
        self._clock = clock
        self._queues: dict[int, IsochronousQueue] = {}
        self._submitted: dict[int, _Submitted] = {}
        self._controls: deque[Reaped] = deque()

    @property
    def in_flight(self) -> int:
        """How many isochronous urbs have not been given back."""
        return len(self._submitted)

    def submit_control(self, address: int, buffer: bytes) -> None:
        """Do a control transfer: 8 bytes of setup, then the data or the room for it."""
        request_type, request, value, index, length = struct.unpack_from("<BBHHH", buffer)
        setup = Setup(request_type, request, value, index)
        incoming = bool(request_type & 0x80)
        try:
            answer = self.handle.device.control(setup, b"" if incoming else buffer[8 : 8 + length], length)
        except UsbError as error:
            if error.errno == errno.ENODEV:
                raise
            self._controls.append(Reaped(address, -error.errno, 0, 0, (), ()))
        else:
            done = len(answer) if incoming else length
            self._controls.append(Reaped(address, 0, done, 0, (), ((8, answer),) if answer else ()))

    def submit_isochronous(self, address: int, urb: Urb, sizes: tuple[int, ...]) -> None:
        """Queue a transfer; EMSGSIZE for packets that the endpoint never has."""
        if max(sizes, default=0) > self.handle.device.check_endpoint(urb.endpoint):
            raise UsbError(errno.EMSGSIZE)
        if urb.endpoint not in self._queues:
            queue = IsochronousQueue(self.handle, urb.endpoint, self._clock, patient=self._patient)
            self._queues[urb.endpoint] = queue
        self._queues[urb.endpoint].submit(address, urb.packets, urb.buffer_length)
        self._submitted[address] = _Submitted(urb.endpoint, sizes)

    def discard(self, address: int) -> None:
        """Cancel a transfer, which is given back all the same; EINVAL if it has ended."""
        self.handle.device.check()
        if address not in self._submitted:
            raise UsbError(errno.EINVAL)
        self._queues[self._submitted[address].endpoint].cancel(address)

    def reap(self) -> Reaped | None:
        """Return a transfer that has ended, None if none has; ENODEV if there is no device and nothing to give."""
        if self._controls:
            return self._controls.popleft()
        for queue in self._queues.values():
            finished = queue.take()
            if finished is not None:
                return _reaped(finished, self._submitted.pop(finished.key).sizes)
        self.handle.device.check()
        return None

    def next_end(self) -> int | None:
        """Return the microframe after which there is something to reap, None while nothing is in flight."""
        ends = [end for queue in self._queues.values() if (end := queue.next_end()) is not None]
        return min(ends, default=None)

    def close(self) -> None:
        self.handle.close()


def _reaped(finished: Finished, sizes: tuple[int, ...]) -> Reaped:
    pieces = []
    at = 0
    for size, packet in zip(sizes, finished.packets or (b"",) * len(sizes), strict=True):
        if packet:
            pieces.append((at, packet[:size]))
        at += size
    status = -NO_DEVICE if finished.error == errno.ENODEV else -finished.error
    lengths = tuple(min(len(packet), size) for size, packet in zip(sizes, finished.packets, strict=False))
    errors = 0 if not finished.error else len(sizes)
    return Reaped(finished.key, status, sum(lengths), errors, lengths, tuple(pieces))
