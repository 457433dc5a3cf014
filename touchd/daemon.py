"""The running daemon: a capture thread, a worker thread, and the main thread that waits for signals."""

import queue
import threading
import time
from collections.abc import Callable, Sequence

from touchd.errors import SourceError, TouchdError
from touchd.metrics import FrameMetrics, MetricsSnapshot
from touchd.model import Frame, State, TouchFrame
from touchd.outputs.output import Output
from touchd.pipeline import Pipeline
from touchd.sources.source import Source

# How often the worker looks up when no frames come: touches end so soon after the source is known to be lost.
_TICK_S = 0.05
_JOIN_S = 5.0


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
    What others ask of it is done on the worker thread between two frames.
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
        self._outputs = tuple(outputs)
        self._stall_s = stall_ms / 1e3
        self._on_frame = on_frame
        self._slot = LatestFrame()
        self._metrics = FrameMetrics()
        self._asked: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._error: BaseException | None = None
        # The source that was asked for last; the worker may not have come to it yet.
        self._wanted = source
        self._tap: Callable[[TouchFrame], None] | None = None
        self._beat_s = time.monotonic()
        self._capture = self._capture_thread(source)
        self._worker = threading.Thread(target=self._guarded, args=(self._work,), name="worker", daemon=True)

    @property
    def source(self) -> Source:
        """The source that frames come from."""
        return self._source

    @property
    def pipeline(self) -> Pipeline:
        """The pipeline that frames go through."""
        return self._pipeline

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The outputs that results go to."""
        return self._outputs

    @property
    def stopping(self) -> threading.Event:
        """Set once the daemon is on its way out, asked to or because a thread failed."""
        return self._stopping

    def metrics(self) -> MetricsSnapshot:
        """Return how fast frames come and are worked on. May be called from any thread."""
        return self._metrics.snapshot(time.monotonic_ns(), self._slot.dropped)

    def alive(self, within_s: float) -> bool:
        """Return whether the worker looked up lately, and frames flow or the source knows what it waits for."""
        flowing = self._metrics.idle_s(time.monotonic_ns()) <= within_s or self._source.waiting is not None
        return flowing and time.monotonic() - self._beat_s <= within_s

    def start(self) -> None:
        """Start the threads."""
        self._worker.start()
        self._capture.start()

    def ask(self, job: Callable[[], None]) -> None:
        """Have a job done on the worker thread before the next frame, unless the daemon stops first."""
        self._asked.put(job)

    def recalibrate(self) -> None:
        """Learn the surface anew from the next frames without motion."""

        def begin() -> None:
            self._pipeline.calibrate_patiently()

        self.ask(begin)

    def set_stall(self, stall_ms: float) -> None:
        """Lift all touches after so long without a frame from now on."""
        self._stall_s = stall_ms / 1e3

    def divert(self, tap: Callable[[TouchFrame], None] | None) -> None:
        """Give results to ``tap`` and tell outputs that touch is paused; None ends that. For the worker thread."""
        self._tap = tap

    def change_outputs(self, outputs: Sequence[Output]) -> None:
        """Send to these outputs from now on: those left out are closed, new ones are started, the rest go on."""

        def change() -> None:
            before, self._outputs = self._outputs, tuple(outputs)
            # The old before the new: of two with the same destination, the last word is the newer one's.
            for output in before:
                if output not in self._outputs:
                    output.close()
            for output in self._outputs:
                if output not in before:
                    output.start()

        self.ask(change)

    def change_source(self, source: Source, pipeline: Pipeline) -> None:
        """Take frames from another source, through a pipeline of its own; every touch ends."""
        before, self._wanted = self._wanted, source
        before.close()
        self._capture.join(_JOIN_S)

        def change() -> None:
            if source is not self._wanted:
                return
            self._slot.take(0.0)
            self._publish(self._pipeline.stall(time.monotonic_ns()))
            self._source, self._pipeline = source, pipeline
            capture = self._capture_thread(source)
            capture.start()
            self._capture = capture

        self.ask(change)

    def change_pipeline(self, pipeline: Pipeline) -> None:
        """Put the source's frames through another pipeline, as its camera is another one; every touch ends."""

        def change() -> None:
            if self._metrics.frames:
                self._publish(self._pipeline.stall(time.monotonic_ns()))
            self._pipeline = pipeline

        self.ask(change)

    def stop(self) -> BaseException | None:
        """End every touch at every client and stop the threads; return the error that a thread ended with."""
        self._stopping.set()
        if self._worker.is_alive():
            self._join(self._worker)
        self._wanted.close()
        self._source.close()
        if self._capture.is_alive():
            self._join(self._capture)
        return self._error

    def _join(self, thread: threading.Thread) -> None:
        thread.join(_JOIN_S)
        if thread.is_alive() and self._error is None:
            self._error = TouchdError(f"the {thread.name} thread did not stop within {_JOIN_S:.0f} s")

    def _capture_thread(self, source: Source) -> threading.Thread:
        # A thread that will not end must not keep the process: stop() tells of it.
        return threading.Thread(
            target=self._guarded, args=(lambda: self._capture_frames(source),), name="capture", daemon=True
        )

    def _guarded(self, job: Callable[[], None]) -> None:
        try:
            job()
        except BaseException as error:  # noqa: BLE001  a thread's failure must end the daemon, with its traceback
            self._error = self._error or error
            self._stopping.set()

    def _capture_frames(self, source: Source) -> None:
        for frame in source.frames():
            self._slot.put(frame, time.monotonic_ns())
        if source is self._wanted and not self._stopping.is_set():
            raise SourceError(f"{source.name}: the source ended; start touchd again")

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
            self._beat_s = time.monotonic()
            while not self._asked.empty() and not self._stopping.is_set():
                self._asked.get()()
            taken = self._slot.take(min(_TICK_S, self._stall_s))
            if taken is not None:
                last_seen_s = time.monotonic()
                if self._source.sensor is not self._pipeline.sensor:
                    continue  # a camera that was just plugged in: its pipeline is being made
                frame, arrived_ns = taken
                last_t_ns, stalled = frame.t_ns, False
                self._publish(self._pipeline.step(frame))
                self._metrics.note(arrived_ns, time.monotonic_ns())
                self._pipeline.settle()
                continue
            silent_s = time.monotonic() - last_seen_s
            # One that knows that no frames will come has stalled at once; but not while it is being set up.
            waiting = self._source.waiting is not None
            due = self._metrics.frames > 0 if waiting else silent_s >= self._stall_s
            if due and not stalled:
                stalled = True
                self._publish(self._pipeline.stall(last_t_ns + int(silent_s * 1e9)))
            for output in self._outputs:
                output.tick(time.monotonic_ns())

    def _publish(self, result: TouchFrame) -> None:
        if self._tap is not None:
            self._tap(result)
            result = TouchFrame(result.index, result.t_ns, State.PAUSED, why="being aligned")
        now_ns = time.monotonic_ns()
        for output in self._outputs:
            output.publish(result, now_ns)
        self._source.show(result.state)
        self._on_frame(result)
