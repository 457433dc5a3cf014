"""A daemon with its config, its state folder and those who ask things of it."""

import logging
import queue
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from touchd.align.alignment import Alignment, AreaOrigin, KeptAlignment, area_in_force, eye_in_force
from touchd.assemble import OpenedSource, OutputMaker, latest_fseq, open_source, pipeline_settings
from touchd.claims import DestinationClaims
from touchd.config.load import load_config
from touchd.config.reload import Changes, changes
from touchd.config.schema import Config
from touchd.config.watch import ConfigWatch
from touchd.contacts.aim import EyeOffsets
from touchd.daemon import Daemon
from touchd.errors import CalibrationError, ExitCode, TouchdError
from touchd.geometry import whole_picture
from touchd.keeper import Keeper
from touchd.memory import give_back
from touchd.model import TouchFrame
from touchd.pipeline import Pipeline
from touchd.ready import MissingArea, PipelineSettings, Ready, prepare
from touchd.sources.source import Source
from touchd.state import instance_of
from touchd.watcher import Complaints, Seen, Watcher

log = logging.getLogger(__name__)

T = TypeVar("T")


class Stopping(TouchdError):
    """The daemon is on its way out and takes no more requests."""

    exit_code = ExitCode.TRY_AGAIN


class Service:
    """One daemon with its config, its state folder, and those who ask things of it.

    Its methods run on the main thread, but for :meth:`on_main_thread`, which others use to have something done there.
    """

    def __init__(self, config_path: Path | None, folder: Path) -> None:
        """Open the source and the outputs; nothing runs yet. Raises TouchdError."""
        self._watch = ConfigWatch(config_path) if config_path else None
        self._path = config_path
        self._config = load_config(config_path)
        self._problem: str | None = None
        self._problem_since_s: float | None = None
        self._aligning = False
        self._closed = False
        self._asked: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._adoption: Callable[[], None] | None = None  # what puts in force the settings that were asked for last
        self._adopted: Callable[[], None] | None = None
        self._keeper = Keeper(folder)
        self._watcher = Watcher()
        self._complaints = Complaints()
        self._claims = DestinationClaims()
        self._maker = OutputMaker(instance_of(folder), self._keeper.stored_fseq())
        self._opened = self._open(self._config)
        source = self._opened.source
        self._alignment = self._alignment_of(source)
        self._settings = self._settings_of(self._config)
        self._met = source.sensor  # the camera that the pipeline is for, or will be once the worker takes it up
        self._daemon = Daemon(
            source,
            Pipeline(self._met, self._settings, source.name),
            self._maker.outputs(self._config),
            self._config.tracking.stall_ms,
            self._watcher,
        )

    @property
    def daemon(self) -> Daemon:
        """What runs."""
        return self._daemon

    @property
    def config(self) -> Config:
        """The config in force."""
        return self._config

    @property
    def problem(self) -> str | None:
        """Why the config file as it is now was not used; None if it is in force."""
        return self._problem

    @property
    def config_path(self) -> Path | None:
        """The config file, None for the defaults."""
        return self._path

    @property
    def problem_since_s(self) -> float | None:
        """Since when the config file is not in force, in Unix time."""
        return self._problem_since_s

    @property
    def not_kept(self) -> str | None:
        """Why something could not be stored in the state folder, None if all is well."""
        return self._keeper.problem

    @property
    def surface_since_s(self) -> float | None:
        """When the surface in force was learned, in Unix time."""
        return self._keeper.surface_since_s

    @property
    def seen(self) -> Seen:
        """What the last frame told."""
        return self._watcher.seen

    @property
    def area_origin(self) -> AreaOrigin:
        """Where the area in force comes from."""
        return self._area_origin

    @property
    def alignment_residual_mm(self) -> float | None:
        """How well the touched points of the alignment in force agree, None if another area is in force."""
        if self._area_origin is not AreaOrigin.ALIGNMENT or self._alignment is None:
            return None
        return self._alignment.alignment.residual_mm

    @property
    def eye(self) -> EyeOffsets | None:
        """How far ahead of their touch people aim, None where touches are told where they are."""
        return self._settings.eye

    def start(self) -> None:
        """Begin with the stored surface or a calibration, as ``calibration.on_start`` says, and run."""
        if self._daemon.source.identified:
            self._begin_with_surface(self._daemon.pipeline, self._config)
        self._daemon.start()
        self._warn_of_shared_destinations()

    def stop(self) -> None:
        """End every touch and stop. Raises what a thread of the daemon ended with."""
        error = self._daemon.stop()
        self._claims.release()
        self._keeper.keep_fseq(latest_fseq(self._daemon.outputs))
        metrics = self._daemon.metrics()
        log.info("stopped after %d frames, %d dropped", metrics.frames, metrics.dropped)
        if error is not None:
            raise error

    def look(self) -> None:
        """Do what is due a few times a second: what was asked, edits of the config file, state to keep."""
        while not self._asked.empty():
            self._asked.get()()
        if self._watch is not None and self._watch.changed():
            self.reload_and_log()
        if self._opened.source.sensor is not self._met:
            self._meet_camera()
        self._keeper.look(self._daemon)
        self._complaints.look(self._daemon.outputs)

    def on_main_thread(self, job: Callable[[], T]) -> T:
        """Have a job done by the next :meth:`look` and return its result, from any other thread."""
        future: Future[T] = Future()

        def do() -> None:
            try:
                future.set_result(job())
            except TouchdError as error:
                future.set_exception(error)

        if self._closed:
            raise Stopping("touchd is stopping")
        self._asked.put(do)
        return future.result(timeout=10.0)

    def close_requests(self) -> None:
        """Do what was asked so far, and refuse what others ask from now on: the main thread will not look again."""
        self._closed = True
        while not self._asked.empty():
            self._asked.get()()

    def recalibrate(self) -> None:
        """Learn the surface anew."""
        self._daemon.recalibrate()

    def reload_and_log(self) -> None:
        """Reload; a bad config is said and leaves the running one in force."""
        try:
            log.info("config: %s", self.reload())
        except TouchdError as error:
            log.warning("config: not used, the one from before is in force: %s", error)

    def reload(self) -> str:
        """Put the config file in force as it is now and say what changed.

        Raises TouchdError if it cannot be; the running config stays in force then, and status says why.
        """
        try:
            new = load_config(self._path)
            what = changes(self._config, new)
            self._apply(new, what)
        except TouchdError as error:
            self._problem, self._problem_since_s = str(error), time.time()
            raise
        self._problem = self._problem_since_s = None
        self._config = new
        self._warn_of_shared_destinations()
        return what.sentence()

    def _apply(self, new: Config, what: Changes) -> None:
        # What can fail comes first, so that a config is in force as a whole or not at all.
        opened = self._open(new) if what.source else self._opened
        try:
            outputs = self._maker.outputs(new)
        except TouchdError:
            if opened is not self._opened:
                opened.source.close()
            raise
        if what.source:
            self._opened = opened
            self._settings = self._settings_of(new)
            self._change_source(new)
        elif what.live:
            self._adopt(self._settings_of(new))
        if outputs != list(self._daemon.outputs):
            self._daemon.change_outputs(outputs)
        self._daemon.set_stall(new.tracking.stall_ms)

    def _change_source(self, config: Config) -> None:
        source = self._opened.source
        self._daemon.change_source(source, self._new_pipeline(source, config))

    def _meet_camera(self) -> None:
        """Work with the camera that the source has found, another one than before or the first."""
        source = self._opened.source
        log.info("%s is in use", source.name)
        self._alignment = self._alignment_of(source)
        self._settings = self._settings_of(self._config)
        self._daemon.change_pipeline(self._new_pipeline(source, self._config))

    def _new_pipeline(self, source: Source, config: Config) -> Pipeline:
        self._met = source.sensor
        pipeline = Pipeline(self._met, self._settings, source.name, self._daemon.pipeline.next_session_id)
        if source.identified:
            self._begin_with_surface(pipeline, config)
        return pipeline

    def _alignment_of(self, source: Source) -> KeptAlignment | None:
        return self._keeper.stored_alignment(source.sensor) if source.identified else None

    def _settings_of(self, config: Config) -> PipelineSettings:
        settings = pipeline_settings(config, self._opened.calibration_frames, MissingArea.FLAT_REGION)
        area, self._area_origin = area_in_force(settings.area, self._alignment)
        eye = eye_in_force(settings.eye, self._alignment, self._area_origin)
        if area is None and self._opened.area is not None:
            area, self._area_origin = self._opened.area, AreaOrigin.SOURCE
        return replace(settings, area=area, eye=eye)

    def begin_aligning(self, tap: Callable[[TouchFrame], None]) -> Ready:
        """Give the touches of the whole picture to ``tap``, and none to outputs. Raises CalibrationError."""
        known = self._daemon.pipeline.ready
        if known is None:
            raise CalibrationError("align: there is no surface yet; wait until touchd has calibrated")
        self._aligning = True
        whole = replace(self._settings, area=whole_picture(known.surface.sensor), eye=None)
        ready = prepare(known.surface, whole, known)

        def begin() -> None:
            self._daemon.pipeline.adopt(whole, ready)
            self._daemon.divert(tap)

        self._ask_to_adopt(begin)
        return ready

    def keep_alignment(self, found: Alignment) -> str | None:
        """Have an alignment in force from the end of aligning on; return the file it is kept in, None if it is not."""
        corners = self._config.area_corners()
        self._alignment = KeptAlignment(found, time.time(), None if corners is None else corners.corners_px)
        return self._keeper.keep_alignment(self._alignment, self._daemon.pipeline.sensor)

    def end_aligning(self) -> None:
        """Put the area in force again, the new one if there is one, and give touches to the outputs."""
        self._aligning = False
        self._adopt(self._settings_of(self._config))
        self._daemon.ask(lambda: self._daemon.divert(None))
        give_back()

    def _adopt(self, new: PipelineSettings) -> None:
        """Put settings in force; what takes long is made ready here, the worker only swaps it in."""
        pipeline = self._daemon.pipeline
        if self._aligning:
            self._settings = new
            return
        known = pipeline.ready
        ready = known
        if known is not None and not known.serves(new):
            ready = prepare(known.surface, new, known)
            give_back()

        def swap() -> None:
            current = pipeline.ready
            if current is known or current is None:
                pipeline.adopt(new, ready)
            else:
                pipeline.adopt(new, prepare(current.surface, new, current))

        self._settings = new
        self._ask_to_adopt(swap)

    def _ask_to_adopt(self, adoption: Callable[[], None]) -> None:
        """Have settings put in force by the worker, in place of any that it has not come to yet."""
        self._adoption = adoption
        self._daemon.ask(self._adopt_latest)

    def _adopt_latest(self) -> None:
        adoption = self._adoption
        if adoption is not None and adoption is not self._adopted:
            self._adopted = adoption
            adoption()

    def _warn_of_shared_destinations(self) -> None:
        destinations = [to for item in self._config.outputs if item.tuio is not None for to in item.tuio.to]
        for shared in self._claims.hold(destinations):
            log.warning(
                "another touchd on this computer sends to %s, too, and most clients cannot tell two senders apart: "
                "give each a port of its own",
                shared,
            )

    def _begin_with_surface(self, pipeline: Pipeline, config: Config) -> None:
        surface = None if config.calibration.on_start == "always" else self._keeper.stored_surface(pipeline)
        if surface is not None:
            pipeline.use(surface)
        elif config.calibration.on_start != "never":
            pipeline.calibrate_patiently()

    def _open(self, config: Config) -> OpenedSource:
        opened = open_source(config, self._keeper.remembered_camera())
        for note in opened.notes:
            log.info("%s: %s", opened.source.name, note)
        return opened
