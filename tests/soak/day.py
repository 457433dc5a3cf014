"""A long day of a touchd in this process: its service as it is, but for the source, the wall clock and the pace."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import cv2
from touchd.assemble import OpenedSource
from touchd.controls import ServiceControls
from touchd.memory import resident_bytes
from touchd.model import State
from touchd.notify import Notifier
from touchd.outputs.events import QueuedEventWriter
from touchd.run import Heart
from touchd.service import Service
from touchd.state import FSEQ_FILE
from touchd.table.scenarios import area_corners

from soak.client import StrictClient
from soak.lockstep import PATIENCE_S, LockStepSource, TellingWatcher
from soak.pictures import CALIBRATION_FRAMES, PERIOD_NS, busy_table
from soak.verdict import Sample

# The main thread looks after things five times a second.
_FRAMES_A_LOOK = 6
_FRAMES_A_MINUTE = 1800
# Session ids begin where the wall clock says, 83 rounds of 2**31 ticks of 10 ms after 1970 less 12 seconds: they come
# round after some 1100 touches. Frame numbers go on from the stored one, which is ahead, and come round after 800.
_BEGIN_UNIX_S = (83 * 2**31 - 1200) / 100
_STORED_FSEQ = 2**31 - 1800


@dataclass(frozen=True, slots=True)
class Plan:
    """How long the day is, and how often it is sampled. In each of these times everything happens once."""

    minutes: int
    sample_minutes: int


class Day:
    """A service with a regular client and a guest. Made by :func:`opened_day`; its methods are for the main thread."""

    def __init__(
        self,
        service: Service,
        source: LockStepSource,
        watcher: TellingWatcher,
        config: "ConfigFile",
        clients: "Clients",
    ) -> None:
        self.service = service
        self._clients = clients
        self._stuck: list[str] = []
        self._source = source
        self._watcher = watcher
        self._config = config
        self._heart = Heart(Notifier({}), ServiceControls(service))
        # Each waits until touches are under way, so that it happens to them.
        self._doings: tuple[Callable[[], None], ...] = (
            self._fall_silent,
            lambda: self._edit(guest=True),
            lambda: self._edit(guest=True, min_area_mm2=25),
            lambda: self._edit(guest=False, min_area_mm2=25),
            lambda: self._edit(guest=False),
            self._recalibrate,  # last before a sample: after it touchd gives freed memory back
        )

    def samples(self, plan: Plan) -> Iterator[Sample]:
        """Live through the day, sample by sample."""
        sample_frames = plan.sample_minutes * _FRAMES_A_MINUTE
        for number in range(1, plan.minutes // plan.sample_minutes + 1):
            begun_s = time.monotonic()
            for which, doing in enumerate(self._doings, 1):
                doing()
                self._play_until((number - 1) * sample_frames + which * sample_frames // len(self._doings))
            yield self._sample(sample_frames / (time.monotonic() - begun_s))

    def complaints(self) -> list[str]:
        """Return what outputs failed at, which touches stayed where they must not, and whether some were not seen."""
        found = [*self._stuck]
        found += [
            f"{status.name}: {status.failed} failed, {status.dropped} dropped: {status.last_error}"
            for status in (output.status() for output in self.service.daemon.outputs)
            if status.failed or status.dropped
        ]
        seen, begun = self._clients.regular.touches, self.service.seen.touches
        if seen != begun:
            found.append(f"the client saw {seen} of {begun} touches begin")
        return found

    def _play_until(self, frame: int) -> None:
        while self._source.played < frame:
            self._play(_FRAMES_A_LOOK)

    def _play(self, frames: int) -> None:
        self._source.play(frames)
        self.service.look()
        self._heart.beat(self.service.daemon)
        for client in (self._clients.regular, self._clients.guest):
            client.catch_up()

    def _until(self, happened: Callable[[], bool], what: str) -> None:
        for _ in range(_FRAMES_A_MINUTE):
            if happened():
                return
            self._play(1)
        raise TimeoutError(f"in a minute of frames it did not happen that {what}")

    def _touched(self) -> None:
        self._until(lambda: self.service.seen.cursors > 0, "somebody touched")

    def _recalibrate(self) -> None:
        pipeline = self.service.daemon.pipeline
        before = pipeline.calibrations_ended
        self._touched()
        self.service.recalibrate()
        self._until(lambda: pipeline.calibrations_ended > before, "the surface was learned")

    def _fall_silent(self) -> None:
        self._touched()
        self._source.fall_silent(1_000_000_000)
        _wait_until(lambda: self.service.seen.state is State.NO_FRAMES, "the daemon noticed that frames stalled")
        self._note_stuck(self._clients.regular, "while frames stalled")

    def _note_stuck(self, client: StrictClient, when: str) -> None:
        client.catch_up()
        if client.held:
            self._stuck.append(f"the client at {client.destination} held {sorted(client.held)} {when}")

    def _edit(self, guest: bool, min_area_mm2: int = 20) -> None:
        self._touched()
        self._config.write(guest, min_area_mm2)
        before = self.service.config
        self._until(lambda: self.service.config is not before, "the edited config was in force")

    def _sample(self, frames_a_second: float) -> Sample:
        _wait_until(lambda: _lines(self.service) == self._watcher.results, "the events were written")
        self._note_stuck(self._clients.guest, "after it had been taken out of the config")
        regular = self._clients.regular
        return Sample(
            hours=self._source.played / _FRAMES_A_MINUTE / 60,
            resident_bytes=resident_bytes() or 0,
            threads=_entries("/proc/self/task"),
            descriptors=_entries("/proc/self/fd"),
            fseq=regular.fseq,
            session_id=regular.highest_id,
            touches=regular.touches,
            frames_a_second=frames_a_second,
        )


@dataclass(frozen=True, slots=True)
class Clients:
    """One client that is there all day, and one that comes and goes."""

    regular: StrictClient
    guest: StrictClient


@dataclass(frozen=True, slots=True)
class ConfigFile:
    """The config of the day: the regular client, the guest when it is there, and events that nobody reads."""

    path: Path
    clients: Clients

    def write(self, guest: bool, min_area_mm2: int) -> None:
        """Save it as editors do: as a new file in the old one's place."""
        clients = [self.clients.regular, self.clients.guest] if guest else [self.clients.regular]
        new = self.path.with_suffix(".new")
        new.write_text(
            f"calibration: {{frames: {CALIBRATION_FRAMES}, on_start: always}}\n"
            f"touch: {{min_area_mm2: {min_area_mm2}}}\n"
            "tracking: {stall_ms: 500}\n"  # more than saving a surface takes, which frames here wait for
            "outputs:\n"
            f"  - tuio: {{to: {[client.destination for client in clients]}}}\n"
            "  - events: {path: /dev/null}\n"
        )
        new.replace(self.path)


@contextmanager
def opened_day(folder: Path, clients: Clients) -> Iterator[Day]:
    """Begin a day in a folder for config and state, with clients that listen already. Ends every touch at its end."""
    cv2.setNumThreads(1)  # as touchd itself does
    source = LockStepSource(busy_table())
    watcher = TellingWatcher(source)
    opened = OpenedSource(source, CALIBRATION_FRAMES, area_corners(), ())
    (folder / FSEQ_FILE).write_text(f"{_STORED_FSEQ}\n")
    config = ConfigFile(folder / "touchd.yaml", clients)
    config.write(guest=False, min_area_mm2=20)
    clock = SimpleNamespace(time=lambda: _BEGIN_UNIX_S + source.played * PERIOD_NS / 1e9)
    with ExitStack() as replaced:
        replaced.enter_context(patch("touchd.service.open_source", return_value=opened))
        replaced.enter_context(patch("touchd.service.Watcher", return_value=watcher))
        replaced.enter_context(patch("touchd.assemble.time", clock))
        service = Service(config.path, folder)
        service.start()
        try:
            yield Day(service, source, watcher, config, clients)
        finally:
            service.stop()


def _lines(service: Service) -> int:
    (events,) = (output.status() for output in service.daemon.outputs if isinstance(output, QueuedEventWriter))
    return events.sent + events.failed + events.dropped


def _entries(folder: str) -> int:
    return sum(1 for _ in Path(folder).iterdir())


def _wait_until(happened: Callable[[], bool], what: str) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not happened():
        if time.monotonic() > deadline_s:
            raise TimeoutError(f"within {PATIENCE_S:.0f} s it did not happen that {what}")
        time.sleep(0.005)
