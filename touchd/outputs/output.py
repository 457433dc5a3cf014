"""What the daemon drives: an output takes each frame, never blocks for long, and never stops the daemon."""

from dataclasses import dataclass
from typing import Protocol

from touchd.model import TouchFrame


@dataclass(frozen=True, slots=True)
class OutputStatus:
    """How an output fares since it was made; ``sent`` and the like count datagrams or lines."""

    name: str
    sent: int
    failed: int  # tried and refused by the system
    dropped: int  # not tried, for want of room
    last_error: str | None


class Output(Protocol):
    """An output of touch frames. All calls but ``status`` come from the worker's thread.

    ``now_ns`` is the monotonic time of the call, so that an output needs no clock.
    """

    def start(self) -> None:
        """Begin; the first call. Does not raise for what may yet come right."""

    def publish(self, frame: TouchFrame, now_ns: int, /) -> None:
        """Take a frame. Neither blocks nor raises."""

    def tick(self, now_ns: int, /) -> None:
        """Do what is due while no frames come. Neither blocks nor raises."""

    def close(self) -> None:
        """End every touch and let go of everything; the last call. Does not raise."""

    def status(self) -> OutputStatus:
        """Return the counters; may be called from any thread, before and after all else."""
