"""`touchd bench`: this machine against the design's time budgets, with rendered hands and a real socket."""

import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import cycle, islice, product

import cv2
import numpy as np

from touchd.lab.bench_destinations import bench_destinations
from touchd.model import AreaCorners, Frame
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.crowd import contact_scene
from touchd.table.scene import Area, TableCamera, area_corners_px
from touchd.table.table import Table
from touchd.tracking.settings import TrackingSettings
from touchd.tracking.tracker import Tracker

CONTACTS = (0, 1, 10, 30)
METHODS = ("shell", "fingertip")
# From docs/design.md, in ms by method and contacts: the median of step() in a hot loop, and paced.
STEP_HOT_MS = {("shell", 10): 0.8}
STEP_PACED_MS = {("shell", 10): 1.2, ("fingertip", 1): 1.5, ("fingertip", 10): 3.0}
# A frame to the datagram, paced, with one contact: median and 99th percentile.
DATAGRAM_MS, DATAGRAM_P99_MS = 3.0, 5.0
CALIBRATING_MS = 15.0

_PERIOD_NS = 33_333_333
_CALIBRATION_FRAMES = 60
_PICTURES = 30
_HOT_FRAMES = 600
_AREA = Area(centre_mm=(0.0, 0.0), size_mm=(600.0, 420.0))
_CAMERA = TableCamera(height_mm=820.0, tilt_deg=5.0)


@dataclass(slots=True)
class Times:
    """Durations in ns, by what took them."""

    taken: dict[str, list[int]] = field(default_factory=dict)
    found: list[int] = field(default_factory=list)  # touches in each frame

    def add(self, name: str, since_ns: int) -> int:
        """Note the time since ``since_ns`` under a name; return the time now."""
        now_ns = time.perf_counter_ns()
        self.taken.setdefault(name, []).append(now_ns - since_ns)
        return now_ns

    def percentiles_ms(self, name: str) -> tuple[float, float]:
        """Return median and 99th percentile in ms."""
        median, p99 = np.percentile(np.array(self.taken[name]) / 1e6, [50, 99])
        return float(median), float(p99)

    @property
    def found_typically(self) -> int:
        """The median number of touches in a frame."""
        return int(np.median(self.found))


@dataclass(frozen=True, slots=True)
class Scene:
    """A calibrated pipeline and pictures with a number of touching fingers for it."""

    contacts: int
    method: str
    settings: PipelineSettings
    pipeline: Pipeline
    frames: list[Frame]
    calibrating: Times


def make_scene(contacts: int, method: str) -> Scene:
    """Render the pictures and calibrate on an empty table."""
    table = Table(_CAMERA, seed=contacts)
    corners = [(float(u), float(v)) for u, v in area_corners_px(_CAMERA, _AREA)]
    settings = PipelineSettings(
        calibration=CalibrationSettings(frames=_CALIBRATION_FRAMES),
        method=method,
        area=AreaCorners((corners[0], corners[1], corners[2], corners[3]), _AREA.size_mm),
    )
    pipeline = Pipeline(table.sensor, settings, "bench")
    pipeline.calibrate()
    calibrating = Times()
    for index in range(_CALIBRATION_FRAMES):
        frame = table.render([], index * _PERIOD_NS, index)
        begun_ns = time.perf_counter_ns()
        pipeline.step(frame)
        calibrating.add("calibrating frame", begun_ns)
    hands = contact_scene(contacts, _AREA)
    first = _CALIBRATION_FRAMES
    frames = [table.render(hands, index * _PERIOD_NS, index) for index in range(first, first + _PICTURES)]
    return Scene(contacts, method, settings, pipeline, frames, calibrating)


def endless(frames: Sequence[Frame]) -> Iterator[Frame]:
    """Yield the frames over and over, with numbers and times that go on."""
    for lap, frame in enumerate(cycle(frames)):
        yield Frame(index=frames[0].index + lap, t_ns=frames[0].t_ns + lap * _PERIOD_NS, raw=frame.raw)


def time_frames(scene: Scene, frames: Iterator[Frame], output: TuioUdpOutput) -> Times:
    """Time step(), step() with sending, and what waits until then, frame by frame; and what was found."""
    times = Times()
    for frame in frames:
        begun_ns = time.perf_counter_ns()
        result = scene.pipeline.step(frame)
        stepped_ns = times.add("step", begun_ns)
        output.publish(result, begun_ns)
        times.add("send", stepped_ns)
        sent_ns = times.add("frame to datagram", begun_ns)
        scene.pipeline.settle()
        times.add("settle", sent_ns)
        times.found.append(len(result.cursors))
    return times


def time_stages(scene: Scene, frames: Iterator[Frame]) -> Times:
    """Time the stages one by one, in the order in which step() calls them."""
    ready = scene.pipeline.ready
    if ready is None:
        raise ValueError("the scene's pipeline has no surface")
    tracker = Tracker(TrackingSettings(), ready.area.size_mm)
    times = Times()
    for frame in frames:
        begun_ns = time.perf_counter_ns()
        seen = ready.method.find(frame.raw, tracker.expected_mm(frame.t_ns))
        found_ns = times.add("contacts", begun_ns)
        tracker.step(seen.contacts, frame.t_ns, seen.lifted_mm, unseen=seen.unseen)
        times.add("track", found_ns)
    return times


class Metronome:
    """Yields frames at 30 Hz and notes how late the machine woke us each time: its own stalls."""

    def __init__(self) -> None:
        self.times = Times()

    def paced(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        """Yield each frame when it is due."""
        due_ns = time.monotonic_ns()
        for frame in frames:
            due_ns = max(due_ns + _PERIOD_NS, time.monotonic_ns())
            time.sleep(max(0.0, (due_ns - time.monotonic_ns()) / 1e9))
            self.times.taken.setdefault("late", []).append(max(0, time.monotonic_ns() - due_ns))
            yield frame


@contextmanager
def loopback_output() -> Iterator[TuioUdpOutput]:
    """Yield a TUIO output to a socket of our own that nobody reads: its kernel buffer fills up and then drops."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        sender = UdpSender([f"127.0.0.1:{receiver.getsockname()[1]}"])
        output = TuioUdpOutput(TuioEncoder("touchd-bench@127.0.0.1", 0, 1), sender)
        output.start()
        yield output
        output.close()


def bench(seconds: float) -> Iterator[str]:
    """Yield the lines of the table; each paced run lasts ``seconds``."""
    cv2.setNumThreads(1)
    yield "contacts  found  in ms                 hot: median     p99   paced: median     p99"
    metronome = Metronome()
    verdicts: list[str] = []
    for method, contacts in product(METHODS, CONTACTS):
        scene = make_scene(contacts, method)
        with loopback_output() as output:
            yield from _bench_scene(scene, output, seconds, metronome, verdicts)
    scene = make_scene(1, PipelineSettings().method)
    frames_a_run = max(2, round(seconds * 1e9 / _PERIOD_NS) // 2)
    yield from bench_destinations(scene.pipeline, endless(scene.frames), metronome.paced, frames_a_run)
    late = metronome.times
    median, p99 = late.percentiles_ms("late")
    worst = max(late.taken["late"]) / 1e6
    yield f"this machine wakes a sleeping thread {median:.2f} ms late (median), {p99:.2f} (p99), {worst:.2f} (worst)"
    yield from verdicts


def _bench_scene(
    scene: Scene, output: TuioUdpOutput, seconds: float, metronome: Metronome, verdicts: list[str]
) -> Iterator[str]:
    paced_frames = max(2, round(seconds * 1e9 / _PERIOD_NS))
    yield f"{scene.method}:"
    frames = endless(scene.frames)
    hot = time_frames(scene, islice(frames, _HOT_FRAMES), output)
    hot_stages = time_stages(scene, islice(frames, _HOT_FRAMES))
    paced = time_frames(scene, metronome.paced(islice(frames, paced_frames)), output)
    paced_stages = time_stages(scene, metronome.paced(islice(frames, paced_frames)))
    for name, cold, warm in (
        *((stage, paced_stages, hot_stages) for stage in ("contacts", "track")),
        ("step", paced, hot),
        ("send", paced, hot),
        ("frame to datagram", paced, hot),
        ("settle", paced, hot),
    ):
        row = f"{scene.contacts:8d}  {paced.found_typically:5d}  {name:20s}"
        for median, p99 in (warm.percentiles_ms(name), cold.percentiles_ms(name)):
            row += f"{median:12.3f} {p99:7.3f}"
        yield row
    verdicts += _verdicts(scene, hot, paced)


def _verdicts(scene: Scene, hot: Times, paced: Times) -> list[str]:
    lines = []
    key = scene.method, scene.contacts
    what = f"step(), {scene.method}, {{}}, {scene.contacts} contacts, median"
    if scene.contacts == 0:
        lines.append(
            verdict("a calibrating frame", scene.calibrating.percentiles_ms("calibrating frame")[0], CALIBRATING_MS)
        )
    if scene.contacts == 1:
        median, p99 = paced.percentiles_ms("frame to datagram")
        lines.append(verdict(f"frame to datagram, {scene.method}, paced, 1 contact, median", median, DATAGRAM_MS))
        lines.append(verdict(f"frame to datagram, {scene.method}, paced, 1 contact, p99", p99, DATAGRAM_P99_MS))
    if key in STEP_HOT_MS:
        lines.append(verdict(what.format("hot"), hot.percentiles_ms("step")[0], STEP_HOT_MS[key]))
    if key in STEP_PACED_MS:
        lines.append(verdict(what.format("paced"), paced.percentiles_ms("step")[0], STEP_PACED_MS[key]))
    return lines


def verdict(what: str, found_ms: float, budget_ms: float) -> str:
    """Return whether a duration is within its budget."""
    word = "within" if found_ms <= budget_ms else "OVER"
    return f"{word} budget: {what}: {found_ms:.2f} ms of {budget_ms:.1f} ms"
