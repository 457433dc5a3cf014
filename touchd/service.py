"""`touchd run`: opens what the config names, runs the daemon, reloads, answers to signals and the control socket."""

import logging
import os
import queue
import signal
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import cv2

from touchd.assemble import (
    OpenedSource,
    OutputMaker,
    highest_fseq,
    instance_of,
    open_source,
    pipeline_settings,
)
from touchd.config.load import load_config
from touchd.config.reload import Changes, changes
from touchd.config.schema import Config
from touchd.config.watch import ConfigWatch
from touchd.daemon import Daemon
from touchd.errors import StateNotKept, TouchdError
from touchd.keeper import Keeper
from touchd.notify import Notifier
from touchd.pipeline import MissingArea, Pipeline, PipelineSettings, prepare
from touchd.state import Lock, state_folder
from touchd.watcher import Complaints, Watcher

log = logging.getLogger(__name__)

T = TypeVar("T")
SIGNALS = frozenset({signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGHUP})
_LOOK_S = 0.2


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
        self._asked: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._keeper = Keeper(folder)
        self._watcher = Watcher()
        self._complaints = Complaints()
        self._maker = OutputMaker(instance_of(folder), self._keeper.stored_fseq())
        self._opened = _open(self._config)
        self._settings = self._settings_of(self._config)
        source = self._opened.source
        self._daemon = Daemon(
            source,
            Pipeline(source.sensor, self._settings, source.name),
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

    def start(self) -> None:
        """Begin with the stored surface or a calibration, as ``calibration.on_start`` says, and run."""
        self._begin_with_surface(self._daemon.pipeline, self._config)
        self._daemon.start()

    def stop(self) -> None:
        """End every touch and stop. Raises what a thread of the daemon ended with."""
        error = self._daemon.stop()
        self._keeper.keep_fseq(highest_fseq(self._daemon.outputs))
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

        self._asked.put(do)
        return future.result(timeout=10.0)

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
            self._problem = str(error)
            raise
        self._problem = None
        self._config = new
        return what.sentence()

    def _apply(self, new: Config, what: Changes) -> None:
        # What can fail comes first, so that a config is in force as a whole or not at all.
        opened = _open(new) if what.source else self._opened
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
        pipeline = Pipeline(source.sensor, self._settings, source.name, self._daemon.pipeline.next_session_id)
        self._begin_with_surface(pipeline, config)
        self._daemon.change_source(source, pipeline)

    def _settings_of(self, config: Config) -> PipelineSettings:
        settings = pipeline_settings(config, self._opened.calibration_frames, MissingArea.FLAT_REGION)
        return replace(settings, area=settings.area or self._opened.area)

    def _adopt(self, new: PipelineSettings) -> None:
        """Put settings in force; what takes long is made ready here, the worker only swaps it in."""
        pipeline, old = self._daemon.pipeline, self._settings
        known = pipeline.ready
        same_places = replace(new, tracking=old.tracking, calibration=old.calibration) == old
        ready = known if known is None or same_places else prepare(known.surface, new, known)

        def swap() -> None:
            current = pipeline.ready
            if current is known or current is None:
                pipeline.adopt(new, ready)
            else:
                pipeline.adopt(new, prepare(current.surface, new, current))

        self._settings = new
        self._daemon.ask(swap)

    def _begin_with_surface(self, pipeline: Pipeline, config: Config) -> None:
        surface = None if config.calibration.on_start == "always" else self._keeper.stored_surface(pipeline)
        if surface is not None:
            pipeline.use(surface)
        elif config.calibration.on_start != "never":
            pipeline.calibrate_patiently()


def _open(config: Config) -> OpenedSource:
    opened = open_source(config)
    for note in opened.notes:
        log.info("%s: %s", opened.source.name, note)
    return opened


def run(config_path: Path | None) -> None:
    """Run until a signal says stop; all of ``SIGNALS`` must be blocked already. Raises TouchdError."""
    cv2.setNumThreads(1)
    folder = state_folder(os.environ)
    lock = _lock(folder)
    try:
        service = Service(config_path, folder)
        log.info("source: %s", service.daemon.source.name)
        service.start()
        try:
            _until_stopped(service, Notifier(os.environ))
        finally:
            service.stop()
    finally:
        if lock is not None:
            lock.release()


def _lock(folder: Path) -> Lock | None:
    """Take the state folder for this daemon alone; None where it cannot be written to, which stops no touch."""
    try:
        return Lock(folder)
    except StateNotKept as error:
        log.warning("running without a state folder, so the surface is learned at each start: %s", error)
        return None


def _until_stopped(service: Service, notifier: Notifier) -> None:
    """Serve signals: SIGTERM and SIGINT return, SIGUSR1 recalibrates, SIGHUP reloads."""
    notifier.ready()
    while not service.daemon.stopping.is_set():
        received = signal.sigtimedwait(SIGNALS, _LOOK_S)
        service.look()
        if received is None:
            continue
        name = signal.Signals(received.si_signo).name
        if received.si_signo == signal.SIGUSR1:
            log.info("recalibrating: %s", name)
            service.recalibrate()
        elif received.si_signo == signal.SIGHUP:
            notifier.reloading()
            service.reload_and_log()
            notifier.ready()
        else:
            log.info("stopping: %s", name)
            notifier.stopping()
            return
