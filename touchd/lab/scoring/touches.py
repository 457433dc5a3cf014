"""True touches and cursors over time, and which cursors were made for which touches."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from touchd.lab.scoring.events import Pair
from touchd.lab.scoring.matching import Match, ScoredFrame
from touchd.lab.scoring.truth import Tip

# A cursor that comes this long before a touch, or stays this long after it, still was made for it.
AROUND_S = 0.1
LATE_S = 0.05
_LET_GO_S = 0.2  # one that stands for a finger that holds a thing is gone so soon after it let go and rises


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """A true touch; frames are positions in the list of scored frames.

    ``first`` and ``last``: the frames between which it touches inside the area; ``touching``: in how many it does so.
    ``place_mm``: where it begins; ``raised``: on something, higher than the table.
    """

    number: int
    finger: tuple[int, int]  # hand, finger
    first: int
    last: int
    touching: int
    place_mm: Pair
    raised: bool


@dataclass(frozen=True, slots=True)
class Sighting:
    """A cursor that stood for a touch in a frame, from 100 ms before it touched to 100 ms after."""

    at: int
    cursor: int


@dataclass(frozen=True, slots=True)
class Life:
    """A cursor's first and last frame, and the touch for which it was made: the first that it stood for, or None.

    ``place_mm``: where it was in its first frame.
    """

    born: int
    ended: int
    made_for: int | None
    place_mm: Pair


def true_touches(frames: Sequence[ScoredFrame]) -> dict[int, TrueTouch]:
    """Return by number the touches that touch inside the area in at least one frame.

    A touch too short for the camera to see it touching is none: no program could be asked to find it. Nor is one during
    which the camera was knocked or blind.
    """
    seen: dict[int, list[int]] = {}
    begins: dict[int, Tip] = {}
    upset: set[int] = set()
    for at, frame in enumerate(frames):
        for place in frame.places:
            tip = place.tip
            if tip.touch > 0 and tip.touching and tip.inside:
                seen.setdefault(tip.touch, []).append(at)
                begins.setdefault(tip.touch, tip)
                upset |= {tip.touch} if frame.upset is not None else set()
    return {n: _true_touch(begins[n], ats) for n, ats in seen.items() if n not in upset}


def _true_touch(tip: Tip, ats: Sequence[int]) -> TrueTouch:
    """Return a touch from how it begins and the frames in which it touches inside the area."""
    place_mm = tip.x_mm, tip.y_mm
    return TrueTouch(tip.touch, (tip.hand, tip.finger), ats[0], ats[-1], len(ats), place_mm, tip.z_mm > 0.0)


def sightings(frames: Sequence[ScoredFrame], touches: Mapping[int, TrueTouch]) -> dict[int, list[Sighting]]:
    """Return for each touch, frame by frame, the cursor that stood for it."""
    found: dict[int, list[Sighting]] = {number: [] for number in touches}
    for at, frame in enumerate(frames):
        for match in frame.matches:
            touch = _touch_around(frames, at, match, touches)
            if touch:
                found[touch.number].append(Sighting(at, match.cursor))
    return found


def _touch_around(
    frames: Sequence[ScoredFrame], at: int, match: Match, touches: Mapping[int, TrueTouch]
) -> TrueTouch | None:
    """Return the touch that a cursor's finger makes in a frame, or has just made, or soon makes.

    In the air that is the finger's touch of the last 50 ms, else the one that is nearest in time within 100 ms.
    """
    tip = match.place.tip
    if tip.touching:
        return touches.get(tip.touch)
    near = [
        (_away_s(frames, at, touch), touch.number)
        for touch in touches.values()
        if touch.finger == _finger(match) or touch.number == tip.touch
    ]
    away_s, number = min(near, default=(AROUND_S + 1.0, 0))
    return touches[number] if away_s <= AROUND_S else None


def _away_s(frames: Sequence[ScoredFrame], at: int, touch: TrueTouch) -> float:
    """Return how long a touch is over or yet to come; 0 while it lasts, and for 50 ms, in which a program may be late.

    Quick taps follow each other within 100 ms, and a cursor just after one is late, not early for the next.
    """
    now_s, lifted_s = frames[at].t_s, frames[touch.last].t_s
    if lifted_s <= now_s <= lifted_s + LATE_S:
        return 0.0
    return max(frames[touch.first].t_s - now_s, now_s - lifted_s, 0.0)


def _finger(match: Match) -> tuple[int, int]:
    return match.place.tip.hand, match.place.tip.finger


def lives(frames: Sequence[ScoredFrame], seen: Mapping[int, Sequence[Sighting]]) -> dict[int, Life]:
    """Return each cursor's life, by its id."""
    alive: dict[int, list[int]] = {}
    for at, frame in enumerate(frames):
        for cursor in frame.cursors:
            alive.setdefault(cursor, [at, at])[1] = at
    earliest = sorted((s.at, number, s.cursor) for number, own in seen.items() for s in own)
    made_for: dict[int, int] = {}
    for _, number, cursor in earliest:
        made_for.setdefault(cursor, number)
    return {
        cursor: Life(born, ended, made_for.get(cursor), frames[born].cursors[cursor])
        for cursor, (born, ended) in sorted(alive.items())
    }


def is_false(frames: Sequence[ScoredFrame], cursor: int, life: Life) -> bool:
    """Return whether a cursor never stood for a touch, nor for a finger that touches beside the area.

    One that stands for a finger that holds a thing is not false if it goes when the hand does.
    """
    if life.made_for is not None:
        return False
    stood_for = {at: match_of(frames[at], cursor) for at in range(life.born, life.ended + 1)}
    tips = {at: match.place.tip for at, match in stood_for.items() if match is not None}
    held = max((at for at, tip in tips.items() if tip.either), default=None)
    if held is not None and frames[life.ended].t_s - frames[held].t_s <= _LET_GO_S:
        return False
    return not any(tip.touching for tip in tips.values())


def fired_mm(frames: Sequence[ScoredFrame], cursors: Mapping[int, Life]) -> Iterator[float]:
    """Yield the clearance of the finger under each cursor in the cursor's first frame."""
    for cursor, life in cursors.items():
        match = match_of(frames[life.born], cursor)
        if match:
            yield match.place.tip.clearance_mm


def released_mm(frames: Sequence[ScoredFrame], cursors: Mapping[int, Life]) -> Iterator[float]:
    """Yield the clearance of the finger under each cursor in the first frame without it, unless it touches there."""
    for cursor, life in cursors.items():
        match = match_of(frames[life.ended], cursor)
        if match and life.ended + 1 < len(frames):
            tip = match.place.tip
            later = (
                p.tip for p in frames[life.ended + 1].places if (p.tip.hand, p.tip.finger) == (tip.hand, tip.finger)
            )
            yield from (each.clearance_mm for each in later if not each.touching)


def match_of(frame: ScoredFrame, cursor: int) -> Match | None:
    """Return what a cursor stood for in a frame."""
    return next((match for match in frame.matches if match.cursor == cursor), None)
