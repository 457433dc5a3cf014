"""A Kinect on a bus for tests of the model itself, and how to talk to it without any driver."""

import struct
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from virtual_kinect.bus import Bus, Kinect, KinectPlan
from virtual_kinect.camera import Camera
from virtual_kinect.model import DeviceClock, Handle, Setup, UsbError
from virtual_kinect.pictures import gradient_pictures
from virtual_kinect.stream import Film

ASK, FETCH = Setup(0x40, 0), Setup(0xC0, 0)
START = ((0x105, 0), (0x06, 0), (0x12, 3), (0x13, 1), (0x14, 30), (0x06, 2), (0x17, 0))
FILM = Film(gradient_pictures(2))


@dataclass(frozen=True, slots=True)
class Plugged:
    clock: DeviceClock
    bus: Bus
    kinect: Kinect
    camera: Camera


def plugged(plan: KinectPlan | None = None) -> Plugged:
    clock = DeviceClock()
    kinect = Kinect(plan or KinectPlan(), FILM, clock)
    bus = Bus([kinect])
    assert kinect.camera
    return Plugged(clock, bus, kinect, kinect.camera)


def send(camera: Camera, command: int, *words: int, tag: int = 0) -> None:
    header = struct.pack("<2sHHH", b"GM", len(words), command, tag)
    camera.control(ASK, header + struct.pack(f"<{len(words)}H", *words), 0)


def ask(camera: Camera, command: int, *words: int, tag: int = 0) -> bytes:
    send(camera, command, *words, tag=tag)
    replies = [camera.control(FETCH, b"", 512) for _ in range(2)]
    assert replies[0] == b""
    assert replies[1][:8] == struct.pack("<2sHHH", b"RB", len(replies[1]) // 2 - 4, command, tag)
    return replies[1][8:]


def start(camera: Camera, registers: tuple[tuple[int, int], ...] = START) -> None:
    for register, value in registers:
        assert ask(camera, 0x03, register, value) == b"\0\0"


def error_of(action: Callable[[], object]) -> int:
    with pytest.raises(UsbError) as caught:
        action()
    return caught.value.errno


def claimed(there: Plugged) -> Handle:
    handle = Handle(there.camera)
    handle.detach_kernel_driver()
    handle.claim()
    return handle
