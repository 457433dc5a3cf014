"""usbfs ioctls of a client under umockdev, served over the virtual devices. Runs under Debian's Python with gi.

All handlers run in the worker thread of umockdev's test bed. Memory of the client is reached through IoctlData:
``resolve`` fetches what a pointer points to, and what was changed there goes back when the ioctl is completed.
"""

import errno
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gi.repository import GLib, UMockdev  # type: ignore[import-not-found]

from virtual_kinect.model import Clock, Device, UsbError
from virtual_kinect.stream import MICROFRAMES_PER_S
from virtual_kinect.usbfs import (
    CONTROL,
    ISOCHRONOUS,
    PACKET_BYTES,
    REAP_AFTER_DISCONNECT,
    URB_BUFFER_AT,
    URB_BYTES,
    URB_STATUS_AT,
    OpenFile,
    Reaped,
    packet_results,
    packet_sizes,
    parse_urb,
)

_SET_INTERFACE, _SET_CONFIGURATION, _GET_DRIVER, _SUBMIT, _DISCARD, _REAP, _REAP_NO_DELAY = 4, 5, 8, 10, 11, 12, 13
_CLAIM, _RELEASE, _DRIVER_IOCTL, _RESET, _DISCONNECT, _CONNECT, _CAPABILITIES, _SPEED = 15, 16, 18, 20, 22, 23, 26, 31
_DRIVER_NAME_AT, _DRIVER_NAME_BYTES = 4, 256
_LONGEST_WAIT_MS = 6  # libusb asks without pause, as a mock node is always ready: nothing to reap is said late
_HIGH_SPEED = 3


@dataclass(frozen=True, slots=True)
class Setting:
    """What all nodes share. ``lock`` is held while the devices are used; ``pulled_out`` is told of every ENODEV.

    ``streaming`` tells whether any node has isochronous urbs in flight.
    """

    clock: Clock
    lock: threading.Lock
    patient: bool
    pulled_out: Callable[[], None]
    streaming: Callable[[], bool]


class DeviceNode:
    """Serves one virtual device's node to all clients that open it."""

    def __init__(self, device: Device, setting: Setting) -> None:
        self._device = device
        self._setting = setting
        self._lock = setting.lock
        self._files: dict[Any, OpenFile] = {}
        self._urbs: dict[tuple[Any, int], tuple[Any, tuple[int, ...]]] = {}  # memory and packet sizes
        self._reaping: set[Any] = set()  # clients whose last question was answered with a urb
        self.handler = UMockdev.IoctlBase()
        self.handler.connect("handle-ioctl", self._serve)
        self.handler.connect("client-connected", self._connected)
        self._served: dict[int, Callable[[Any, OpenFile], int | None]] = {
            _SUBMIT: self._submit,
            _DISCARD: self._discard,
            _SET_INTERFACE: self._set_interface,
            _SET_CONFIGURATION: lambda _client, _file: None,
            _GET_DRIVER: self._get_driver,
            _CLAIM: lambda _client, file: file.handle.claim(),
            _RELEASE: lambda _client, file: file.handle.release(),
            _DRIVER_IOCTL: self._driver_ioctl,
            _RESET: lambda _client, file: file.handle.reset(),
            _CAPABILITIES: self._capabilities,
            _SPEED: lambda _client, _file: _HIGH_SPEED,
        }

    @property
    def in_flight(self) -> int:
        """How many isochronous urbs clients have in flight."""
        return sum(file.in_flight for file in self._files.values())

    def _connected(self, _handler: Any, client: Any) -> None:
        client.connect("notify::connected", self._vanished)

    def _vanished(self, client: Any, _property: Any) -> None:
        with self._lock:
            if not client.get_property("connected") and client in self._files:
                self._files.pop(client).close()
                self._reaping.discard(client)
                self._urbs = {key: urb for key, urb in self._urbs.items() if key[0] is not client}

    def _serve(self, _handler: Any, client: Any) -> bool:
        request = client.get_property("request")
        if (request >> 8) & 0xFF != ord("U"):
            client.complete(-1, errno.ENOTTY)
            return True
        number = request & 0xFF
        with self._lock:
            try:
                file = self._file(client)
                if number in {_REAP, _REAP_NO_DELAY}:
                    self._reap(client, file, waited=False)
                    return True
                serve = self._served.get(number)
                result, error = (serve(client, file) or 0, 0) if serve else (-1, errno.ENOTTY)
            except UsbError as failure:
                result, error = self._failed(failure)
        client.complete(result, error)
        return True

    def _failed(self, error: UsbError) -> tuple[int, int]:
        if error.errno == errno.ENODEV:
            self._setting.pulled_out()  # perhaps only just now, by a fault
        return -1, error.errno

    def _file(self, client: Any) -> OpenFile:
        if client not in self._files:
            self._files[client] = OpenFile(self._device, self._setting.clock, patient=self._setting.patient)
        return self._files[client]

    def _submit(self, client: Any, file: OpenFile) -> None:
        argument = client.get_property("arg")
        address = _pointer(argument)
        memory = argument.resolve(0, URB_BYTES)
        urb = parse_urb(bytes(memory.retrieve()))
        if urb.kind == CONTROL:
            file.submit_control(address, bytes(memory.resolve(URB_BUFFER_AT, urb.buffer_length).retrieve()))
            self._urbs[client, address] = (memory, ())
        elif urb.kind == ISOCHRONOUS:
            # Known only now: the urb's whole length. A reload forgets what was resolved, but not that resolving put
            # an address of our own into the argument; so the client's goes back first.
            argument.reload()
            argument.update(0, struct.pack("<Q", address))
            memory = argument.resolve(0, URB_BYTES + PACKET_BYTES * urb.packets)
            sizes = packet_sizes(bytes(memory.retrieve()), urb.packets)
            file.submit_isochronous(address, urb, sizes)
            self._urbs[client, address] = (memory, sizes)
        else:
            raise UsbError(errno.EINVAL)

    def _discard(self, client: Any, file: OpenFile) -> None:
        file.discard(_pointer(client.get_property("arg")))

    def _reap(self, client: Any, file: OpenFile, *, waited: bool) -> None:
        """Give back a finished urb, at once or as soon as one is; else say that there is none.

        libusb asks again after each one that it gets, and only goes on when there is none: that is said at once. So it
        is at a node without urbs while another one streams: libusb asks them in turn, and that one makes it wait.
        """
        reaped = file.reap()
        beside_a_stream = file.in_flight == 0 and self._setting.streaming()
        if reaped is not None:
            self._give_back(client, reaped)
            self._reaping.add(client)
            client.complete(0, 0)
        elif waited or client in self._reaping or beside_a_stream:
            self._reaping.discard(client)
            client.complete(-1, errno.EAGAIN)
        else:
            timer = GLib.Timeout(self._wait_ms(file))
            timer.set_callback(self._reap_late, (client, file))
            timer.attach(GLib.MainContext.get_thread_default())

    def _reap_late(self, waiting: tuple[Any, OpenFile]) -> bool:
        client, file = waiting
        with self._lock:
            try:
                self._reap(client, file, waited=True)
            except UsbError as error:
                client.complete(*self._failed(error))
        return bool(GLib.SOURCE_REMOVE)

    def _wait_ms(self, file: OpenFile) -> int:
        end = file.next_end()
        if end is None:
            return _LONGEST_WAIT_MS
        microframes = end - self._setting.clock.microframe()
        return min(max(-(-microframes * 1000 // MICROFRAMES_PER_S), 1), _LONGEST_WAIT_MS)

    def _give_back(self, client: Any, reaped: Reaped) -> None:
        memory, sizes = self._urbs.pop((client, reaped.address))
        if reaped.pieces:
            (buffer_length,) = struct.unpack_from("<i", memory.retrieve(), 24)
            buffer = memory.resolve(URB_BUFFER_AT, buffer_length)
            for at, data in reaped.pieces:
                buffer.update(at, data)
        memory.update(URB_STATUS_AT, struct.pack("<i", reaped.status))
        memory.update(28, struct.pack("<i", reaped.actual_length))
        memory.update(40, struct.pack("<i", reaped.errors))
        if sizes:
            memory.update(URB_BYTES, packet_results(sizes, reaped))
        client.get_property("arg").resolve(0, 8).set_ptr(0, memory)

    def _set_interface(self, client: Any, file: OpenFile) -> None:
        _interface, alternate = struct.unpack("<II", client.get_property("arg").resolve(0, 8).retrieve())
        file.handle.set_alternate(alternate)

    def _get_driver(self, client: Any, file: OpenFile) -> None:
        file.handle.device.check()
        name = "usbfs" if file.handle.device.owner is not None else file.handle.device.kernel_driver
        if name is None:
            raise UsbError(errno.ENODATA)
        data = client.get_property("arg").resolve(0, _DRIVER_NAME_AT + _DRIVER_NAME_BYTES)
        data.update(_DRIVER_NAME_AT, name.encode() + b"\0")

    def _driver_ioctl(self, client: Any, file: OpenFile) -> None:
        _interface, code = struct.unpack_from("<iI", client.get_property("arg").resolve(0, 16).retrieve())
        if code & 0xFF == _DISCONNECT:
            file.handle.detach_kernel_driver()
        elif code & 0xFF == _CONNECT:
            file.handle.device.attach_kernel_driver()

    def _capabilities(self, client: Any, _file: OpenFile) -> None:
        client.get_property("arg").resolve(0, 4).update(0, struct.pack("<I", REAP_AFTER_DISCONNECT))


def _pointer(argument: Any) -> int:
    """Return the ioctl's argument: an address in the client."""
    return int.from_bytes(argument.retrieve(), "little")
