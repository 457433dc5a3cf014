"""The demo itself: the synthetic table, the real daemon, and a thread that shows what it sees."""

import os
import signal
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TextIO

import cv2

from touchd.assemble import OutputMaker, pipeline_settings
from touchd.config.schema import Config
from touchd.daemon import Daemon
from touchd.demo.terminal import Terminal
from touchd.demo.view import DemoView, draw, last_line, plain_line
from touchd.demo.watching import Relief, WatchedSource
from touchd.errors import UsageError
from touchd.model import TouchFrame
from touchd.outputs.udp import parse_destination
from touchd.pipeline import Pipeline
from touchd.ready import MissingArea
from touchd.run import next_signal
from touchd.sources.synthetic import SyntheticSource
from touchd.table.scenario_names import DEFAULT_SCENARIO

_CALIBRATION_FRAMES = 60
_SPARE_FRAMES = 12  # more of the empty table, in case some come late
_PICTURES_A_SECOND = 15
_LOOK_S = 0.2
_SHOW_END_S = 2.0  # a terminal that takes no text keeps nobody longer than this
_STOPPED_BY = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """What the user may choose: where touches are sent as HOST:PORT, what the hands do, and what is random."""

    to: str = "127.0.0.1:3333"
    scenario: str = DEFAULT_SCENARIO
    seed: int = 1


def demo(options: DemoOptions, stream: TextIO, environment: Mapping[str, str]) -> None:
    """Run until SIGINT, SIGTERM or SIGHUP, which must be blocked already, and end every touch at the client.

    Shows a live picture where ``stream`` is a terminal, else one line a second; reads no config and keeps no state.
    Raises UsageError for options that make no sense, SourceError if the renderer fails, BrokenPipeError if nobody
    reads the stream any more.
    """
    cv2.setNumThreads(1)
    if hasattr(signal, "SIGTSTP"):
        # A stopped process cannot end its touches, and the terminal would stay as it is.
        signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    stage = _Stage(options)
    show = _Show(Terminal(stream, environment), stage.look, stage.daemon.stopping)
    stage.daemon.start()
    show.start()
    try:
        _wait_for_stop(stage.daemon)
    finally:
        error = stage.daemon.stop()
        error = show.end() or error
    if error is not None:
        raise error


def _wait_for_stop(daemon: Daemon) -> None:
    while not daemon.stopping.is_set():
        if next_signal(_STOPPED_BY, _LOOK_S) is not None:
            return


class _Stage:
    """The parts of the demo's daemon, and the view of them."""

    def __init__(self, options: DemoOptions) -> None:
        self._options = options
        config = _config(options)
        table = SyntheticSource(options.scenario, options.seed, _CALIBRATION_FRAMES + _SPARE_FRAMES)
        self._source = WatchedSource(table)
        settings = replace(
            pipeline_settings(config, _CALIBRATION_FRAMES, MissingArea.WHOLE_PICTURE),
            area=table.area,
        )
        self._pipeline = Pipeline(table.sensor, settings, table.name)
        self._pipeline.calibrate()
        self._outputs = OutputMaker(f"demo-{os.getpid()}", 0).outputs(config)
        self._relief = Relief(table.sensor, table.area)
        self._area_mm = table.area_mm
        self._last: TouchFrame | None = None
        self.daemon = Daemon(self._source, self._pipeline, self._outputs, settings.tracking.stall_ms, self._note)

    def _note(self, frame: TouchFrame) -> None:
        self._last = frame

    def look(self) -> DemoView:
        """Return what is to be seen now. May be called from any thread."""
        last, ready = self._last, self._pipeline.ready
        begun = self._source.waiting is None
        return DemoView(
            scenario=self._options.scenario,
            seed=self._options.seed,
            destination=self._options.to,
            state=last.state if last and begun else None,
            why=last.why if last else None,
            metrics=self.daemon.metrics(),
            left_out=self._source.left_out,
            cursors=last.cursors if last else (),
            touches=self._pipeline.next_session_id - 1,
            area_mm=self._area_mm,
            risen=self._relief.risen(self._source.last, ready.surface if ready else None),
            trouble=next((error for output in self._outputs if (error := output.status().last_error)), None),
        )


class _Show(threading.Thread):
    """Draws what there is to see. A thread of its own, so that a terminal that takes no text stops nothing else."""

    def __init__(self, terminal: Terminal, look: Callable[[], DemoView], failed: threading.Event) -> None:
        super().__init__(name="show", daemon=True)
        self._terminal = terminal
        self._look = look
        self._failed = failed
        self._over = threading.Event()
        self._error: BaseException | None = None

    def run(self) -> None:
        """Draw until the end."""
        begun_s = time.monotonic()
        try:
            if self._terminal.is_screen:
                with self._terminal.whole_screen():
                    self._draw_pictures()
            else:
                self._say_lines()
            self._terminal.say(last_line(self._look(), time.monotonic() - begun_s))
        except BaseException as error:  # noqa: BLE001  it must end the demo, with its traceback
            self._error = error
        finally:
            self._failed.set()

    def end(self) -> BaseException | None:
        """Stop drawing, give the terminal back, and return the error that drawing ended with, if any."""
        self._over.set()
        self.join(_SHOW_END_S)
        return self._error

    def _draw_pictures(self) -> None:
        while not self._over.wait(1.0 / _PICTURES_A_SECOND):
            self._terminal.paint(draw(self._look(), self._terminal.size, self._terminal.encoding))

    def _say_lines(self) -> None:
        while not self._over.wait(1.0):
            self._terminal.say(plain_line(self._look()))


def _config(options: DemoOptions) -> Config:
    try:
        parse_destination(options.to)
    except ValueError as error:
        raise UsageError(f"--to: {error}") from error
    return Config.model_validate({"outputs": ({"tuio": {"to": (options.to,)}},)})
