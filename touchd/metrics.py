"""How fast the worker is: frames a second, and the time from a frame's arrival to its results being handed over."""

import math
from collections import deque
from dataclasses import dataclass

_WINDOW = 300  # frames that figures are taken over: ten seconds at 30 Hz


@dataclass(frozen=True, slots=True)
class MetricsSnapshot:
    """Figures over the last ten seconds or so; None where no frame came in that time."""

    frames: int  # since the start
    dropped: int  # frames that came faster than they could be worked on, since the start
    fps: float | None
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    latency_max_ms: float | None


class FrameMetrics:
    """Noted on the worker thread, read from any other."""

    def __init__(self) -> None:
        self._frames = 0
        self._recent: deque[tuple[int, int]] = deque(maxlen=_WINDOW)

    @property
    def frames(self) -> int:
        """How many frames were noted."""
        return self._frames

    def note(self, arrived_ns: int, done_ns: int) -> None:
        """Note a frame by the monotonic times of its arrival and of its results' being handed over."""
        self._frames += 1
        self._recent.append((arrived_ns, done_ns))

    def idle_s(self, now_ns: int) -> float:
        """Return how long ago the last frame arrived; endless if none ever did."""
        return (now_ns - self._recent[-1][0]) / 1e9 if self._recent else math.inf

    def snapshot(self, now_ns: int, dropped: int, window_ns: int = 10_000_000_000) -> MetricsSnapshot:
        """Return the figures of the frames that arrived in the last ``window_ns``."""
        recent = [pair for pair in tuple(self._recent) if now_ns - pair[0] <= window_ns]
        if not recent:
            return MetricsSnapshot(self._frames, dropped, None, None, None, None)
        latencies = sorted((done - arrived) / 1e6 for arrived, done in recent)
        span_s = (recent[-1][0] - recent[0][0]) / 1e9
        return MetricsSnapshot(
            frames=self._frames,
            dropped=dropped,
            fps=(len(recent) - 1) / span_s if span_s > 0.0 else None,
            latency_p50_ms=latencies[len(latencies) // 2],
            latency_p99_ms=latencies[min(len(latencies) - 1, len(latencies) * 99 // 100)],
            latency_max_ms=latencies[-1],
        )
