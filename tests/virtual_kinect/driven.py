"""A KinectSource that lives in the virtual Kinect's own time: pumping and waiting are what makes it pass."""

import errno
import heapq
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count, islice

import usb.core
from touchd.model import Frame, Image16
from touchd.sources.kinect.camera import CameraSettings
from touchd.sources.kinect.devices import UsbPresence, look_at_usb
from touchd.sources.kinect.failures import gone, refused_transfer
from touchd.sources.kinect.source import KinectSource, Surroundings
from touchd.sources.kinect.stream import PACKETS, TRANSFERS, IsoStream, TakeTransfer

from virtual_kinect.backend import ModelBackend
from virtual_kinect.bus import Bus, Kinect, KinectPlan, Part
from virtual_kinect.camera import Camera
from virtual_kinect.faults import Faults
from virtual_kinect.isochronous import IsochronousQueue
from virtual_kinect.model import DeviceClock, Motor, UsbError
from virtual_kinect.pictures import array_of, gradient_pictures
from virtual_kinect.stream import MICROFRAMES_PER_S, Film

PICTURES = gradient_pictures(7)
_LONGEST_S = 7200.0  # a test that needs more has got stuck


@dataclass(slots=True)
class EventfulClock(DeviceClock):
    """A clock at whose times things happen, in the midst of whatever makes it move."""

    events: list[tuple[int, int, Callable[[], object]]] = field(default_factory=list)
    order: Iterator[int] = field(default_factory=count)

    @property
    def s(self) -> float:
        return self.now / MICROFRAMES_PER_S

    def at(self, seconds: float, action: Callable[[], object]) -> None:
        heapq.heappush(self.events, (round(seconds * MICROFRAMES_PER_S), next(self.order), action))

    def advance(self, microframes: int) -> None:
        end = self.now + microframes
        while self.events and self.events[0][0] <= end:
            at, _, action = heapq.heappop(self.events)
            self.now = max(self.now, at)
            action()
        self.now = max(self.now, end)
        assert self.s < _LONGEST_S, "this takes for ever"

    def pass_s(self, seconds: float) -> None:
        self.advance(round(seconds * MICROFRAMES_PER_S))


class Driven:
    """A bus with Kinects, all plugged in, and a source on it. ``pauses`` are all that the source waited, in s."""

    def __init__(self, *plans: KinectPlan) -> None:
        self.clock = EventfulClock()
        self.kinects = [Kinect(plan, Film(PICTURES), self.clock) for plan in plans or (KinectPlan(),)]
        self.bus = Bus(self.kinects)
        self.backend = ModelBackend(self.bus, self.clock)
        self.streams: list[ModelStream] = []
        self.pauses: list[float] = []

    @property
    def camera(self) -> Camera:
        assert self.kinects[0].camera
        return self.kinects[0].camera

    @property
    def motor(self) -> Motor:
        assert self.kinects[0].motor
        return self.kinects[0].motor

    def source(
        self, wanted: str | None = None, preferred: str | None = None, settings: CameraSettings | None = None
    ) -> KinectSource:
        surroundings = Surroundings(self.look, self.open_stream, self.now_ns, self.pause)
        return KinectSource(wanted, preferred, settings or CameraSettings(), None, surroundings)

    def set_faults(self, faults: Faults, part: Part = Part.CAMERA) -> None:
        self.kinects[0].device(part).faults = faults

    def unplug(self) -> None:
        self.bus.unplug(self.kinects[0])

    def plug(self) -> None:
        self.bus.plug(self.kinects[0])

    def look(self) -> UsbPresence:
        return look_at_usb(self.backend)

    def now_ns(self) -> int:
        return round(self.clock.s * 1e9)

    def pause(self, seconds: float) -> None:
        self.pauses.append(seconds)
        self.clock.pass_s(seconds)

    def open_stream(
        self, name: str, device: usb.core.Device, endpoint: int, packet_bytes: int, take: TakeTransfer
    ) -> IsoStream:
        self.streams.append(ModelStream(self.clock, name, device, endpoint, packet_bytes, take))
        return self.streams[-1]

    def reach(self, frames: Iterator[Frame], seconds: float) -> None:
        """Take frames until the clock shows a time; where none come any more, until the next one."""
        while self.clock.s < seconds:
            next(frames)

    def balance(self) -> list[int]:
        """Return how often each device was opened and not closed, and is claimed, and how many transfers are out."""
        devices = [device for kinect in self.kinects for device in kinect.devices]
        return [
            sum(device.opens - device.closes for device in devices),
            sum(device.owner is not None for device in devices),
            sum(len(stream) for stream in self.streams),
        ]


class ModelStream:
    """What LibusbStream is over libusb, over the model."""

    def __init__(
        self,
        clock: EventfulClock,
        name: str,
        device: usb.core.Device,
        endpoint: int,
        packet_bytes: int,
        take: TakeTransfer,
    ) -> None:
        self._clock = clock
        self._name = name
        self._take = take
        self._stride = packet_bytes
        self._buffer = bytearray(PACKETS * packet_bytes)
        self._queue = IsochronousQueue(device._ctx.handle, endpoint, clock)
        for key in range(TRANSFERS):
            self._submit(key)

    def __len__(self) -> int:
        return len(self._queue)

    def pump(self, timeout_s: float) -> None:
        latest = self._clock.now + round(timeout_s * MICROFRAMES_PER_S)
        end = self._queue.next_end()
        if end is None or end > self._clock.now:
            self._clock.advance(min(latest, end or latest) - self._clock.now)
        while (finished := self._queue.take()) is not None:
            if finished.error:
                raise gone(self._name, "streaming")
            for i, packet in enumerate(finished.packets):
                self._buffer[i * self._stride : i * self._stride + len(packet)] = packet
            self._take(memoryview(self._buffer), [len(packet) for packet in finished.packets], self._stride)
            self._submit(finished.key)

    def stop(self) -> None:
        for key in range(TRANSFERS):
            with suppress(UsbError):  # it has ended already
                self._queue.cancel(key)
        while self._queue.take() is not None:
            pass

    def _submit(self, key: int) -> None:
        try:
            self._queue.submit(key, PACKETS, len(self._buffer))
        except UsbError as error:
            self.stop()
            if error.errno == errno.ENODEV:
                raise gone(self._name, "streaming") from error
            raise refused_transfer(self._name, "Input/Output Error") from error


def take(frames: Iterator[Frame], number: int) -> list[Frame]:
    return list(islice(frames, number))


def shown(number: int) -> Image16:
    """Return the picture that frame ``number`` of a stream shows."""
    return array_of(PICTURES[number % len(PICTURES)])
