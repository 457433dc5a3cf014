"""A Kinect v1 as a source of frames: found, opened, streamed from, and found again after its cable was pulled."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from touchd.errors import DeviceLost, DeviceNotFound, SourceError
from touchd.geometry import kinect_v1_sensor
from touchd.model import Frame, Intrinsics, Sensor, State
from touchd.sources.kinect.camera import CameraSettings, KinectCamera
from touchd.sources.kinect.commands import Led
from touchd.sources.kinect.devices import KinectDevice, UsbPresence, choose, look_at_usb
from touchd.sources.kinect.losses import LossWatch
from touchd.sources.kinect.packets import DepthPacketFrame, PacketAssembler, PacketCounts, frames_missed, last_end
from touchd.sources.kinect.stream import LibusbStream, OpenStream

log = logging.getLogger(__name__)

_PUMP_S = 0.05
_FRAME_NS = 33_366_667
_LOST_AFTER_NS = 1_000_000_000  # without a frame
_FIRST_FRAME_NS = 3_000_000_000  # the projector takes its time
# Where more time than this passes between two looks at the stream, it was we who did not look.
_LONGEST_SILENCE_NS = 100_000_000
_ACCELERATION_NS = 1_000_000_000
_LOOK_PAUSE_S = 0.5  # where there is no camera: looking costs little, and whoever plugs one in waits
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.25, 2.0  # where there is one that does not work
_SIBLING_PAUSE_S = 1.0  # the parts of a Kinect that was just plugged in appear one after the other
_LOYAL_NS = 10_000_000_000
_LED_OF = {State.TRACKING: Led.GREEN, State.CALIBRATING: Led.GREEN_BLINKING, State.NO_FRAMES: Led.RED}


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the source needs of the world; tests give it a virtual Kinect and that one's own clock."""

    look: Callable[[], UsbPresence] = look_at_usb
    open_stream: OpenStream = LibusbStream
    now_ns: Callable[[], int] = time.monotonic_ns
    pause: Callable[[float], object] | None = None  # None: wait, and between two tries not longer than until closed


class KinectSource:
    """Yields frames for as long as there is a camera, and looks for it where there is none.

    All USB work is done on the thread that iterates :meth:`frames`. Until a camera was opened ``sensor`` is that of
    any Kinect, and ``identified`` is false; another camera than before is another sensor.
    """

    def __init__(
        self,
        wanted: str | None,
        preferred: str | None,
        settings: CameraSettings,
        intrinsics: Intrinsics | None = None,
        surroundings: Surroundings | None = None,
    ) -> None:
        """``wanted``: a serial number or USB path, None for any camera, but ``preferred`` if it is there.

        ``intrinsics``: in place of the usual ones.
        """
        self._wanted = wanted
        self._preferred = preferred
        self._settings = settings
        self._intrinsics = intrinsics
        self._world = surroundings or Surroundings()
        self._sensor = kinect_v1_sensor(intrinsics=intrinsics)
        self._closed = threading.Event()
        self._waiting: str | None = "looking for a Kinect"
        self._reconnects = 0
        self._absent = True
        self._missed_since_ns: int | None = None
        self._index = -1
        self._t_ns = 0
        self._ticks: int | None = None
        self._state: State | None = None
        self._losses: LossWatch | None = None
        self.counts = PacketCounts()

    @property
    def sensor(self) -> Sensor:
        """The camera in use, or the one that was."""
        return self._sensor

    @property
    def identified(self) -> bool:
        """Whether ``sensor`` is that of a camera that was opened."""
        return self._sensor.serial != ""

    @property
    def name(self) -> str:
        """The camera by its serial number or place once it is known."""
        return f"Kinect {self._sensor.serial or self._wanted or ''}".rstrip()

    @property
    def waiting(self) -> str | None:
        """Why there are no frames, None while they flow."""
        return self._waiting

    @property
    def reconnects(self) -> int:
        """How often the camera was lost and found again."""
        return self._reconnects

    @property
    def packet_loss(self) -> float | None:
        """Which share of the packets was lost in the last 10 s; None as long as that is not known."""
        losses = self._losses  # read once: the capture thread may let go of it meanwhile
        return None if losses is None else losses.share

    def show(self, state: State) -> None:
        """Let the camera's LED tell how the daemon fares. May be called from any thread."""
        self._state = state

    def close(self) -> None:
        """Make :meth:`frames` end soon. May be called from any thread."""
        self._closed.set()

    def frames(self) -> Iterator[Frame]:
        """Yield frames until closed, whatever happens to the camera meanwhile."""
        pause_s = _FIRST_PAUSE_S
        while not self._closed.is_set():
            before = self._index
            try:
                yield from self._frames_of_a_camera()
            except DeviceNotFound as error:
                self._absent = True
                self._tell(str(error))
                self._pause(_LOOK_PAUSE_S)
            except SourceError as error:
                self._tell(str(error))
                pause_s = _FIRST_PAUSE_S if self._index > before else min(2.0 * pause_s, _LONGEST_PAUSE_S)
                self._pause(pause_s)

    def _frames_of_a_camera(self) -> Iterator[Frame]:
        kinect = self._choose()
        if self._absent:
            self._absent = False
            self._waiting = f"{kinect.name}: opening it"
            log.info("%s: found at %s, opening it", kinect.name, kinect.path)
        camera = KinectCamera(kinect, self._world.open_stream, self._world.pause or time.sleep)
        try:
            self._identify(camera)
            yield from self._stream(camera)
            camera.show(Led.OFF)
        except SourceError as error:
            # Before closing, which takes its time: touches end as soon as it is known that frames do.
            self._tell(str(error))
            camera.show(Led.RED)
            raise
        finally:
            self._ticks = self._losses = None
            camera.close()

    def _choose(self) -> KinectDevice:
        """Return the camera to open."""
        preferred = self._sensor.serial or self._preferred
        presence = self._world.look()
        self._be_loyal(presence, preferred)
        kinect = choose(presence, self._wanted, preferred)
        if kinect.identity != kinect.path or kinect.path in {self._wanted, preferred} or kinect.forbidden:
            return kinect
        self._pause(_SIBLING_PAUSE_S)
        return choose(self._world.look(), self._wanted, preferred)

    def _be_loyal(self, presence: UsbPresence, preferred: str | None) -> None:
        """Wait for the camera that was in use for a while before another one is taken. Raises DeviceNotFound."""
        there = any(kinect.answers_to(preferred) for kinect in presence.kinects if preferred)
        if self._wanted or not preferred or there or not presence.kinects:
            self._missed_since_ns = None
            return
        if self._missed_since_ns is None:
            self._missed_since_ns = self._world.now_ns()
        if self._world.now_ns() - self._missed_since_ns < _LOYAL_NS:
            raise DeviceNotFound(
                f"Kinect {preferred}, which the surface was learned with, is not plugged in: plug it in, else "
                f"{presence.kinects[0].name} takes its place after {_LOYAL_NS / 1e9:.0f} s"
            )

    def _identify(self, camera: KinectCamera) -> None:
        found = camera.constants()
        for doubt in found.doubts:
            log.warning("%s", doubt)
        sensor = kinect_v1_sensor(found.zero_plane, self._intrinsics, camera.identity)
        if not self.identified or not _same(sensor, self._sensor):
            self._sensor = sensor

    def _stream(self, camera: KinectCamera) -> Iterator[Frame]:
        finished: deque[DepthPacketFrame] = deque()
        assembler = PacketAssembler()
        self.counts = assembler.counts

        def take(transfer: memoryview, lengths: Sequence[int], stride: int) -> int | None:
            finished.extend(assembler.feed_transfer(transfer, lengths, stride))
            return last_end(transfer, lengths, stride)

        stream = camera.start(self._settings, take)
        last_ns = self._world.now_ns()
        patience_ns, silent_ns = _FIRST_FRAME_NS, 0
        losses = self._losses = LossWatch(camera.name, last_ns)
        tending = _Tending(camera)
        while not self._closed.is_set():
            stream.pump(_PUMP_S)
            now_ns = self._world.now_ns()
            silent_ns += min(now_ns - last_ns, _LONGEST_SILENCE_NS)
            last_ns = now_ns
            while finished:
                patience_ns, silent_ns = _LOST_AFTER_NS, 0
                self._streaming(camera)
                # Several at once have waited for us: they were taken one after the other.
                t_ns = now_ns - (len(finished) - 1) * _FRAME_NS
                yield self._frame(finished.popleft(), t_ns, tending.acceleration_g, losses)
            if silent_ns >= patience_ns:
                raise DeviceLost(
                    f"{camera.name}: no frame came for {patience_ns / 1e9:.0f} s: check its cable and power supply"
                )
            tending.look(self._state, now_ns)

    def _frame(
        self,
        finished: DepthPacketFrame,
        t_ns: int,
        acceleration_g: tuple[float, float, float] | None,
        losses: LossWatch,
    ) -> Frame:
        missed = 0
        if finished.ticks:  # 0 where nothing but the start came, which has no time
            missed = 0 if self._ticks is None else frames_missed(self._ticks, finished.ticks)
            self._ticks = finished.ticks
        self._index += 1 + missed
        self._t_ns = max(t_ns, self._t_ns + 1)
        losses.note(missed, len(finished.missing), t_ns)
        return Frame(self._index, self._t_ns, finished.raw, len(finished.missing), acceleration_g)

    def _streaming(self, camera: KinectCamera) -> None:
        if self._waiting is None:
            return
        self._waiting = None
        self._reconnects += self._index >= 0
        log.info("%s: streaming", camera.name)

    def _tell(self, why: str) -> None:
        """Say why there are no frames, once for each change."""
        if why != self._waiting:
            log.warning("%s", why)
        self._waiting = why

    def _pause(self, seconds: float) -> None:
        (self._world.pause or self._closed.wait)(seconds)


class _Tending:
    """The LED and the accelerometer of a streaming camera, looked after now and then."""

    def __init__(self, camera: KinectCamera) -> None:
        self._camera = camera
        self._shown: Led | None = None
        self._asked_ns: int | None = None
        self.acceleration_g: tuple[float, float, float] | None = None  # as measured last

    def look(self, state: State | None, now_ns: int) -> None:
        """Do what is due for a daemon in this state."""
        led = Led.GREEN_BLINKING if state is None else _LED_OF.get(state, Led.YELLOW)
        if led is not self._shown:
            self._shown = led
            self._camera.show(led)
        if self._asked_ns is None or now_ns - self._asked_ns >= _ACCELERATION_NS:
            self._asked_ns = now_ns
            self.acceleration_g = self._camera.acceleration_g()


def _same(a: Sensor, b: Sensor) -> bool:
    """Return whether two sensors are the same camera with the same constants."""
    plain = replace(a, to_mm=b.to_mm, step_mm=b.step_mm)
    return plain == b and a.to_mm.tobytes() == b.to_mm.tobytes() and a.step_mm.tobytes() == b.step_mm.tobytes()
