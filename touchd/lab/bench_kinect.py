"""`touchd bench kinect`: a Kinect as it is plugged in, against the budgets for capture and for latency."""

import threading
import time
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
import usb.core

from touchd.daemon import LatestFrame
from touchd.errors import DeviceNotFound
from touchd.lab.bench import DATAGRAM_MS, DATAGRAM_P99_MS, loopback_output, verdict
from touchd.model import Frame
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.sources.kinect.camera import CameraSettings
from touchd.sources.kinect.source import KinectSource, Surroundings
from touchd.sources.kinect.stream import IsoStream, LibusbStream, TakeTransfer
from touchd.surface.settings import CalibrationSettings

CAPTURE_SHARE = 0.12  # of one core, from docs/design.md
_PATIENCE_S = 10.0  # for the first frame
_CALIBRATION_FRAMES = 30
_WARM_FRAMES = 30  # after calibrating: what is used for the first time takes longer
_MICROFRAME_NS = 125_000
_NAP_S = 0.005
_STALL_NS = 20_000_000


class EndTimes:
    """When the last packet of each frame came, and when its transfer was handed over: as a whole, some ms later."""

    def __init__(self) -> None:
        self._handed_over_ns: list[int] = []
        self._came_ns: list[int] = []

    def open_stream(
        self, name: str, device: usb.core.Device, endpoint: int, packet_bytes: int, take: TakeTransfer
    ) -> IsoStream:
        """Open a stream whose packets are looked at on their way to ``take``."""

        def look(transfer: memoryview, lengths: Sequence[int], stride: int) -> int | None:
            now_ns = time.monotonic_ns()
            place = take(transfer, lengths, stride)
            if place is not None:
                self._handed_over_ns.append(now_ns)
                self._came_ns.append(now_ns - (len(lengths) - 1 - place) * _MICROFRAME_NS)
            return place

        return LibusbStream(name, device, endpoint, packet_bytes, look)

    def before(self, t_ns: int) -> tuple[int, int]:
        """Return when the last packet before a time came and was handed over; the time itself where there is none."""
        place = bisect_right(self._handed_over_ns, t_ns)
        return (self._came_ns[place - 1], self._handed_over_ns[place - 1]) if place else (t_ns, t_ns)


@dataclass(slots=True)
class Stalls:
    """How late this machine wakes a thread that naps all the time, in ns."""

    late_ns: list[int] = field(default_factory=list)
    stopped: threading.Event = field(default_factory=threading.Event)

    def watch(self) -> None:
        """Nap until stopped."""
        while not self.stopped.is_set():
            due_ns = time.monotonic_ns() + round(_NAP_S * 1e9)
            time.sleep(_NAP_S)
            self.late_ns.append(max(0, time.monotonic_ns() - due_ns))

    def line(self) -> str:
        """Return what there is to say of them."""
        long = [late for late in self.late_ns if late >= _STALL_NS]
        return (
            f"this machine itself stalled {len(long)} times for {_STALL_NS / 1e6:.0f} ms or more, {sum(long) / 1e6:.0f}"
            f" ms in all, the longest {max(self.late_ns, default=0) / 1e6:.1f} ms"
        )


@dataclass(slots=True)
class Tally:
    """What came while it was measured."""

    frames: int = 0
    missed: int = 0  # frames that never came
    partial: int = 0  # frames with packets missing
    last_index: int | None = None
    steps_ms: list[tuple[float, ...]] = field(default_factory=list)  # of each frame's way, from its last packet on

    def note(self, frame: Frame, ends: EndTimes, sent_ns: int) -> None:
        """Note a frame whose datagram was handed to the kernel."""
        self.missed += 0 if self.last_index is None else frame.index - self.last_index - 1
        self.last_index = frame.index
        self.frames += 1
        self.partial += frame.missing_packets > 0
        came_ns, handed_over_ns = ends.before(frame.t_ns)
        steps_ns = handed_over_ns - came_ns, frame.t_ns - handed_over_ns, sent_ns - frame.t_ns
        self.steps_ms.append(tuple(step / 1e6 for step in steps_ns))

    def lines(self, dropped: int) -> Iterator[str]:
        """Yield what there is to say; ``dropped``: frames that came and were never worked on."""
        yield (
            f"{self.frames} frames worked on; never came: {self.missed - dropped}, with packets missing: "
            f"{self.partial}, dropped as the worker was busy: {dropped}"
        )
        names = "until its transfer was full", "until the frame was whole", "until the datagram was sent"
        medians = np.median(self.steps_ms, axis=0)
        parts = ", ".join(f"{ms:.2f} ms {name}" for name, ms in zip(names, medians, strict=True))
        yield f"after a frame's last packet, in the median: {parts}"
        median, p99 = np.percentile(np.sum(self.steps_ms, axis=1), [50, 99])
        yield verdict("last packet to datagram, median", float(median), DATAGRAM_MS)
        yield verdict("last packet to datagram, p99", float(p99), DATAGRAM_P99_MS)


def bench_kinect(seconds: float, wanted: str | None = None) -> Iterator[str]:
    """Stream, calibrate and track for ``seconds``; yield what was found. ``wanted``: as source.serial in the config.

    Raises DeviceNotFound if no frame comes within 10 s, saying why.
    """
    cv2.setNumThreads(1)
    ends, slot, stalls = EndTimes(), LatestFrame(), Stalls()
    source = KinectSource(wanted, None, CameraSettings(), None, Surroundings(open_stream=ends.open_stream))

    def capture_frames() -> None:
        for frame in source.frames():
            slot.put(frame, frame.t_ns)

    capture = threading.Thread(target=capture_frames, name="capture", daemon=True)
    watch = threading.Thread(target=stalls.watch, name="stalls", daemon=True)
    capture.start()
    try:
        with loopback_output() as output:
            pipeline = _calibrated(source, slot, output)
            yield f"{source.name}: measuring for {seconds:.0f} s"
            watch.start()
            yield from _measure(seconds, pipeline, output, slot, ends, capture)
        yield stalls.line()
    finally:
        stalls.stopped.set()
        source.close()
        capture.join()


def _calibrated(source: KinectSource, slot: LatestFrame, output: TuioUdpOutput) -> Pipeline:
    """Return a pipeline that has learned the surface from the first frames and has worked for a while."""
    taken = slot.take(_PATIENCE_S)
    if taken is None:
        raise DeviceNotFound(f"no frame came within {_PATIENCE_S:.0f} s: {source.waiting}")
    settings = PipelineSettings(calibration=CalibrationSettings(frames=_CALIBRATION_FRAMES))
    pipeline = Pipeline(source.sensor, settings, source.name)
    pipeline.calibrate()
    for _ in range(_CALIBRATION_FRAMES + _WARM_FRAMES):
        output.publish(pipeline.step(_next(slot)), time.monotonic_ns())
        pipeline.settle()
    return pipeline


def _measure(
    seconds: float,
    pipeline: Pipeline,
    output: TuioUdpOutput,
    slot: LatestFrame,
    ends: EndTimes,
    capture: threading.Thread,
) -> Iterator[str]:
    tally, dropped = Tally(), slot.dropped
    clock = time.pthread_getcpuclockid(capture.ident or 0)
    begun_ns, begun_cpu_ns = time.monotonic_ns(), time.clock_gettime_ns(clock)
    while time.monotonic_ns() - begun_ns < seconds * 1e9:
        frame = _next(slot)
        output.publish(pipeline.step(frame), frame.t_ns)
        tally.note(frame, ends, time.monotonic_ns())
        pipeline.settle()
    elapsed_ns = time.monotonic_ns() - begun_ns
    share = (time.clock_gettime_ns(clock) - begun_cpu_ns) / elapsed_ns
    yield from tally.lines(slot.dropped - dropped)
    word = "within" if share <= CAPTURE_SHARE else "OVER"
    yield f"{word} budget: the capture thread: {share:.1%} of one core of {CAPTURE_SHARE:.0%}"


def _next(slot: LatestFrame) -> Frame:
    taken = slot.take(_PATIENCE_S)
    if taken is None:
        raise DeviceNotFound(f"no frame came for {_PATIENCE_S:.0f} s: check the camera's cable and power supply")
    return taken[0]
