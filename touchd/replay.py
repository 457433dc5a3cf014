"""A recording through the core in lock step: every frame, none dropped, the same result each time."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from touchd.formats.recording import Recording
from touchd.model import State, TouchFrame
from touchd.outputs.events import EventWriter
from touchd.outputs.output import Output
from touchd.pipeline import Pipeline


def frames_to_calibrate(wanted: int, was_set: bool, available: int) -> tuple[int, str | None]:
    """Return on how many first frames to calibrate, and a sentence for the user where that is not ``wanted``.

    A recording with fewer than three times as many frames gives its first third, unless the user set the number.
    """
    if was_set or available >= 3 * wanted:
        return wanted, None
    frames = max(1, available // 3)
    return frames, (
        f"the recording has only {available} depth frames, so the surface is learned from its first {frames} "
        f"(calibration.frames is {wanted} where it is not set)"
    )


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast to replay: ``speed`` times the recording's clock, or as fast as possible if None."""

    speed: float | None

    def wait(self, begun_s: float, t_ns: int) -> None:
        """Sleep until ``t_ns`` of the recording is due."""
        if self.speed is not None:
            due_s = begun_s + t_ns / 1e9 / self.speed
            time.sleep(max(0.0, due_s - time.monotonic()))


def replay(
    recording: Recording, pipeline: Pipeline, stall_ms: float, pace: Pace
) -> Iterator[TouchFrame]:
    """Yield what the pipeline says of each frame, in order; where the recording pauses longer than ``stall_ms``, a
    frame with state ``no-frames`` comes between."""
    begun_s = time.monotonic()
    last_ns = 0
    for index, t_ns in enumerate(recording.times_ns):
        stalled_ns = last_ns + int(stall_ms * 1e6)
        if t_ns > stalled_ns:
            pace.wait(begun_s, stalled_ns)
            yield pipeline.stall(stalled_ns)
        pace.wait(begun_s, t_ns)
        yield pipeline.step(recording.read(index))
        last_ns = t_ns


def send(frames: Iterator[TouchFrame], outputs: Sequence[Output], events: EventWriter | None) -> Iterator[TouchFrame]:
    """Pass frames on to outputs and the events file, and yield them. Outputs are started first and closed last."""
    for output in outputs:
        output.start()
    try:
        for frame in frames:
            for output in outputs:
                output.publish(frame, time.monotonic_ns())
            if events is not None and frame.state is not State.NO_FRAMES:
                events.write(frame)
            yield frame
    finally:
        for output in outputs:
            output.close()


@dataclass(slots=True)
class Summary:
    """What a replay amounted to; feed it every frame with :meth:`add`."""

    say: Callable[[str], None]
    frames: int = 0
    touches: int = 0
    _alive: dict[int, float] | None = None

    def add(self, frame: TouchFrame) -> None:
        """Count a frame, and say which touches began and ended in it."""
        self.frames += frame.state is not State.NO_FRAMES
        alive = self._alive or {}
        seconds = frame.t_ns / 1e9
        now = {c.session_id: alive.get(c.session_id, seconds) for c in frame.cursors}
        for cursor in frame.cursors:
            if cursor.session_id not in alive:
                self.touches += 1
                self.say(f"{seconds:8.3f} s  touch {cursor.session_id} down at ({cursor.x:.3f}, {cursor.y:.3f})")
        for session_id, since in alive.items():
            if session_id not in now:
                self.say(f"{seconds:8.3f} s  touch {session_id} up after {seconds - since:.3f} s")
        self._alive = now
