"""`touchd replay`: a recording through the core in lock step; every frame, none dropped, the same result each time."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import cv2

from touchd.assemble import OutputMaker, frames_to_calibrate, pipeline_settings
from touchd.config.schema import Config
from touchd.formats.recording import Recording, open_recording
from touchd.model import State, TouchFrame
from touchd.outputs.events import EventWriter
from touchd.outputs.output import Output
from touchd.pipeline import Pipeline
from touchd.ready import MissingArea
from touchd.state import load_surface

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """What to replay and where to; ``speed`` is in times the recording's clock, None for as fast as possible."""

    path: Path
    events: Path | None
    surface: Path | None
    speed: float | None
    send: bool


def replay_recording(config: Config, options: ReplayOptions, on_touch: Say, on_note: Say) -> None:
    """Replay a recording. Touches are told to ``on_touch`` as they come and go, all else to ``on_note``.

    Raises RecordingError, StateError (the surface file) and OutputError (the events file).
    """
    cv2.setNumThreads(1)
    recording = open_recording(options.path)
    for note in recording.notes:
        on_note(note)
    pipeline = _pipeline(config, recording, options.surface, on_note)
    summary = Summary(on_touch)
    described = False
    with ExitStack() as open_files:
        events = open_files.enter_context(EventWriter(options.events)) if options.events else None
        outputs = OutputMaker(f"replay{os.getpid()}", stored_fseq=0).outputs(config) if options.send else []
        frames = play(recording, pipeline, config.tracking.stall_ms, options.speed)
        for frame in sent(frames, outputs, events):
            if frame.state is State.TRACKING and not described:
                described = True
                for line in pipeline.ready.lines() if pipeline.ready else ():
                    on_note(line)
            summary.add(frame)
    if not described:
        on_note(
            f"the recording ended during calibration: it has {len(recording)} depth frames, calibration.frames is "
            f"{config.calibration.frames}"
        )
    on_note(f"{summary.frames} frames, {summary.touches} touches")


def _pipeline(config: Config, recording: Recording, surface: Path | None, on_note: Say) -> Pipeline:
    sensor = replace(recording.sensor, intrinsics=config.intrinsics(recording.sensor.intrinsics))
    frames, note = frames_to_calibrate(config, len(recording))
    settings = pipeline_settings(config, frames, MissingArea.WHOLE_PICTURE)
    pipeline = Pipeline(sensor, settings, str(recording.path))
    if surface is not None:
        pipeline.use(load_surface(surface, sensor))
        return pipeline
    if note:
        on_note(note)
    pipeline.calibrate()
    return pipeline


def play(recording: Recording, pipeline: Pipeline, stall_ms: float, speed: float | None) -> Iterator[TouchFrame]:
    """Yield what the pipeline says of each frame, in order.

    Where the recording itself pauses for longer than ``stall_ms``, a frame with state ``no-frames`` comes between.
    """
    begun_s = time.monotonic()
    stall_ns = int(stall_ms * 1e6)
    last_ns = 0
    for index, t_ns in enumerate(recording.times_ns):
        if t_ns - last_ns > stall_ns:
            _wait(begun_s, last_ns + stall_ns, speed)
            yield pipeline.stall(last_ns + stall_ns)
        _wait(begun_s, t_ns, speed)
        yield pipeline.step(recording.read(index))
        last_ns = t_ns


def _wait(begun_s: float, t_ns: int, speed: float | None) -> None:
    if speed is not None:
        time.sleep(max(0.0, begun_s + t_ns / 1e9 / speed - time.monotonic()))


def sent(frames: Iterator[TouchFrame], outputs: Sequence[Output], events: EventWriter | None) -> Iterator[TouchFrame]:
    """Yield frames after passing them on. Outputs are started first and closed last, whatever happens between.

    The events file gets one line a depth frame, so none for a stall between two of them.
    """
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


class Summary:
    """Counts frames and touches, and says which touches begin and end."""

    def __init__(self, say: Say) -> None:
        self.frames = 0
        self.touches = 0
        self._say = say
        self._since: dict[int, float] = {}

    def add(self, frame: TouchFrame) -> None:
        """Count one frame."""
        self.frames += frame.state is not State.NO_FRAMES
        seconds = frame.t_ns / 1e9
        alive = {cursor.session_id: cursor for cursor in frame.cursors}
        for session_id in sorted(self._since.keys() - alive.keys()):
            self._say(f"{seconds:8.3f} s  touch {session_id} up after {seconds - self._since.pop(session_id):.3f} s")
        for session_id, cursor in alive.items():
            if session_id not in self._since:
                self.touches += 1
                self._since[session_id] = seconds
                self._say(f"{seconds:8.3f} s  touch {session_id} down at ({cursor.x:.3f}, {cursor.y:.3f})")
