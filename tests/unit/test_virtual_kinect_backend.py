import errno
import struct
from collections.abc import Callable
from typing import Any

import pytest
import usb.core
import usb.util

from virtual_kinect.backend import ModelBackend
from virtual_kinect.bus import Bus, Kinect, KinectPlan, Model
from virtual_kinect.faults import Faults
from virtual_kinect.model import DeviceClock
from virtual_kinect.pictures import gradient_pictures
from virtual_kinect.stream import Film, pack

PICTURES = gradient_pictures(2)
TRANSFER_BYTES = 32 * 1920


class Desk:
    """A bus with a 1414 and a 1473 on it, and pyusb on top."""

    def __init__(self) -> None:
        self.clock = DeviceClock()
        film = Film(PICTURES)
        self.kinect = Kinect(KinectPlan(), film, self.clock)
        self.bus = Bus([self.kinect, Kinect(KinectPlan(Model.XBOX_1473, "B0042", (2,)), film, self.clock)])
        self.backend = ModelBackend(self.bus, self.clock)

    def find(self, **wanted: int) -> list[Any]:
        return list(usb.core.find(find_all=True, backend=self.backend, **wanted))

    def set_faults(self, faults: Faults) -> None:
        assert self.kinect.camera
        self.kinect.camera.faults = faults


@pytest.fixture
def desk() -> Desk:
    return Desk()


def command(camera: Any, tag: int, number: int, *words: int) -> bytes:
    header = struct.pack("<2sHHH", b"GM", len(words), number, tag)
    camera.ctrl_transfer(0x40, 0, 0, 0, header + struct.pack(f"<{len(words)}H", *words))
    assert bytes(camera.ctrl_transfer(0xC0, 0, 0, 0, 512)) == b""
    reply = bytes(camera.ctrl_transfer(0xC0, 0, 0, 0, 512))
    assert reply[:8] == struct.pack("<2sHHH", b"RB", len(reply) // 2 - 4, number, tag)
    return reply[8:]


def started(desk: Desk) -> Any:
    camera = desk.find(idProduct=0x02AE)[0]
    camera.detach_kernel_driver(0)
    usb.util.claim_interface(camera, 0)
    registers = ((0x06, 0), (0x12, 3), (0x13, 1), (0x14, 30), (0x06, 2))
    for tag, (register, value) in enumerate(registers):
        command(camera, tag, 0x03, register, value)
    return camera


def error_of(action: Callable[[], object]) -> int | None:
    with pytest.raises(usb.core.USBError) as caught:
        action()
    number: int | None = caught.value.errno
    return number


def test_pyusb_finds_every_device_in_its_place(desk: Desk) -> None:
    places = [(device.idProduct, device.bus, device.address, device.port_numbers) for device in desk.find()]
    assert places == [
        (0x0002, 1, 1, None),
        (0x02C2, 1, 2, (1,)),
        (0x02B0, 1, 3, (1, 1)),
        (0x02AD, 1, 4, (1, 2)),
        (0x02AE, 1, 5, (1, 4)),
        (0x02C2, 1, 6, (2,)),
        (0x02AD, 1, 7, (2, 2)),
        (0x02AE, 1, 8, (2, 4)),
    ]


def test_pyusb_reads_the_descriptors_and_strings(desk: Desk) -> None:
    camera = desk.find(idProduct=0x02AE)[0]
    assert (camera.bcdDevice, camera.serial_number, camera.manufacturer) == (0x010B, "A00362A08602047A", "Microsoft")
    endpoints = [(end.bEndpointAddress, end.wMaxPacketSize, end.bmAttributes & 3) for end in camera[0][(0, 0)]]
    assert endpoints == [(0x81, 0x0BC0, 1), (0x82, 0x0BC0, 1)]
    assert [audio.serial_number for audio in desk.find(idProduct=0x02AD)] == ["A00362A08602047A", "B0042"]
    assert camera.parent.address == 2


def test_a_whole_frame_arrives_through_pyusb(desk: Desk) -> None:
    camera = started(desk)
    pixels = b""
    while len(pixels) < 422_400:
        buffer = usb.util.create_buffer(TRANSFER_BYTES)  # given a length, pyusb cuts off the last packets
        assert camera.read(0x82, buffer) > 0
        packets = [bytes(buffer[at : at + 1920]) for at in range(0, TRANSFER_BYTES, 1920)]
        for packet in packets:
            if packet[:2] == b"RB":
                pixels += packet[12 : 12 + (1132 if packet[3] == 0x75 else 1748)]
    assert pixels[:422_400] == pack(PICTURES[0], 11)


def test_time_passes_with_the_packets_that_are_read(desk: Desk) -> None:
    camera = started(desk)
    camera.read(0x82, TRANSFER_BYTES)
    camera.read(0x82, TRANSFER_BYTES)
    assert desk.clock.now == 64


def test_errors_reach_pyusb_users_as_libusb_reports_them(desk: Desk) -> None:
    camera = desk.find(idProduct=0x02AE)[0]
    desk.set_faults(Faults(open_errno=errno.EACCES))
    assert error_of(lambda: camera.is_kernel_driver_active(0)) == errno.EACCES
    desk.set_faults(Faults())
    assert error_of(lambda: usb.util.claim_interface(camera, 0)) == errno.EBUSY
    assert camera.is_kernel_driver_active(0)
    camera.detach_kernel_driver(0)
    assert not camera.is_kernel_driver_active(0)
    assert error_of(lambda: camera.detach_kernel_driver(0)) == errno.ENOENT
    assert error_of(lambda: camera.ctrl_transfer(0xC0, 0x77, 0, 0, 8)) == errno.EPIPE


def test_exhausted_memory_looks_to_pyusb_like_any_failed_submission(desk: Desk) -> None:
    camera = started(desk)
    desk.set_faults(Faults(iso_memory_bytes=TRANSFER_BYTES - 1))
    assert error_of(lambda: camera.read(0x82, TRANSFER_BYTES)) == errno.EIO


def test_a_control_transfer_that_times_out_raises_pyusbs_own_error(desk: Desk) -> None:
    camera = started(desk)
    desk.set_faults(Faults(control_errno=errno.ETIMEDOUT))
    with pytest.raises(usb.core.USBTimeoutError):
        camera.ctrl_transfer(0xC0, 0, 0, 0, 512)


def test_an_unplugged_camera_is_gone_for_its_user_and_for_those_who_look(desk: Desk) -> None:
    camera = started(desk)
    desk.bus.unplug(desk.kinect)
    assert error_of(lambda: camera.read(0x82, TRANSFER_BYTES)) == errno.ENODEV
    assert error_of(lambda: camera.ctrl_transfer(0xC0, 0, 0, 0, 512)) == errno.ENODEV
    assert [found.port_numbers for found in desk.find(idProduct=0x02AE)] == [(2, 4)]
    desk.bus.plug(desk.kinect)
    addresses = {found.port_numbers: found.address for found in desk.find(idProduct=0x02AE)}
    assert addresses == {(1, 4): 12, (2, 4): 8}
