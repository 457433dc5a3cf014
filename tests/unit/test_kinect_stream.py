"""The isochronous stream over a libusb that does what a test tells it to."""

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from inspect import getsource
from itertools import accumulate
from types import SimpleNamespace
from typing import Any

import pytest
import usb
import usb.core
from touchd.errors import DeviceLost, SourceError
from touchd.sources.kinect import stream
from touchd.sources.kinect.pacing import MICROFRAMES_PER_FRAME
from touchd.sources.kinect.stream import PACKETS, TRANSFERS, LibusbStream
from usb.backend import libusb1

from virtual_kinect.packages import need_packages

ENDPOINT, PACKET_BYTES = 0x82, 1920
USUAL = 45
COMPLETED, FAILED, CANCELLED, NO_DEVICE = 0, 1, 3, 5
OK, INPUT_OUTPUT, GONE, BROKEN = 0, -1, -4, -99
NEEDED_FIELDS = {
    *("dev_handle", "endpoint", "type", "timeout", "status", "length", "callback", "buffer"),
    *("num_iso_packets", "iso_packet_desc"),
}


class FakeLibusb:
    """Transfers come back, with the status of ``ends``, when events are handled; ``answers`` are those of submit."""

    def __init__(self) -> None:
        self.submitted: list[Any] = []
        self.cancelled: set[int] = set()
        self.freed = 0
        self.ends: list[int] = []
        self.answers: list[int] = []
        self.events = OK
        self.gives_back_cancelled = True
        self._memory: list[Any] = []
        self.lib = SimpleNamespace(
            libusb_alloc_transfer=self._alloc,
            libusb_submit_transfer=self._submit,
            libusb_cancel_transfer=lambda pointer: self.cancelled.add(ctypes.addressof(pointer.contents)),
            libusb_free_transfer=self._free,
            libusb_handle_events_timeout=lambda _context, _limit: self._handle_events(),
            libusb_strerror=lambda code: f"error {code}".encode(),
        )
        # The stream declares the functions' arguments on them, which bound methods do not take.
        for name, function in vars(self.lib).items():
            setattr(self.lib, name, partial(function))

    def open(self, take: Callable[[memoryview, Sequence[int], int], int | None]) -> LibusbStream:
        context = SimpleNamespace(
            backend=SimpleNamespace(lib=self.lib, ctx=None), handle=SimpleNamespace(handle=ctypes.c_void_p(7))
        )
        device: Any = SimpleNamespace(_ctx=context)
        return LibusbStream("Kinect A", device, ENDPOINT, PACKET_BYTES, take)

    def _alloc(self, packets: int) -> Any:
        size = ctypes.sizeof(libusb1._libusb_transfer) + packets * ctypes.sizeof(libusb1._libusb_iso_packet_descriptor)
        self._memory.append(ctypes.create_string_buffer(size))
        return ctypes.cast(self._memory[-1], ctypes.POINTER(libusb1._libusb_transfer))

    def _submit(self, pointer: Any) -> int:
        answer = self.answers.pop(0) if self.answers else OK
        if answer == OK:
            self.submitted.append(pointer)
        return answer

    def _free(self, _pointer: Any) -> None:
        self.freed += 1

    def _handle_events(self) -> int:
        if self.cancelled and self.gives_back_cancelled:
            back = [one for one in self.submitted if ctypes.addressof(one.contents) in self.cancelled]
            self.submitted = [one for one in self.submitted if one not in back]
            for pointer in back:
                _end(pointer, CANCELLED)
        while self.ends:
            _end(self.submitted.pop(0), self.ends.pop(0))
        return self.events


def _end(pointer: Any, status: int) -> None:
    pointer.contents.status = status
    pointer.contents.callback(pointer)


def nothing(_transfer: memoryview, _lengths: Sequence[int], _stride: int) -> None:
    pass


@pytest.fixture
def libusb() -> FakeLibusb:
    return FakeLibusb()


def test_pyusb_still_has_the_private_names_that_the_stream_reaches_into() -> None:
    need_packages()
    backend = libusb1.get_backend()
    device = usb.core.Device(SimpleNamespace(), _Descriptors())
    transfer = getattr(libusb1, "_libusb_transfer", None)
    fields = {field[0] for field in getattr(transfer, "_fields_", ())}
    there = {
        "usb.backend.libusb1._libusb_transfer": fields >= NEEDED_FIELDS,
        "usb.backend.libusb1._libusb_transfer_cb_fn_p": hasattr(libusb1, "_libusb_transfer_cb_fn_p"),
        "usb.core.Device._ctx.backend": hasattr(getattr(device, "_ctx", None), "backend"),
        "usb.core.Device._ctx.handle": hasattr(getattr(device, "_ctx", None), "handle"),
        "usb.backend.libusb1._DeviceHandle.handle": ".handle" in getsource(libusb1._DeviceHandle.__init__),
        "the libusb1 backend's lib": hasattr(backend, "lib"),
        "the libusb1 backend's ctx": hasattr(backend, "ctx"),
    }
    moved = [name for name, found in there.items() if not found]
    assert not moved, (
        f"pyusb {usb.__version__} has moved {moved}: adapt touchd/sources/kinect/stream.py, and pyusb's range in "
        "pyproject.toml"
    )


class _Descriptors:
    def get_device_descriptor(self, _device: object) -> SimpleNamespace:
        names = "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 idVendor"
        more = "idProduct bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations address bus"
        rest = "port_number port_numbers speed"
        return SimpleNamespace(**dict.fromkeys(f"{names} {more} {rest}".split(), 0))


def test_all_transfers_are_submitted_and_each_again_once_it_was_handed_over(libusb: FakeLibusb) -> None:
    seen: list[tuple[int, int, int]] = []
    running = libusb.open(lambda transfer, lengths, stride: seen.append((len(transfer), len(lengths), stride)))
    assert len(libusb.submitted) == TRANSFERS
    libusb.ends = [COMPLETED, COMPLETED]
    running.pump(0.0)
    assert seen == [(PACKETS * PACKET_BYTES, USUAL, PACKET_BYTES)] * 2
    assert len(libusb.submitted) == TRANSFERS - 2  # what was handed over may be used before USB is asked for more
    running.pump(0.0)
    assert len(libusb.submitted) == TRANSFERS
    running.stop()


def test_a_transfer_ends_just_behind_a_frame_once_it_is_known_where_frames_end(libusb: FakeLibusb) -> None:
    ends = iter([None, 20])  # in the second transfer, so at packet 45 + 20
    running = libusb.open(lambda *_: next(ends, None))
    libusb.ends = [COMPLETED, COMPLETED]
    running.pump(0.0)
    running.pump(0.0)
    submitted = TRANSFERS * USUAL
    for _ in range(8):
        libusb.ends = [COMPLETED]
        running.pump(0.0)
        running.pump(0.0)
    sizes = [one.contents.num_iso_packets for one in libusb.submitted[-10:]]
    boundaries = list(accumulate(sizes, initial=submitted))
    assert min(abs(65 + 1 + 2 + 3 * MICROFRAMES_PER_FRAME - boundary) for boundary in boundaries) < 1.0
    assert [one.contents.length for one in libusb.submitted[-10:]] == [PACKET_BYTES * size for size in sizes]
    running.stop()


def test_packets_lengths_are_handed_over_and_a_faulty_packet_has_none(libusb: FakeLibusb) -> None:
    seen: list[Sequence[int]] = []
    running = libusb.open(lambda _transfer, lengths, _stride: seen.append(lengths))
    first = libusb1._get_iso_packet_list(libusb.submitted[0].contents)
    assert {packet.length for packet in first} == {PACKET_BYTES}
    first[0].actual_length, first[1].actual_length, first[1].status = 1760, 1760, FAILED
    libusb.ends = [COMPLETED]
    running.pump(0.0)
    assert list(seen[0]) == [1760] + [0] * (USUAL - 1)
    running.stop()


def test_a_transfer_that_failed_is_submitted_again_without_being_handed_over(libusb: FakeLibusb) -> None:
    seen: list[int] = []
    running = libusb.open(lambda *_: seen.append(1))
    libusb.ends = [FAILED]
    running.pump(0.0)
    running.pump(0.0)
    assert (seen, len(libusb.submitted)) == ([], TRANSFERS)
    running.stop()


@pytest.mark.parametrize("order", [(COMPLETED, NO_DEVICE), (NO_DEVICE, COMPLETED)])
def test_an_unplugged_camera_is_lost_in_whatever_order_its_transfers_end(
    order: tuple[int, int], libusb: FakeLibusb
) -> None:
    running = libusb.open(nothing)
    libusb.ends = [*order, *[NO_DEVICE] * (TRANSFERS - 2)]
    libusb.answers = [GONE]
    with pytest.raises(DeviceLost, match=r"^Kinect A: it went away while streaming: check its cable and power$"):
        running.pump(0.0)
    running.stop()
    assert libusb.freed == TRANSFERS


def test_an_exception_in_whoever_takes_the_packets_comes_out_of_pump(libusb: FakeLibusb) -> None:
    def fail(_transfer: memoryview, _lengths: Sequence[int], _stride: int) -> None:
        raise ZeroDivisionError

    running = libusb.open(fail)
    libusb.ends = [COMPLETED, COMPLETED]
    with pytest.raises(ZeroDivisionError):
        running.pump(0.0)
    with pytest.raises(ZeroDivisionError):
        running.pump(0.0)
    running.stop()
    assert libusb.freed == TRANSFERS


def test_transfers_that_cannot_all_be_submitted_are_taken_back(libusb: FakeLibusb) -> None:
    libusb.answers = [OK, OK, INPUT_OUTPUT]
    with pytest.raises(SourceError, match=r"takes no more transfers for its stream \(error -1\), .*usbfs_memory_mb"):
        libusb.open(nothing)
    assert (libusb.submitted, libusb.freed) == ([], 3)


def test_a_usb_that_handles_no_events_any_more_is_a_lost_camera(libusb: FakeLibusb) -> None:
    running = libusb.open(nothing)
    libusb.events = BROKEN
    with pytest.raises(DeviceLost, match="Kinect A: USB brings no more of its stream: check its cable and power"):
        running.pump(0.0)
    libusb.events = OK
    running.stop()
    assert libusb.freed == TRANSFERS


def test_memory_is_given_back_only_after_every_cancelled_transfer_has_come_back(
    libusb: FakeLibusb, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "_PATIENCE_S", 0.01)
    running = libusb.open(nothing)
    libusb.gives_back_cancelled = False
    running.stop()
    assert (len(libusb.cancelled), libusb.freed) == (TRANSFERS, 0)
    libusb.gives_back_cancelled = True
    running.stop()
    assert libusb.freed == TRANSFERS
