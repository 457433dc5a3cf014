"""Isochronous transfers kept in flight through the libusb that pyusb has loaded.

pyusb reads one transfer at a time, synchronously, and forgets where its packets begin; a camera that sends 8 000 of
them a second needs many transfers in flight. pyusb's libusb backend declares libusb's structures; this uses them, and
reaches into private names for it. Everything happens on the thread that calls :meth:`IsoStream.pump`.
"""

import ctypes
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
import usb.backend.libusb1
import usb.core

from touchd.errors import DeviceLost, SourceError
from touchd.sources.kinect.failures import gone, refused_transfer
from touchd.sources.kinect.pacing import TransferSizes

TRANSFERS = 12  # 67 ms in flight
PACKETS = 48  # that a transfer can hold; of which it takes about 45, or 5.6 ms
_COMPLETED, _CANCELLED, _NO_DEVICE = 0, 3, 5  # libusb_transfer_status
_GONE, _INTERRUPTED = -4, -10  # libusb_error
_ISOCHRONOUS = 1  # libusb_transfer_type
_PATIENCE_S = 2.0  # for the cancelled transfers to come back
_DESCRIPTOR_WORDS = 3  # length, actual length, status

# Gets a transfer's bytes, its packets' lengths and distance in bytes; returns the place of one that ended a frame.
TakeTransfer = Callable[[memoryview, Sequence[int], int], int | None]


class IsoStream(Protocol):
    """A running stream of isochronous packets."""

    def pump(self, timeout_s: float) -> None:
        """Hand over the transfers that are complete, waiting for one up to ``timeout_s``. Raises DeviceLost."""

    def stop(self) -> None:
        """End the stream and wait until the last transfer has come back."""


OpenStream = Callable[[str, usb.core.Device, int, int, TakeTransfer], IsoStream]


class _Timeval(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_long), ("tv_usec", ctypes.c_long))


class LibusbStream:
    """A dozen transfers of an opened device's endpoint, each submitted again after it was handed over."""

    def __init__(
        self, name: str, device: usb.core.Device, endpoint: int, packet_bytes: int, take: TakeTransfer
    ) -> None:
        """Submit all transfers; each that is complete goes to ``take``.

        Raises SourceError where the system has no memory for them, DeviceLost where the camera is gone.
        """
        self._name = name
        self._take = take
        self._stride = packet_bytes
        self._backend = device._ctx.backend  # noqa: SLF001  pyusb keeps its handle and context there alone
        self._lib = _with_prototypes(self._backend.lib)
        self._handle = device._ctx.handle.handle  # noqa: SLF001
        self._failure: BaseException | None = None
        self._stopping = False
        self._flying = 0
        # ctypes keeps no reference to a callback: this one must live as long as any transfer does.
        self._callback: Any = _CALLBACK(self._came_back)
        self._transfers: dict[int, _Transfer] = {}
        self._idle: list[_Transfer] = []
        self._sizes = TransferSizes(PACKETS)
        try:
            for _ in range(TRANSFERS):
                transfer = _Transfer(self._lib, self._handle, endpoint, packet_bytes, self._callback)
                self._transfers[transfer.address] = transfer
                self._submit(transfer)
        except BaseException:
            self.stop()
            raise

    def pump(self, timeout_s: float) -> None:
        """Hand over the transfers that are complete, waiting for one up to ``timeout_s``.

        Raises what ``take`` raised, DeviceLost where the camera is gone.
        """
        if self._failure is None:
            self._submit_again()
        if self._failure is None and not self._handle_events(timeout_s):
            self._failure = DeviceLost(f"{self._name}: USB brings no more of its stream: check its cable and power")
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """Cancel all transfers and wait until each has come back; only then is their memory given back."""
        self._stopping = True
        for transfer in self._transfers.values():
            if transfer.flying:
                self._lib.libusb_cancel_transfer(transfer.pointer)
        until_s = time.monotonic() + _PATIENCE_S
        while self._flying and time.monotonic() < until_s and self._handle_events(until_s - time.monotonic()):
            pass
        if self._flying:
            # libusb may still write into them: memory that is lost is better than memory that is overwritten.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self))
            return
        for transfer in self._transfers.values():
            self._lib.libusb_free_transfer(transfer.pointer)
        self._transfers.clear()
        self._idle.clear()
        # Both refer to this object: without it, some MB would wait for Python to look for cycles.
        self._callback = self._failure = None

    def _handle_events(self, timeout_s: float) -> bool:
        """Let libusb call back for what has ended, waiting for one up to ``timeout_s``; return whether it could."""
        seconds, fraction = divmod(max(0.0, timeout_s), 1.0)
        limit = _Timeval(int(seconds), int(fraction * 1e6))
        code = self._lib.libusb_handle_events_timeout(self._backend.ctx, ctypes.byref(limit))
        return code in {0, _INTERRUPTED}

    def _submit_again(self) -> None:
        """Submit what was handed over since the last time: not at once, as a frame that is ready should not wait."""
        try:
            for transfer in self._idle:
                self._submit(transfer)
        except SourceError as error:
            self._failure = error
        self._idle.clear()

    def _submit(self, transfer: "_Transfer") -> None:
        transfer.prepare(*self._sizes.plan())
        code = self._lib.libusb_submit_transfer(transfer.pointer)
        if code == _GONE:
            raise gone(self._name, "streaming")
        if code != 0:
            raise refused_transfer(self._name, self._lib.libusb_strerror(code).decode())
        transfer.flying = True
        self._flying += 1

    def _came_back(self, pointer: Any) -> None:
        # Exceptions in here would only be printed: pump() raises them.
        transfer = self._transfers[ctypes.addressof(pointer.contents)]
        transfer.flying = False
        self._flying -= 1
        if self._stopping or self._failure is not None:
            return
        try:
            self._hand_over(transfer)
        except BaseException as error:  # noqa: BLE001
            self._failure = error

    def _hand_over(self, transfer: "_Transfer") -> None:
        status = transfer.pointer.contents.status
        if status in {_CANCELLED, _NO_DEVICE}:
            raise gone(self._name, "streaming")
        if status == _COMPLETED:
            ended = self._take(transfer.view, transfer.lengths(), self._stride)
            if ended is not None:
                self._sizes.ended(transfer.first_microframe + ended)
        self._idle.append(transfer)


class _Transfer:
    """One libusb transfer with its buffer and a view of its packets' descriptors."""

    def __init__(self, lib: Any, handle: Any, endpoint: int, packet_bytes: int, callback: Any) -> None:
        self.pointer = lib.libusb_alloc_transfer(PACKETS)
        self.address = ctypes.addressof(self.pointer.contents)
        self.flying = False
        self.first_microframe = 0
        self._stride = packet_bytes
        self._packets = 0
        self._buffer = np.zeros(PACKETS * packet_bytes, np.uint8)
        self.view = self._buffer.data
        contents = self.pointer.contents
        contents.dev_handle = handle
        contents.endpoint = endpoint
        contents.type = _ISOCHRONOUS
        contents.timeout = 0
        contents.buffer = self._buffer.ctypes.data
        contents.callback = callback
        words = (ctypes.c_int * (_DESCRIPTOR_WORDS * PACKETS)).from_address(ctypes.addressof(contents.iso_packet_desc))
        self._descriptors = np.ctypeslib.as_array(words).reshape(PACKETS, _DESCRIPTOR_WORDS)
        self._descriptors[:, 0] = packet_bytes

    def prepare(self, first_microframe: int, packets: int) -> None:
        """Have it take as many packets from its next submission on."""
        self.first_microframe = first_microframe
        self._packets = packets
        self.pointer.contents.num_iso_packets = packets
        self.pointer.contents.length = packets * self._stride

    def lengths(self) -> list[int]:
        """Return how many bytes of each packet came, 0 for those that the host found faulty."""
        came, status = self._descriptors[: self._packets, 1], self._descriptors[: self._packets, 2]
        lengths: list[int] = (came * (status == _COMPLETED)).tolist()
        return lengths


_CALLBACK = usb.backend.libusb1._libusb_transfer_cb_fn_p  # noqa: SLF001  see the module's docstring


def _with_prototypes(lib: Any) -> Any:
    """Declare the functions that pyusb does not use itself."""
    lib.libusb_cancel_transfer.argtypes = [ctypes.POINTER(usb.backend.libusb1._libusb_transfer)]  # noqa: SLF001
    lib.libusb_handle_events_timeout.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Timeval)]
    lib.libusb_strerror.argtypes = [ctypes.c_int]
    lib.libusb_strerror.restype = ctypes.c_char_p
    return lib
