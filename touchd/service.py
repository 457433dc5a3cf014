"""`touchd run` as a service: opens what the config names, runs the daemon, and keeps its state while it runs."""

import logging
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2

from touchd.assemble import highest_fseq, instance_of, make_outputs, open_source, pipeline_settings
from touchd.config.schema import Config
from touchd.daemon import Daemon, wait_for_signals
from touchd.errors import StateError
from touchd.model import State, Surface, TouchFrame
from touchd.outputs.output import Output
from touchd.pipeline import MissingArea, Pipeline
from touchd.state import FSEQ_FILE, SURFACE_FILE, FseqStore, Lock, load_surface, save_surface, state_folder

log = logging.getLogger(__name__)

# The stored frame number is kept this far ahead of the one in use: about an hour at 30 Hz.
_FSEQ_AHEAD = 100_000


class Announcer:
    """Says each change of state once, in the log."""

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self._state: State | None = None

    def __call__(self, frame: TouchFrame) -> None:
        """Look at a frame; called on the worker thread."""
        if frame.state is self._state:
            return
        why = f" ({frame.why})" if frame.why else ""
        log.info("state: %s%s", frame.state.value, why)
        if frame.state is State.TRACKING and self._state in (State.CALIBRATING, None):
            for line in describe_surface(self._pipeline):
                log.info("%s", line)
        self._state = frame.state


def describe_surface(pipeline: Pipeline) -> list[str]:
    """Return what a user should know about the surface in force."""
    report = pipeline.report
    return [*(report.lines() if report else ()), *pipeline.notes]


@dataclass(slots=True)
class Keeper:
    """Keeps surface and frame number in the state folder; a folder that cannot be written stops nothing."""

    folder: Path
    pipeline: Pipeline
    outputs: list[Output]
    stored_surface: Surface | None
    kept_fseq: int = 0

    def look(self) -> None:
        """Store what is new. Called on the main thread a few times a second."""
        surface = self.pipeline.surface
        if surface is not None and surface is not self.stored_surface:
            self.stored_surface = surface
            self._try(lambda: save_surface(self.folder / SURFACE_FILE, surface), "the surface is not kept")
        if highest_fseq(self.outputs) > self.kept_fseq - _FSEQ_AHEAD // 2:
            self.keep_fseq(highest_fseq(self.outputs) + _FSEQ_AHEAD)

    def keep_fseq(self, fseq: int) -> None:
        """Store a frame number."""
        self.kept_fseq = fseq
        self._try(lambda: FseqStore(self.folder / FSEQ_FILE).keep(fseq), "the TUIO frame number is not kept")

    def _try(self, write: Callable[[], None], otherwise: str) -> None:
        try:
            write()
        except StateError as error:
            log.warning("%s: %s", otherwise, error)


def run(config: Config) -> None:
    """Run until a signal says stop; the signals must be blocked already. Raises TouchdError."""
    cv2.setNumThreads(1)
    folder = state_folder(os.environ)
    lock = Lock(folder)
    try:
        _run_in(folder, config)
    finally:
        lock.release()


def _run_in(folder: Path, config: Config) -> None:
    opened = open_source(config)
    for note in opened.notes:
        log.info("%s: %s", opened.source.name, note)
    settings = pipeline_settings(config, opened.calibration_frames, MissingArea.FLAT_REGION)
    pipeline = Pipeline(opened.source.sensor, settings, opened.source.name)
    _begin_with_surface(folder, config, pipeline)
    outputs = make_outputs(config, instance_of(folder), FseqStore(folder / FSEQ_FILE).load())
    keeper = Keeper(folder, pipeline, outputs, pipeline.surface)
    daemon = Daemon(opened.source, pipeline, outputs, settings.tracking.stall_ms, Announcer(pipeline))
    log.info("playing %s", opened.source.name)
    daemon.start()
    try:
        wait_for_signals(daemon, keeper.look)
    finally:
        error = daemon.stop()
        keeper.keep_fseq(highest_fseq(outputs))
        log.info("stopped, %d frames dropped", daemon.metrics().dropped)
    if error is not None:
        raise error


def _begin_with_surface(folder: Path, config: Config, pipeline: Pipeline) -> None:
    """Use the stored surface, or begin a calibration, as ``calibration.on_start`` says."""
    path = folder / SURFACE_FILE
    if config.calibration.on_start != "always" and path.exists():
        try:
            pipeline.use(load_surface(path, pipeline.sensor, pipeline.made_from))
        except StateError as error:
            log.warning("%s", error)
        else:
            log.info("using the surface in %s", path)
            return
    if config.calibration.on_start != "never":
        pipeline.calibrate()
