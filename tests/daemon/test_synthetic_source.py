import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from touchd.errors import SourceError, UsageError
from touchd.model import Frame, State, TouchFrame
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.sources.frame_ring import SLOTS, FrameRing, RingWriter
from touchd.sources.synthetic import SyntheticSource
from touchd.sources.synthetic_child import IGNORED, Pace
from touchd.surface.settings import CalibrationSettings
from touchd.table.show import frame_time_ns

PATIENCE_S = 30.0


def source(
    scenario: str = "pinch", seed: int = 3, empty_frames: int = 2, pace: Pace = Pace.AS_TAKEN
) -> SyntheticSource:
    return SyntheticSource(scenario, seed, empty_frames, pace)


def first_frames(played: SyntheticSource, count: int) -> list[Frame]:
    with closing(played):
        return list(islice(played.frames(), count))


def wait_until(happened: Callable[[], bool]) -> None:
    for _ in range(round(PATIENCE_S / 0.01)):
        if happened():
            return
        time.sleep(0.01)
    pytest.fail("it did not happen")


def renderer_of(played: SyntheticSource) -> int:
    assert played._process is not None
    return played._process.pid


def status_of(process: int) -> dict[str, str]:
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return {name: value.strip() for name, _, value in (line.partition(":") for line in lines)}


def listed(folder: str) -> list[str]:
    return sorted(path.name for path in Path(folder).iterdir())


def running(process: int) -> bool:
    try:
        return not status_of(process)["State"].startswith("Z")
    except OSError:
        return False


def test_the_same_seed_and_scenario_give_the_same_bytes_and_another_seed_does_not() -> None:
    one, two, other = (first_frames(source(seed=seed), 45) for seed in (3, 3, 4))
    assert [frame.raw.tobytes() for frame in one] == [frame.raw.tobytes() for frame in two]
    assert one[0].raw.tobytes() != other[0].raw.tobytes()


def test_frames_count_up_at_30_hz_of_the_shows_own_clock_and_cannot_be_changed() -> None:
    frames = first_frames(source(), 5)
    assert [frame.index for frame in frames] == [0, 1, 2, 3, 4]
    assert [frame.t_ns for frame in frames] == [frame_time_ns(index) for index in range(5)]
    assert not frames[0].raw.flags.writeable


def test_the_first_frames_show_the_empty_table_and_then_touches_come() -> None:
    played = source(empty_frames=12)
    pipeline = Pipeline(
        played.sensor, PipelineSettings(calibration=CalibrationSettings(frames=10), area=played.area), played.name
    )
    pipeline.calibrate()
    with closing(played):
        results: Iterator[TouchFrame] = map(pipeline.step, played.frames())
        touched = next(result for result in islice(results, 200) if len(result.cursors) == 2)
    assert touched.state is State.TRACKING
    assert touched.index > 12


def test_a_live_show_drops_old_frames_for_the_newest_one_and_frees_their_slots() -> None:
    ring = FrameRing((640, 480))
    writer = RingWriter(ring.ends)
    for index in range(3):
        writer.put(Frame(index, index, np.full((480, 640), index, np.uint16)))
    live, steady = source(pace=Pace.LIVE), source(pace=Pace.AS_TAKEN)
    tickets = ring.wait()
    assert steady._worthwhile(tickets, ring) == tickets
    (newest,) = live._worthwhile(tickets, ring)
    assert ring.frame(newest).index == 2
    for _ in range(3):
        writer.listen(0.0)
    assert len(writer._free) == SLOTS
    ring.handed_over()
    ring.close()


def test_it_says_what_it_waits_for_until_the_first_frame_is_there() -> None:
    played = source()
    assert played.waiting == "the synthetic table is being set up"
    assert len(first_frames(played, 1)) == 1
    assert played.waiting is None


def test_closing_from_another_thread_ends_the_frames_and_the_renderer() -> None:
    played = source(pace=Pace.LIVE)
    frames = played.frames()
    next(frames)
    renderer = renderer_of(played)
    closer = threading.Thread(target=played.close)
    closer.start()
    assert sum(1 for _ in frames) <= SLOTS
    closer.join(PATIENCE_S)
    played.close()
    assert not running(renderer)


def test_a_source_closed_before_it_began_gives_no_frames() -> None:
    played = source()
    played.close()
    assert list(played.frames()) == []
    assert played._process is None


def test_nothing_is_left_open_when_frames_are_no_longer_wanted() -> None:
    before = listed("/proc/self/fd"), listed("/dev/shm")
    played = source()
    frames = played.frames()
    next(frames)
    renderer = renderer_of(played)
    frames.close()  # type: ignore[attr-defined]  # they are a generator
    assert not running(renderer)
    assert (listed("/proc/self/fd"), listed("/dev/shm")) == before


def test_a_renderer_that_is_killed_is_one_sentence() -> None:
    played = source()
    frames = played.frames()
    next(frames)
    os.kill(renderer_of(played), signal.SIGKILL)
    with pytest.raises(SourceError) as caught:
        list(frames)
    assert str(caught.value) == "synthetic table 3: its renderer was killed by SIGKILL; start touchd again"


def test_a_renderer_that_fails_is_one_sentence_with_its_last_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("touchd.sources.synthetic_child.__name__", "touchd.nothing")
    with pytest.raises(SourceError) as caught:
        next(source().frames())
    assert str(caught.value) == (
        f"synthetic table 3: its renderer ended with exit code 1 ({sys.executable}: No module named touchd.nothing); "
        "start touchd again"
    )


def test_a_renderer_that_cannot_be_started_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    before = listed("/proc/self/fd")
    with pytest.raises(SourceError) as caught:
        next(source().frames())
    assert str(caught.value) == (
        "synthetic table 3: its renderer /nowhere/python cannot be started: No such file or directory; "
        "free some memory or raise the limits"
    )
    assert listed("/proc/self/fd") == before


def test_a_scenario_that_does_not_exist_is_refused_at_once() -> None:
    with pytest.raises(UsageError, match="there is no scenario 'juggling'"):
        source("juggling")


def test_the_renderer_has_an_empty_signal_mask_and_the_parent_keeps_its_own() -> None:
    blocked = {signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, blocked)
    try:
        played = source()
        frames = played.frames()
        next(frames)
        mask = status_of(renderer_of(played))["SigBlk"]
        assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before | blocked
        played.close()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    assert int(mask, 16) == 0


@pytest.mark.parametrize("number", IGNORED)
def test_the_renderer_outlives_what_reaches_the_whole_process_group(number: signal.Signals) -> None:
    played = source()
    with closing(played):
        frames = played.frames()
        next(frames)
        os.kill(renderer_of(played), number)
        assert [frame.index for frame in islice(frames, 3 * SLOTS)] == list(range(1, 1 + 3 * SLOTS))


def test_signals_while_the_renderer_begins_do_not_end_it() -> None:
    played = source()
    arrived: list[Frame] = []
    taking = threading.Thread(target=lambda: arrived.extend(islice(played.frames(), 1)))
    taking.start()
    wait_until(lambda: played._process is not None)
    for number in IGNORED:
        os.kill(renderer_of(played), number)
    taking.join(PATIENCE_S)
    played.close()
    assert len(arrived) == 1


PARENT = """
from touchd.sources.synthetic import SyntheticSource
played = SyntheticSource("taps", 1, 5)
for frame in played.frames():
    print(played._process.pid, flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_renderer_ends_with_its_parent_and_leaves_nothing(number: signal.Signals) -> None:
    before = listed("/dev/shm")
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        assert parent.stderr is not None
        assert select.select([parent.stdout], [], [], PATIENCE_S)[0]
        renderer = int(parent.stdout.readline())
        parent.send_signal(number)
        parent.wait(PATIENCE_S)
        assert parent.stderr.read() == b""
    wait_until(lambda: not running(renderer))
    assert listed("/dev/shm") == before
