"""The daemon's threads, with a source and an output that the test holds in its hands."""

import queue
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from touchd.daemon import Daemon, LatestFrame
from touchd.errors import SourceError
from touchd.geometry import kinect_v1_sensor
from touchd.model import Frame, Sensor, State, TouchFrame
from touchd.outputs.output import OutputStatus
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings

PATIENCE_S = 30.0
SENSOR = replace(kinect_v1_sensor(), size=(64, 48))


def frame(index: int) -> Frame:
    return Frame(index, index * 33_333_333, np.full((48, 64), 700, np.uint16))


class HandSource:
    """Gives out a frame whenever the test puts one in; an exception put in is raised."""

    name = "a test"
    identified = True

    def __init__(self) -> None:
        self.shown: list[State] = []
        self.given: queue.SimpleQueue[Frame | Exception | None] = queue.SimpleQueue()

    @property
    def sensor(self) -> Sensor:
        return SENSOR

    @property
    def waiting(self) -> str | None:
        return None

    @property
    def reconnects(self) -> int:
        return 0

    @property
    def packet_loss(self) -> float | None:
        return None

    def frames(self) -> Iterator[Frame]:
        while (item := self.given.get()) is not None:
            if isinstance(item, Exception):
                raise item
            yield item

    def show(self, state: State) -> None:
        self.shown.append(state)

    def close(self) -> None:
        self.given.put(None)


@dataclass
class Notes:
    """An output that writes down what it is told."""

    calls: list[str] = field(default_factory=list)
    frames: list[TouchFrame] = field(default_factory=list)
    changed: threading.Condition = field(default_factory=threading.Condition)

    def start(self) -> None:
        self.calls.append("start")

    def publish(self, frame: TouchFrame, _now_ns: int, /) -> None:
        with self.changed:
            self.frames.append(frame)
            self.changed.notify_all()

    def tick(self, _now_ns: int, /) -> None:
        with self.changed:
            self.calls.append("tick")
            self.changed.notify_all()

    def close(self) -> None:
        self.calls.append("close")

    def status(self) -> OutputStatus:
        return OutputStatus("notes", 0, 0, 0, None)

    def wait_for_tick(self) -> None:
        with self.changed:
            before = self.calls.count("tick")
            assert self.changed.wait_for(lambda: self.calls.count("tick") > before, PATIENCE_S)

    def wait_for_state(self, state: State) -> TouchFrame:
        with self.changed:
            assert self.changed.wait_for(lambda: any(f.state is state for f in self.frames), PATIENCE_S)
        return next(f for f in self.frames if f.state is state)


@pytest.fixture
def source() -> HandSource:
    return HandSource()


@pytest.fixture
def notes() -> Notes:
    return Notes()


@pytest.fixture
def daemon(source: HandSource, notes: Notes) -> Iterator[Daemon]:
    pipeline = Pipeline(SENSOR, PipelineSettings(), "a test")
    daemon = Daemon(source, pipeline, [notes], stall_ms=150.0, on_frame=lambda _: None)
    yield daemon
    daemon.stop()


def test_outputs_are_started_fed_and_closed_in_this_order(daemon: Daemon, source: HandSource, notes: Notes) -> None:
    daemon.start()
    source.given.put(frame(0))
    notes.wait_for_state(State.NO_SURFACE)
    assert daemon.stop() is None
    assert notes.calls[0] == "start"
    assert notes.calls[-1] == "close"
    assert notes.calls.count("close") == 1


def test_when_frames_stop_coming_outputs_are_told_once_and_go_on_ticking(
    daemon: Daemon, source: HandSource, notes: Notes
) -> None:
    daemon.start()
    source.given.put(frame(0))
    stalled = notes.wait_for_state(State.NO_FRAMES)
    assert stalled.why == "no frame came from the source"
    assert stalled.index == 0
    with notes.changed:
        assert notes.changed.wait_for(lambda: notes.calls.count("tick") >= 3, PATIENCE_S)
    assert sum(f.state is State.NO_FRAMES for f in notes.frames) == 1


def test_a_source_that_fails_stops_the_daemon_with_its_error(daemon: Daemon, source: HandSource, notes: Notes) -> None:
    failure = SourceError("the cable is out")
    daemon.start()
    source.given.put(failure)
    assert daemon.stopping.wait(PATIENCE_S)
    assert daemon.stop() is failure
    assert notes.calls[-1] == "close"


def test_a_source_that_ends_by_itself_is_an_error(daemon: Daemon, source: HandSource) -> None:
    daemon.start()
    source.given.put(None)
    assert daemon.stopping.wait(PATIENCE_S)
    error = daemon.stop()
    assert str(error) == "a test: the source ended; start touchd again"


def test_of_two_new_sources_in_quick_succession_only_the_last_is_played(
    daemon: Daemon, source: HandSource, notes: Notes
) -> None:
    daemon.start()
    source.given.put(frame(0))
    notes.wait_for_state(State.NO_SURFACE)
    first, last = HandSource(), HandSource()
    for new in (first, last):
        daemon.change_source(new, Pipeline(SENSOR, PipelineSettings(), "another"))
    last.given.put(frame(77))
    with notes.changed:
        assert notes.changed.wait_for(lambda: any(f.index == 77 for f in notes.frames), PATIENCE_S)
    assert daemon.source is last
    assert daemon.stop() is None
    alive = [thread.name for thread in threading.enumerate() if thread.name in {"capture", "worker"}]
    assert alive == []


def test_a_bug_on_the_worker_thread_stops_the_daemon_and_still_closes_outputs(source: HandSource, notes: Notes) -> None:
    def fail(_: TouchFrame) -> None:
        raise ZeroDivisionError

    daemon = Daemon(source, Pipeline(SENSOR, PipelineSettings(), "a test"), [notes], 150.0, fail)
    daemon.start()
    source.given.put(frame(0))
    assert daemon.stopping.wait(PATIENCE_S)
    assert isinstance(daemon.stop(), ZeroDivisionError)
    assert notes.calls[-1] == "close"


def test_recalibration_begins_at_the_next_frame(daemon: Daemon, source: HandSource, notes: Notes) -> None:
    daemon.start()
    source.given.put(frame(0))
    notes.wait_for_state(State.NO_SURFACE)
    daemon.recalibrate()
    notes.wait_for_tick()
    notes.wait_for_tick()
    source.given.put(frame(1))
    assert notes.wait_for_state(State.CALIBRATING).why == "frame 1 of 300"


def test_a_stop_does_not_wait_for_what_was_asked_and_not_yet_begun(daemon: Daemon) -> None:
    busy, free = threading.Event(), threading.Event()
    done: list[str] = []

    def be_busy() -> None:
        busy.set()
        free.wait()

    daemon.start()
    daemon.ask(be_busy)
    daemon.ask(lambda: done.append("asked before the stop"))
    assert busy.wait(PATIENCE_S)
    stopper = threading.Thread(target=daemon.stop)
    stopper.start()
    assert daemon.stopping.wait(PATIENCE_S)
    free.set()
    stopper.join()
    assert done == []


def test_the_slot_keeps_the_newest_frame_and_counts_the_ones_it_replaced() -> None:
    slot = LatestFrame()
    for index in range(4):
        slot.put(frame(index), arrived_ns=100 + index)
    taken = slot.take(0.0)
    assert taken is not None
    assert (taken[0].index, taken[1]) == (3, 103)
    assert slot.dropped == 3
    assert slot.take(0.0) is None
