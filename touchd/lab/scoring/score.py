"""The score of a run: counts and samples, which add up over runs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from itertools import dropwhile, pairwise
from typing import Any, TypeAlias, TypeVar

from touchd.lab.scoring.events import SeenFrame
from touchd.lab.scoring.hovering import HoverScore, hover_score
from touchd.lab.scoring.matching import ScoredFrame, matched_frames
from touchd.lab.scoring.owners import OwnerScore, owner_score
from touchd.lab.scoring.rests import ThingScore, thing_score
from touchd.lab.scoring.touches import (
    Life,
    Sighting,
    TrueTouch,
    fired_mm,
    is_false,
    lives,
    match_of,
    released_mm,
    sightings,
    true_touches,
)
from touchd.lab.scoring.truth import Truth
from touchd.lab.scoring.upset import UpsetScore, upset_score
from touchd.lab.scoring.ways import errors_mm, gaps_mm, lags_ms, wobbles_mm

Samples: TypeAlias = tuple[float, ...]
Kind = TypeVar("Kind")

# A touch is found if a cursor is on it in half as many frames as it touches, counted to this long after the lift.
_LATE_S = 0.07
_PLAIN_SIGHT = 0.9  # of a fingertip's side towards the camera


@dataclass(frozen=True, slots=True)
class Score:
    """What happened to the true touches of a run, and what was there beside them.

    - ``touches``: true touches that the camera saw touching inside the area. ``found``: those that a cursor of their
      own stood for, in at least half as many frames as they touch, counted from 100 ms before to 70 ms after the touch.
      ``merged``: those whose cursor was made for an earlier touch: to a client the two are one.
    - ``free``: of all touches those whose fingertip is known to be in plain sight, ``found_free``: of those the found,
      ``switched_free``: and how often they went on under another id.
    - ``splits``: how often a touch went on under a new id; ``swaps``: under one that was made for another finger.
    - ``false_touches``: cursors that never stood for a touching finger, nor within 100 ms of its touch.
    - ``errors_mm``: distance between cursor and touch point, for each frame of a touching finger slower than 500 mm/s.
    - ``lags_ms``: how far the cursor lies behind along the path, over the finger's speed; each frame at 300–900 mm/s.
    - ``wobbles_mm``: for each finger that rests for a second or more, the standard deviation of its cursor.
    - ``fired_mm``, ``released_mm``: clearance of the finger under a cursor in the cursor's first frame, and in the
      first frame after its last one (none where the finger still touches: that shows as a split or a loss).
    - ``down_frames``, ``lift_frames``: frames from the first one of a found touch to its first cursor's, and from the
      last one to its last cursor's; below 0 where the cursor was earlier.
    - ``resolved_gaps_mm``, ``unresolved_gaps_mm``: where exactly two fingers touch, both of one hand and neither known
      to be hidden: their distance in frames with a cursor for each, and in the others.
    - ``upset``, ``things``, ``owners``, ``hovering``: what happened besides; none of it counts where nothing tells it.
    """

    touches: int = 0
    found: int = 0
    merged: int = 0
    free: int = 0
    found_free: int = 0
    switched_free: int = 0
    splits: int = 0
    swaps: int = 0
    false_touches: int = 0
    tracked_s: float = 0.0
    errors_mm: Samples = ()
    lags_ms: Samples = ()
    wobbles_mm: Samples = ()
    fired_mm: Samples = ()
    released_mm: Samples = ()
    down_frames: Samples = ()
    lift_frames: Samples = ()
    resolved_gaps_mm: Samples = ()
    unresolved_gaps_mm: Samples = ()
    upset: UpsetScore = field(default_factory=UpsetScore)
    things: ThingScore = field(default_factory=ThingScore)
    owners: OwnerScore = field(default_factory=OwnerScore)
    hovering: HoverScore = field(default_factory=HoverScore)


def pooled(scores: Iterable[Score]) -> Score:
    """Return the score of all runs as one."""
    return _pooled(Score, list(scores))


def _pooled(kind: type[Kind], scores: Sequence[Kind]) -> Kind:
    """Return the sum of scores of a kind, with the samples of all, and the same of the scores within them."""
    total: dict[str, Any] = {}
    for name in (each.name for each in fields(kind)):  # type: ignore[arg-type]  # all kinds are dataclasses
        empty = getattr(kind(), name)
        values = [getattr(score_, name) for score_ in scores]
        if is_dataclass(empty):
            total[name] = _pooled(type(empty), values)
        elif isinstance(empty, tuple):
            total[name] = tuple(sample for samples in values for sample in samples)
        else:
            total[name] = sum(values, empty)
    return kind(**total)


def score(events: Sequence[SeenFrame], truth: Truth) -> Score:
    """Score events from their first tracked frame on. Raises RecordingError for frames that the truth has not."""
    frames = matched_frames(events, truth)
    touches = true_touches(frames)
    seen = sightings(frames, touches)
    cursors = lives(frames, seen)
    own = {number: _without_leftovers(number, seen[number], cursors) for number in touches}
    covered = {n for n, touch in touches.items() if _is_covered(frames, touch, seen[n])}
    found = {n for n, touch in touches.items() if _is_covered(frames, touch, own[n])}
    free = {n for n in touches if truth.visible.get(n, 0.0) >= _PLAIN_SIGHT}
    swaps = {n: list(_switches(own[n], cursors, touches, touches[n].finger)) for n in touches}
    false = [life for cursor, life in cursors.items() if is_false(frames, cursor, life)]
    hidden = {n for n in touches if truth.visible.get(n, 1.0) < _PLAIN_SIGHT}
    resolved, unresolved = gaps_mm(frames, hidden)
    return Score(
        touches=len(touches),
        found=len(found),
        merged=len(covered - found),
        free=len(free),
        found_free=len(free & found),
        switched_free=sum(len(swaps[n]) for n in free),
        splits=sum(each.count(False) for each in swaps.values()),
        swaps=sum(each.count(True) for each in swaps.values()),
        false_touches=len(false),
        tracked_s=_duration_s(frames),
        errors_mm=tuple(errors_mm(frames)),
        lags_ms=tuple(lags_ms(frames)),
        wobbles_mm=tuple(wobbles_mm(frames)),
        fired_mm=tuple(fired_mm(frames, cursors)),
        released_mm=tuple(released_mm(frames, cursors)),
        down_frames=tuple(float(cursors[own[n][0].cursor].born - touches[n].first) for n in sorted(found)),
        lift_frames=tuple(float(_end(frames, own[n][-1], cursors, n) - touches[n].last) for n in sorted(found)),
        resolved_gaps_mm=resolved,
        unresolved_gaps_mm=unresolved,
        upset=upset_score(frames, touches, cursors, found),
        things=thing_score(frames, touches, found, false),
        owners=owner_score(frames),
        hovering=hover_score(frames, touches, own, cursors, found),
    )


def _without_leftovers(number: int, seen: Sequence[Sighting], cursors: Mapping[int, Life]) -> list[Sighting]:
    """Return the sightings from the first cursor on that was made for this touch: before it, earlier ones linger."""
    return list(dropwhile(lambda sighting: cursors[sighting.cursor].made_for != number, seen))


def _is_covered(frames: Sequence[ScoredFrame], touch: TrueTouch, seen: Sequence[Sighting]) -> bool:
    until_s = frames[touch.last].t_s + _LATE_S
    in_time = sum(frames[sighting.at].t_s <= until_s for sighting in seen)
    return 2 * in_time >= touch.touching


def _switches(
    own: Sequence[Sighting], cursors: Mapping[int, Life], touches: Mapping[int, TrueTouch], finger: tuple[int, int]
) -> Iterator[bool]:
    """Yield for each change of a touch's cursor whether it was a swap: the new one was made for another finger."""
    for before, after in pairwise(own):
        if before.cursor != after.cursor:
            made_for = cursors[after.cursor].made_for
            yield made_for is not None and touches[made_for].finger != finger


def _end(frames: Sequence[ScoredFrame], last: Sighting, cursors: Mapping[int, Life], number: int) -> int:
    """Return a touch's last cursor's last frame, or the one before it went over to another touch."""
    for at in range(last.at, cursors[last.cursor].ended + 1):
        match = match_of(frames[at], last.cursor)
        if match and match.place.tip.touching and match.place.tip.touch != number:
            return at - 1
    return cursors[last.cursor].ended


def _duration_s(frames: Sequence[ScoredFrame]) -> float:
    """Return how long the frames last, the last one for as long as one does in the mean."""
    if len(frames) < 2:
        return 0.0
    return (frames[-1].t_s - frames[0].t_s) * len(frames) / (len(frames) - 1)
