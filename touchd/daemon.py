"""The running daemon: a capture thread, a worker thread, and the main thread that waits for signals."""

import logging
import queue
import signal
import threading
import time
from collections.abc import Callable, Sequence

from touchd.errors import SourceError, TouchdError
from touchd.metrics import FrameMetrics, MetricsSnapshot
from touchd.model import Frame, TouchFrame
from touchd.outputs.output import Output
from touchd.pipeline import Pipeline
from touchd.sources.source import Source

log = logging.getLogger(__name__)

# How often the worker looks up when no frames come: often enough for idle messages once a second.
_TICK_S = 0.1
_JOIN_S = 5.0
_LOOK_S = 0.2


class LatestFrame:
    """The slot between capture and worker: one frame deep, the newest wins, the ones it replaced are counted."""

    def __init__(self) -> None:
        self._filled = threading.Condition()
        self._frame: tuple[Frame, int] | None = None
        self._dropped = 0

    @property
    def dropped(self) -> int:
        """How many frames were replaced before anyone took them."""
        return self._dropped

    def put(self, frame: Frame, arrived_ns: int) -> None:
        """Offer a frame and the monotonic time of its arrival; never waits."""
        with self._filled:
            self._dropped += self._frame is not None
            self._frame = frame, arrived_ns
            self._filled.notify()

    def take(self, timeout_s: float) -> tuple[Frame, int] | None:
        """Return the newest frame and when it arrived, waiting for one up to ``timeout_s``; None if none came."""
        with self._filled:
            if self._frame is None:
                self._filled.wait(timeout_s)
            frame, self._frame = self._frame, None
            return frame


class Daemon:
    """Runs a source through the core into outputs until told to stop.

    ``on_frame`` is called on the worker thread with each result. The worker never blocks: outputs only hand over.
    """

    def __init__(
        self,
        source: Source,
        pipeline: Pipeline,
        outputs: Sequence[Output],
        stall_ms: float,
        on_frame: Callable[[TouchFrame], None],
    ) -> None:
        self._source = source
        self._pipeline = pipeline
        self._outputs = outputs
        self._stall_s = stall_ms / 1e3
        self._on_frame = on_frame
        self._slot = LatestFrame()
        self._metrics = FrameMetrics()
        self._at_boundary: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._error: BaseException | None = None
        self._capture = threading.Thread(target=self._guarded, args=(self._capture_frames,), name="capture")
        self._worker = threading.Thread(target=self._guarded, args=(self._work,), name="worker")

    def metrics(self) -> MetricsSnapshot:
        """Return how fast frames come and are worked on. May be called from any thread."""
        return self._metrics.snapshot(time.monotonic_ns(), self._slot.dropped)

    @property
    def stopping(self) -> threading.Event:
        """Set once the daemon is on its way out, asked to or because a thread failed."""
        return self._stopping

    def start(self) -> None:
        """Start the threads."""
        self._worker.start()
        self._capture.start()

    def recalibrate(self) -> None:
        """Learn the surface anew from the next frame on."""
        self._at_boundary.put(self._pipeline.calibrate)

    def stop(self) -> BaseException | None:
        """End every touch at every client and stop the threads; return the error that a thread ended with."""
        self._stopping.set()
        self._source.close()
        for thread in (self._capture, self._worker):
            thread.join(_JOIN_S)
            if thread.is_alive() and self._error is None:
                self._error = TouchdError(f"the {thread.name} thread did not stop within {_JOIN_S:.0f} s")
        return self._error

    def _guarded(self, job: Callable[[], None]) -> None:
        try:
            job()
        except BaseException as error:  # noqa: BLE001  a thread's failure must end the daemon, with its traceback
            self._error = self._error or error
        finally:
            self._stopping.set()

    def _capture_frames(self) -> None:
        for frame in self._source.frames():
            if self._stopping.is_set():
                return
            self._slot.put(frame, time.monotonic_ns())
        if not self._stopping.is_set():
            raise SourceError(f"{self._source.name}: the source ended; start touchd again")

    def _work(self) -> None:
        for output in self._outputs:
            output.start()
        try:
            self._work_on_frames()
        finally:
            for output in self._outputs:
                output.close()

    def _work_on_frames(self) -> None:
        last_t_ns, last_seen_s, stalled = 0, time.monotonic(), False
        while not self._stopping.is_set():
            taken = self._slot.take(min(_TICK_S, self._stall_s))
            self._do_what_was_asked()
            if taken is not None:
                frame, arrived_ns = taken
                last_t_ns, last_seen_s, stalled = frame.t_ns, time.monotonic(), False
                self._publish(self._pipeline.step(frame))
                self._metrics.note(arrived_ns, time.monotonic_ns())
                continue
            silent_s = time.monotonic() - last_seen_s
            if silent_s >= self._stall_s and not stalled:
                stalled = True
                self._publish(self._pipeline.stall(last_t_ns + int(silent_s * 1e9)))
            for output in self._outputs:
                output.tick(time.monotonic_ns())

    def _do_what_was_asked(self) -> None:
        while not self._at_boundary.empty():
            self._at_boundary.get()()

    def _publish(self, result: TouchFrame) -> None:
        now_ns = time.monotonic_ns()
        for output in self._outputs:
            output.publish(result, now_ns)
        self._on_frame(result)


def wait_for_signals(daemon: Daemon, meanwhile: Callable[[], None]) -> None:
    """Wait in the main thread until a signal or a failed thread says stop; call ``meanwhile`` a few times a second.

    The signals must be blocked already. SIGTERM and SIGINT return; SIGUSR1 recalibrates.
    """
    watched = {signal.SIGTERM, signal.SIGINT, signal.SIGUSR1}
    while not daemon.stopping.is_set():
        received = signal.sigtimedwait(watched, _LOOK_S)
        meanwhile()
        if received is None:
            continue
        if received.si_signo == signal.SIGUSR1:
            log.info("recalibrating: SIGUSR1")
            daemon.recalibrate()
        else:
            log.info("stopping: %s", signal.Signals(received.si_signo).name)
            return
