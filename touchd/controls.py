"""What a running service lets itself be asked for over the control socket, and how it tells how it fares."""

import os
import queue
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import version

from touchd.align.session import AlignProgress, AlignSession
from touchd.control.protocol import Progress
from touchd.errors import ExitCode
from touchd.memory import resident_bytes
from touchd.model import State, TouchFrame
from touchd.outputs.output import Output
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.service import Service, Stopping
from touchd.status.data import (
    AreaFacts,
    ConfigFacts,
    OutputFacts,
    Status,
    output_facts,
    source_facts,
    surface_facts,
)
from touchd.status.recent import RecentRise

_LOOK_S = 0.2
_ALIGN_QUEUE = 90  # frames: three seconds, more than any pause of the thread that reads them


class ServiceControls:
    """Answers for a service. Called from the control server's threads; what changes things is done on the main one."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._started_s = time.time()
        self._rises = RecentRise()

    def status(self) -> Status:
        """Return how the daemon fares."""
        service, daemon = self._service, self._service.daemon
        seen, metrics, ready = service.seen, daemon.metrics(), daemon.pipeline.ready
        now_s = time.monotonic()
        config = service.config
        return Status(
            version=version("touchd"),
            pid=os.getpid(),
            time_s=time.time(),
            started_s=self._started_s,
            memory_bytes=resident_bytes(),
            state=seen.state,
            state_since_s=seen.since_s,
            why=seen.why,
            cursors=seen.cursors,
            touches=seen.touches,
            config=ConfigFacts(
                None if service.config_path is None else str(service.config_path.absolute()),
                service.problem,
                service.problem_since_s,
            ),
            not_kept=service.not_kept,
            source=source_facts(
                daemon.source.name,
                config.source.kind,
                daemon.source.waiting,
                daemon.source.reconnects,
                metrics,
                self._rises.note("dropped", metrics.dropped, now_s),
                daemon.source.packet_loss,
            ),
            surface=None
            if ready is None
            else surface_facts(ready.report, ready.surface.made_from, service.surface_since_s, daemon.pipeline.vitals),
            area=None
            if ready is None
            else AreaFacts(
                service.area_origin, ready.area.size_mm, service.alignment_residual_mm, ready.notes, service.eye
            ),
            outputs=tuple(self._output_facts(output, now_s) for output in daemon.outputs),
        )

    def _output_facts(self, output: Output, now_s: float) -> OutputFacts:
        status = output.status()
        destinations = output.destinations() if isinstance(output, TuioUdpOutput) else ()
        troubled = self._rises.note(status.name, status.failed + status.dropped, now_s)
        return output_facts(status, destinations, troubled)

    def reload(self) -> str:
        """Read the config file again and say what was changed. Raises TouchdError if it cannot be used."""
        return self._service.on_main_thread(self._service.reload)

    def calibrate(self) -> Generator[Progress, None, None]:
        """Learn the surface anew."""
        pipeline = self._service.daemon.pipeline
        before = pipeline.calibrations_ended
        self._service.recalibrate()
        while pipeline.calibrations_ended == before:
            seen = self._service.seen
            if self._service.daemon.pipeline is not pipeline:
                why = "the source was changed meanwhile; calibrate again"
                yield Progress(seen.state or State.CALIBRATING, why, done=True, exit_code=ExitCode.TRY_AGAIN)
                return
            if seen.state is State.NO_SURFACE and seen.why and pipeline.calibration_is_late:
                yield Progress(seen.state, seen.why, done=True, exit_code=ExitCode.TRY_AGAIN)
                return
            yield Progress(seen.state or State.CALIBRATING, seen.why)
            time.sleep(_LOOK_S)
        failure = pipeline.calibration_failure
        if failure is not None:
            yield Progress(State.TRACKING, failure, done=True, exit_code=ExitCode.TRY_AGAIN)
        else:
            yield Progress(State.TRACKING, None, done=True, ok=True)

    def align(self, points: int, sides: int) -> Generator[AlignProgress, None, None]:
        """Find the active area by that many touches from each of so many sides; meanwhile the outputs get none."""
        service = self._service
        frames: queue.Queue[TouchFrame] = queue.Queue(_ALIGN_QUEUE)
        ready = service.on_main_thread(lambda: service.begin_aligning(_put_or_drop(frames)))
        try:
            session = AlignSession(points, ready.area, ready.surface_map, sides)
            progress = session.feed(TouchFrame(0, 0, State.TRACKING))
            while session.alignment is None:
                yield progress
                with suppress(queue.Empty):
                    progress = session.feed(frames.get(timeout=_LOOK_S))
            found = session.alignment
            kept_in = service.on_main_thread(lambda: service.keep_alignment(found))
            yield replace(progress, kept_in=kept_in)
        finally:
            with suppress(Stopping):
                service.on_main_thread(service.end_aligning)


def _put_or_drop(frames: "queue.Queue[TouchFrame]") -> Callable[[TouchFrame], None]:
    def put(frame: TouchFrame) -> None:
        with suppress(queue.Full):
            frames.put_nowait(frame)

    return put
