"""The daemon's end of the control socket, with a daemon behind it that does as the test wants."""

import socket
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from touchd.align.hold import Phase
from touchd.align.session import AlignProgress
from touchd.control.client import fetch_status
from touchd.control.errors import Refused
from touchd.control.protocol import Progress
from touchd.control.server import ControlServer, Limits
from touchd.errors import ConfigError
from touchd.model import State
from touchd.status.data import ConfigFacts, SourceFacts, Status

from clients.harness import PATIENCE_S

T = TypeVar("T")
PATIENT = Limits(request_s=PATIENCE_S, reply_s=PATIENCE_S)
STRANGER = 65534
STATUS = Status(
    version="0.1.0",
    pid=1,
    time_s=1000.0,
    started_s=900.0,
    memory_bytes=80_000_000,
    state=State.TRACKING,
    state_since_s=910.0,
    why=None,
    cursors=0,
    touches=3,
    config=ConfigFacts(None),
    not_kept=None,
    source=SourceFacts("a test", "synthetic", None, 0, 2700, 30.0, 0, 0, 1.0, 2.0, 3.0),
    surface=None,
    area=None,
    outputs=(),
)
DONE = Progress(State.TRACKING, "flat to 1.0 mm", done=True, ok=True)
ALIGNED = AlignProgress(
    *(4, 4, "bottom-left corner", Phase.DONE),
    done=True,
    residual_mm=1.26,
    size_mm=(800.4, 600.2),
    kept_in="/var/lib/touchd/alignment.json",
)


@dataclass
class FakeControls:
    """A daemon that calibrates and aligns as it is told; without an end it goes on until it is closed."""

    calibration: list[Progress] = field(default_factory=list)
    alignment: list[AlignProgress] = field(default_factory=list)
    begun: threading.Event = field(default_factory=threading.Event)
    closed: threading.Event = field(default_factory=threading.Event)

    def status(self) -> Status:
        return STATUS

    def reload(self) -> str:
        raise ConfigError("touchd.yaml:1:1: tracking is wrong")

    def calibrate(self) -> Generator[Progress]:
        yield from self.calibration
        yield from self._for_ever(lambda: Progress(State.CALIBRATING, "x" * 1000))

    def align(self, points: int, sides: int) -> Generator[AlignProgress]:
        yield from self.alignment
        yield from self._for_ever(lambda: AlignProgress(1, points * sides, "top-left corner", Phase.TOUCH))

    def _for_ever(self, make: Callable[[], T]) -> Generator[T]:
        self.begun.set()
        try:
            while True:
                yield make()
        finally:
            self.closed.set()


@contextmanager
def serving(path: Path, controls: FakeControls, limits: Limits = PATIENT) -> Iterator[ControlServer]:
    server = ControlServer(path, controls, limits)
    server.start()
    try:
        yield server
    finally:
        server.stop()


def connected(path: Path) -> socket.socket:
    client = socket.socket(socket.AF_UNIX)
    client.settimeout(PATIENCE_S)
    client.connect(str(path))
    return client


def wait_until(happened: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < deadline_s, "it did not happen"
        time.sleep(0.005)


def answers(path: Path) -> bool:
    try:
        return fetch_status(path) == STATUS
    except Refused:
        return False
