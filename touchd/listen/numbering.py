"""What a frame number says: the next frame, a part of the same, one that the network held up, or a sender begun anew.

Real clients drop frames of up to 100 numbers below the last one and take those further below for a new run.
"""

from collections import deque
from dataclasses import dataclass, replace
from enum import Enum, auto

from touchd.listen.rules import FSEQ_APART, FSEQ_BACK, FSEQ_FAR_BACK, FSEQ_NEGATIVE, Breach, Rule

REDUNDANT = -1
DROPPED_BELOW = 100
_EVIDENCE = 3  # frames in a row before a step back is no accident of the network
_MOST_LOST = 1000  # a longer gap is a new run, or the numbers mean something else
_HALF_THE_RANGE = 2**30
_FSEQ_MAX = 2**31 - 1


class Standing(Enum):
    """How a frame number stands to those before it."""

    NEXT = auto()
    SAME = auto()
    REDUNDANT = auto()
    BEHIND = auto()  # too late to count: clients drop it
    RESTARTED = auto()


@dataclass(frozen=True, slots=True)
class Judged:
    """A judgement; ``excused`` where lost datagrams may explain what seems wrong in the frame."""

    standing: Standing
    excused: bool = False
    breaches: tuple[Breach, ...] = ()


_BEHIND = Judged(Standing.BEHIND)


class Counter:
    """One counter of frames as it arrives."""

    def __init__(self) -> None:
        self.lost = 0
        self.late = 0
        self.last: int | None = None
        self._first = 0
        self._seen: deque[int] = deque(maxlen=2 * DROPPED_BELOW)
        self._frames = 0
        self._gaps = 0
        self._below: list[int] = []

    def is_behind(self, fseq: int) -> bool:
        """Return whether ``fseq`` is a step back, the wrap at 2**31 aside."""
        return self.last is not None and 0 < self.last - fseq < _HALF_THE_RANGE

    def judge(self, fseq: int) -> Judged:
        """Judge a frame's number from 0 up and remember it."""
        if self.last is None:
            return self._begin(fseq, Judged(Standing.NEXT))
        if self.is_behind(fseq):
            return self._step_back(self.last, fseq)
        self._below.clear()
        if fseq == self.last:
            return Judged(Standing.SAME)
        skipped = (fseq - self.last) % _FSEQ_MAX - 1
        self.last = fseq
        self._seen.append(fseq)
        self._frames += 1
        return Judged(Standing.NEXT, excused=self._explained(skipped))

    def _begin(self, fseq: int, judged: Judged) -> Judged:
        self.last = self._first = fseq
        self._seen.clear()
        self._seen.append(fseq)
        self._below.clear()
        return judged

    def _explained(self, skipped: int) -> bool:
        """Return whether this gap may be loss. One at more than every other frame is the sender's habit."""
        if skipped < 1:
            return False
        if skipped > _MOST_LOST:
            return True
        self._gaps += 1
        self.lost += skipped
        return 2 * self._gaps <= self._frames

    def _step_back(self, last: int, fseq: int) -> Judged:
        back = last - fseq
        if back > DROPPED_BELOW:
            return self._begin(fseq, _restarted(FSEQ_FAR_BACK, last, fseq, fseq))
        if fseq > self._first and fseq not in self._seen:
            self._seen.append(fseq)
            self.late += 1
            self.lost = max(0, self.lost - 1)
            return _BEHIND
        if fseq not in self._below:
            self._below.append(fseq)
        if len(self._below) < _EVIDENCE:
            return _BEHIND
        return self._begin(fseq, _restarted(FSEQ_BACK, last, self._below[0], fseq))


def _restarted(rule: Rule, last: int, first: int, fseq: int) -> Judged:
    breach = Breach(rule, f"fseq went back from {last} to {first} and counts on from there", fseq)
    return Judged(Standing.RESTARTED, excused=True, breaches=(breach,))


class FrameNumbers:
    """All numbers of one sender: one counter for every profile, until it shows that it keeps one for each."""

    def __init__(self) -> None:
        self._shared = Counter()
        self._apart: dict[str, Counter] = {}
        self._own_last: dict[str, int] = {}
        self._behind: dict[str, int] = {}
        self._missed: set[str] = set()  # profiles of which a frame may have been lost

    @property
    def lost(self) -> int:
        """How many numbers are missing, as far as loss may explain them."""
        return self._shared.lost + sum(counter.lost for counter in self._apart.values())

    @property
    def late(self) -> int:
        """How many frames came after a later one."""
        return self._shared.late + sum(counter.late for counter in self._apart.values())

    def judge(self, profile: str, fseq: int) -> Judged:
        """Judge the number of a frame of ``profile``."""
        if fseq < 0:
            wrong = (Breach(FSEQ_NEGATIVE, f"fseq is {fseq}", fseq),) if fseq != REDUNDANT else ()
            return Judged(Standing.REDUNDANT, breaches=wrong)
        if self._apart:
            return self._apart.setdefault(profile, Counter()).judge(fseq)
        own_last = self._own_last.get(profile)
        self._own_last[profile] = fseq
        if len(self._own_last) == 1 or not self._goes_its_own_way(fseq, own_last):
            self._behind[profile] = 0
            return self._for_all(profile, self._shared.judge(fseq))
        self._behind[profile] = self._behind.get(profile, 0) + 1
        return _BEHIND if self._behind[profile] < _EVIDENCE else self._part(profile, fseq)

    def _for_all(self, profile: str, judged: Judged) -> Judged:
        """Return ``judged``, excused also where the lost frame may have been another profile's."""
        if judged.excused:
            self._missed = set(self._own_last)
        excused = judged.excused or profile in self._missed
        self._missed.discard(profile)
        return replace(judged, excused=excused)

    def _goes_its_own_way(self, fseq: int, own_last: int | None) -> bool:
        rises = own_last is None or 0 < fseq - own_last <= DROPPED_BELOW
        return rises and self._shared.is_behind(fseq)

    def _part(self, profile: str, fseq: int) -> Judged:
        self._apart = {each: Counter() for each in self._own_last}
        for each, last in self._own_last.items():
            self._apart[each].judge(last)
        found = f"{profile} counts its own frames: fseq {fseq} follows fseq {self._shared.last} of another profile"
        return Judged(Standing.NEXT, excused=True, breaches=(Breach(FSEQ_APART, found, fseq),))
