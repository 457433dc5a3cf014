"""What a soak measured, and what of it is wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

_MAY_GROW_BYTES = 3_000_000  # what malloc was seen to keep in one half of ten minutes and not in the other: 1.2 MB


@dataclass(frozen=True, slots=True)
class Sample:
    """How things stood at one time of the day, with the same outputs each time and nothing under way."""

    hours: float
    resident_bytes: int
    threads: int
    descriptors: int
    fseq: int
    session_id: int
    touches: int
    frames_a_second: float  # since the last sample

    def line(self) -> str:
        """Return the sample for people, under :data:`HEADING`."""
        return (
            f"{self.hours:6.2f} {self.resident_bytes / 1e6:12.2f} {self.threads:8d} {self.descriptors:5d}"
            f"{self.fseq:12d} {self.session_id:12d} {self.touches:9d} {self.frames_a_second:9.0f}"
        )


HEADING = " hours  resident MB  threads   fds        fseq   session id   touches  frames/s"


def leaks(samples: Sequence[Sample]) -> list[str]:
    """Return a sentence for each thing that was not flat from the first of at least two samples on.

    Memory is compared by its least in either half of the day, as malloc now and then keeps some MB for an hour. So
    what grows steadily by twice the limit is found.
    """
    half = len(samples) // 2
    early, late = (min(sample.resident_bytes for sample in part) for part in (samples[:half], samples[-half:]))
    found = []
    if late - early > _MAY_GROW_BYTES:
        found.append(
            f"resident memory grew from {early / 1e6:.2f} MB, its least in the first half, to {late / 1e6:.2f} MB in "
            f"the second; it may by {_MAY_GROW_BYTES / 1e6:.0f} MB"
        )
    for what, counts in (
        ("threads", [sample.threads for sample in samples]),
        ("file descriptors", [sample.descriptors for sample in samples]),
    ):
        if len(set(counts)) > 1:
            found.append(f"the number of {what} changed: {', '.join(map(str, counts))}")
    return found
