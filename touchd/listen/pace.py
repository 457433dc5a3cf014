"""How evenly frames arrive."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

_KEPT = 100_000  # intervals: half an hour at 60 frames a second
_PAUSE_NS = 1_000_000_000  # a longer one is silence, not jitter


@dataclass(frozen=True, slots=True)
class Apart:
    """How far apart frames with living cursors arrive, in ms; percentiles by the nearest rank."""

    median_ms: float
    p99_ms: float
    worst_ms: float


@dataclass(frozen=True, slots=True)
class Window:
    """What arrived since the last look; ``apart`` is None for fewer than two frames with living cursors."""

    datagrams: int
    frames: int
    apart: Apart | None


class Pace:
    """Counts datagrams and frames, in all and since the last look."""

    def __init__(self) -> None:
        self.datagrams = 0
        self.frames = 0
        self._intervals_ns: deque[int] = deque(maxlen=_KEPT)
        self._worst_ns = 0
        self._recent_ns: list[int] = []
        self._looked = (0, 0)
        self._last_live_ns: int | None = None

    def note_frame(self, t_ns: int, live: bool) -> None:
        """Take note of a frame; ``live`` while it has cursors, as only then frames are due at once."""
        self.frames += 1
        if self._last_live_ns is not None and t_ns - self._last_live_ns <= _PAUSE_NS:
            interval_ns = t_ns - self._last_live_ns
            self._intervals_ns.append(interval_ns)
            self._recent_ns.append(interval_ns)
            self._worst_ns = max(self._worst_ns, interval_ns)
        self._last_live_ns = t_ns if live else None

    def look(self) -> Window:
        """Return what arrived since the last look."""
        datagrams, frames = self._looked
        self._looked = (self.datagrams, self.frames)
        window = Window(self.datagrams - datagrams, self.frames - frames, _apart(self._recent_ns))
        self._recent_ns = []
        return window

    def apart(self) -> Apart | None:
        """Return how far apart all frames came: the worst ever, the others of the latest 100,000."""
        apart = _apart(self._intervals_ns)
        return None if apart is None else Apart(apart.median_ms, apart.p99_ms, self._worst_ns / 1e6)


def _apart(intervals_ns: Sequence[int]) -> Apart | None:
    if not intervals_ns:
        return None
    ranked = sorted(intervals_ns)
    p99 = ranked[-(-99 * len(ranked) // 100) - 1]
    return Apart(ranked[(len(ranked) - 1) // 2] / 1e6, p99 / 1e6, ranked[-1] / 1e6)
