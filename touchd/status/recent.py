"""How much counters have risen lately: a counter that rose long ago is no trouble of today."""

import threading
from collections import deque


class RecentRise:
    """Remembers counters by name for a while; noted about once a second, from any thread.

    Times are of any steady clock; give them in order.
    """

    def __init__(self, window_s: float = 60.0, samples: int = 60) -> None:
        """Divide the window into ``samples`` steps."""
        self._window_s = window_s
        self._step_s = window_s / samples
        self._seen: dict[str, deque[tuple[float, int]]] = {}
        self._noting = threading.Lock()

    def note(self, name: str, count: int, now_s: float) -> int:
        """Take note of a counter, and return by how much it has risen in the last ``window_s``.

        Before the first note it was 0. A counter that has fallen was begun anew, from 0.
        """
        with self._noting:
            seen = self._seen.setdefault(name, deque([(now_s, 0)]))
            if count < seen[-1][1]:
                seen.clear()
                seen.append((now_s, 0))
            while len(seen) > 1 and now_s - seen[1][0] >= self._window_s:
                seen.popleft()
            if now_s - seen[-1][0] >= self._step_s:
                seen.append((now_s, count))
            return count - seen[0][1]
