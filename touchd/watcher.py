"""Watches what the worker says of each frame, for the log and for whoever asks how things are."""

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass

from touchd.model import State, TouchFrame
from touchd.outputs.output import Output

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Seen:
    """The state of things as the last frame told it."""

    state: State | None  # None before the first frame
    since_s: float  # Unix time
    why: str | None
    cursors: int
    touches: int  # begun since the start


class Watcher:
    """Called on the worker thread with each result; read from any thread. Says each change of state once."""

    def __init__(self) -> None:
        self._seen = Seen(None, time.time(), None, 0, 0)
        self._last_id = 0

    @property
    def seen(self) -> Seen:
        """What was seen last."""
        return self._seen

    def __call__(self, frame: TouchFrame) -> None:
        """Take note of a frame."""
        before = self._seen
        fresh = sum(cursor.session_id > self._last_id for cursor in frame.cursors)
        if frame.cursors:
            self._last_id = max(self._last_id, frame.cursors[-1].session_id)
        if frame.state is before.state:
            since_s = before.since_s
        else:
            since_s = time.time()
            log.info("state: %s%s", frame.state.value, f" ({frame.why})" if frame.why else "")
        self._seen = Seen(frame.state, since_s, frame.why, len(frame.cursors), before.touches + fresh)


class Complaints:
    """Says in the log what outputs complain of, each at a limited rate."""

    EVERY_S = 30.0

    def __init__(self) -> None:
        self._said: dict[str, tuple[int, float]] = {}

    def look(self, outputs: Sequence[Output]) -> None:
        """Look at the outputs' counters. Called on the main thread a few times a second."""
        now_s = time.monotonic()
        for status in (output.status() for output in outputs):
            failed, said_s = self._said.get(status.name, (0, -self.EVERY_S))
            if status.failed > failed and now_s - said_s >= self.EVERY_S:
                self._said[status.name] = (status.failed, now_s)
                log.warning("%s: %d failed so far: %s", status.name, status.failed, status.last_error)
