"""The cursors of one profile of one sender, from frame to frame: what clients are told of them, and what breaks."""

import math
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from enum import StrEnum

from touchd.listen.frame import Frame
from touchd.listen.messages import Part, Placed, Profile
from touchd.listen.numbering import Judged, Standing
from touchd.listen.rules import (
    CHANGES_ONLY,
    FLICKER,
    FSEQ_NEWS,
    FSEQ_STANDS,
    LATE_JOINER,
    PHANTOM,
    REUSED_ID,
    STALE_VELOCITY,
    Breach,
)

_MOST_ENDED = 10_000  # session ids remembered after their end
_FLICKER_FRAMES = 2
_SAME_PLACE = 0.01  # of the area
_AT_REST_NS = 500_000_000
_OFTEN = 3  # frames: once may be an accident


class Change(StrEnum):
    """What happens to a cursor, as a client sees it."""

    ADD = "add"
    MOVE = "move"
    REMOVE = "remove"


@dataclass(frozen=True, slots=True)
class CursorEvent:
    """A change of a cursor; x and y are None where the sender told no position, z in a flat profile as well."""

    change: Change
    noun: str
    session_id: int
    x: float | None
    y: float | None
    z: float | None = None


@dataclass(slots=True)
class _Track:
    """What was last set of a living cursor; ``placed`` is None until the first set."""

    placed: Placed | None
    moved_ns: int


class Cursors:
    """Follows the living cursors. A frame is judged when the next one begins, as it may come in several parts."""

    def __init__(self, profile: Profile) -> None:
        self._noun = profile.noun
        self._shown: dict[int, Placed | None] = {}
        self._tracks: dict[int, _Track] = {}
        self._ended: dict[int, None] = {}
        self._gone: list[tuple[int, int, Placed]] = []  # in which frame, which cursor, where
        self._frame: Frame | None = None
        self._frames = 0
        self._joined = False
        self._from_before: set[int] = set()  # alive, but not set, when we began to listen
        self._splits = False
        self._grows = False
        self._partial = 0
        self._repeats = 0

    @property
    def alive(self) -> AbstractSet[int]:
        """The session ids that a client holds now."""
        return self._shown.keys()

    @property
    def repeats_still_ones(self) -> bool:
        """Whether the sender keeps setting cursors that rest: one that falls silent has then stalled."""
        return self._repeats >= _OFTEN

    def take(self, part: Part, judged: Judged, t_ns: int) -> Iterator[Breach | CursorEvent]:
        """Take a part that clients do not drop, and yield what comes of it and of frames that it ends."""
        if judged.standing is Standing.RESTARTED:
            self._frame = None
            self._tracks.clear()
        elif self._frame is not None and self._frame.fseq == part.fseq and not self._frame.is_over_at(part):
            self._frame.add(part)
            yield from self._show(part)
            return
        elif self._frame is not None and self._frame.fseq == part.fseq:
            yield Breach(FSEQ_STANDS, f"fseq is {part.fseq} again in a new frame", part.fseq)
        yield from self.close()
        if judged.standing is Standing.REDUNDANT:
            yield from self._check_redundant(part)
        self._frame = Frame(part, judged.excused, t_ns)
        yield from self._show(part)
        if judged.standing is Standing.REDUNDANT:
            yield from self.close()
            if not part.alive:
                self._gone.clear()  # ended on purpose: what comes at the same place is a new touch

    def close(self) -> Iterator[Breach]:
        """End the frame that is under way, and yield what is wrong in it as a whole."""
        frame = self._frame
        if frame is None:
            return
        self._frame = None
        self._frames += 1
        known = self._tracks.keys()
        yield from self._check_split(frame)
        yield from self._check_unset(frame, frame.alive - known - frame.placed.keys())
        if not frame.excused:
            yield from self._check_born(frame, frame.alive - known)
        self._end(known - frame.alive)
        yield from self._follow(frame)
        self._joined = True

    def _show(self, part: Part) -> Iterator[CursorEvent]:
        """Yield what a client makes of the part at once."""
        alive = set(part.alive)
        for session_id in sorted(self._shown.keys() - alive):
            last = self._shown.pop(session_id)
            yield self._event(Change.REMOVE, session_id, last)
        for session_id in sorted(alive - self._shown.keys()):
            self._shown[session_id] = placed = part.sets.get(session_id)
            yield self._event(Change.ADD, session_id, placed)
        for session_id, placed in part.sets.items():
            if session_id in alive and self._shown[session_id] != placed:
                self._shown[session_id] = placed
                yield self._event(Change.MOVE, session_id, placed)

    def _event(self, change: Change, session_id: int, placed: Placed | None) -> CursorEvent:
        if placed is None:
            return CursorEvent(change, self._noun, session_id, None, None)
        return CursorEvent(change, self._noun, session_id, placed.x, placed.y, placed.z)

    def _check_redundant(self, part: Part) -> Iterator[Breach]:
        news = sorted(set(part.alive) ^ self._tracks.keys())
        if part.alive and news and self._joined:
            verb = "begins" if news[0] in part.alive else "ends"
            yield Breach(FSEQ_NEWS, f"{self._noun} {news[0]} {verb} in a bundle with fseq -1", part.fseq)

    def _check_split(self, frame: Frame) -> Iterator[Breach]:
        self._splits = self._splits or frame.is_split
        self._grows = self._grows or frame.grows
        breach = frame.left_out()
        if breach is None and self._joined and not self._grows:
            breach = frame.listed_early(self._tracks.keys())
        if breach is not None:
            yield breach

    def _check_unset(self, frame: Frame, unset: set[int]) -> Iterator[Breach]:
        """Yield a breach for a cursor that begins without a set, unless a lost datagram may have had it.

        The loss of a part of a split frame leaves no gap in fseq, so a sender that splits is not held to this.
        """
        if not unset or frame.excused:
            return
        if not self._joined:
            self._from_before = unset
        elif not self._splits:
            yield Breach(PHANTOM, f"{self._noun} {min(unset)} is listed as alive but was never set", frame.fseq)

    def _check_born(self, frame: Frame, born: set[int]) -> Iterator[Breach]:
        self._gone = [each for each in self._gone if each[0] >= self._frames - _FLICKER_FRAMES]
        leaving = [(self._frames, i, t.placed) for i, t in self._tracks.items() if i not in frame.alive and t.placed]
        for session_id in sorted(born):
            if session_id in self._ended:
                yield Breach(REUSED_ID, f"{self._noun} {session_id} begins again after its end", frame.fseq)
            placed = frame.placed.get(session_id)
            for _, other, where in [*self._gone, *leaving]:
                if placed is not None and other != session_id and _near(placed, where):
                    found = f"{self._noun} {other} ended and began again as {session_id} at the same place"
                    yield Breach(FLICKER, found, frame.fseq)

    def _end(self, ended: set[int]) -> None:
        for session_id in ended:
            placed = self._tracks.pop(session_id).placed
            self._ended[session_id] = None
            if placed is not None:
                self._gone.append((self._frames, session_id, placed))
        while len(self._ended) > _MOST_ENDED:
            del self._ended[next(iter(self._ended))]

    def _follow(self, frame: Frame) -> Iterator[Breach]:
        """Take over what was set, and yield what is fragile in how it is told."""
        still_unset = (self._from_before & frame.alive) - frame.placed.keys()
        if self._joined and still_unset:
            yield Breach(LATE_JOINER, f"{self._noun} {min(still_unset)} lives from before and is not set", frame.fseq)
        self._from_before = still_unset
        untold = self._tracks.keys() - frame.placed.keys()
        if untold and not (frame.excused or self._splits):
            self._partial += 1
            if self._partial >= _OFTEN:
                yield Breach(CHANGES_ONLY, f"{self._noun} {min(untold)} lives but is not set", frame.fseq)
        for session_id in frame.alive:
            placed = frame.placed.get(session_id)
            track = self._tracks.setdefault(session_id, _Track(None, frame.t_ns))
            if placed is not None:
                if track.placed is not None and _place(track.placed) == _place(placed):
                    self._repeats += 1
                else:
                    track.moved_ns = frame.t_ns
                track.placed = placed
            if track.placed is not None and track.placed.speed > 0.0 and frame.t_ns - track.moved_ns >= _AT_REST_NS:
                found = f"{self._noun} {session_id} has rested for {(frame.t_ns - track.moved_ns) / 1e9:.1f} s"
                yield Breach(STALE_VELOCITY, f"{found} with a velocity of {track.placed.speed:.3g}", frame.fseq)


def _place(placed: Placed) -> tuple[float | None, ...]:
    return placed.x, placed.y, placed.z


def _near(a: Placed, b: Placed) -> bool:
    return math.hypot(a.x - b.x, a.y - b.y) <= _SAME_PLACE
