"""Samples of single frames and fingers: where the cursors are, how they move, and how close two may come."""

from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from itertools import groupby
from math import hypot, sqrt

import numpy as np

from touchd.lab.scoring.matching import Match, Place, ScoredFrame

SLOW_MM_S = 500.0
LAG_FROM_MM_S, LAG_TO_MM_S = 300.0, 900.0
_STILL_MM_S = 10.0
_REST_S, _SETTLED_AFTER_S = 1.0, 0.3
_PINCH_MM, _LOW_MM = 120.0, 20.0
_LANDED_S = 0.1


def touching_matches(frames: Sequence[ScoredFrame]) -> Iterator[Match]:
    """Yield what stands for a finger that touches inside the area, frame by frame."""
    for frame in frames:
        yield from frame.contacts()


def errors_mm(frames: Sequence[ScoredFrame]) -> Iterator[float]:
    """Yield the distance between cursor and touch point for fingers slower than 500 mm/s."""
    for match in touching_matches(frames):
        if match.place.speed_mm_s < SLOW_MM_S:
            yield hypot(match.dx_mm, match.dy_mm)


def lags_ms(frames: Sequence[ScoredFrame]) -> Iterator[float]:
    """Yield how long ago a finger at 300 to 900 mm/s was where its cursor is, counted along its path alone.

    With e the cursor's place minus the finger's and v the finger's velocity: −e·v / |v|². A cursor that lies off by the
    same way in whatever direction the finger moves has no part in the mean over all directions.
    """
    for match in touching_matches(frames):
        place = match.place
        if LAG_FROM_MM_S <= place.speed_mm_s <= LAG_TO_MM_S:
            along = match.dx_mm * place.vx_mm_s + match.dy_mm * place.vy_mm_s
            yield -1000.0 * along / place.speed_mm_s**2


def wobbles_mm(frames: Sequence[ScoredFrame]) -> Iterator[float]:
    """Yield for each rest of a touching finger the standard deviation of its cursor in the plane, √(σx² + σy²).

    A rest is a second or more at less than 10 mm/s with a cursor in every frame; its first 0.3 s are left out. What
    the finger itself moves is taken off.
    """
    for run in _rests(frames):
        settled = [(m.dx_mm, m.dy_mm) for t_s, m in run if t_s - run[0][0] >= _SETTLED_AFTER_S]
        yield sqrt(float(np.var(np.array(settled), axis=0).sum()))


def _rests(frames: Sequence[ScoredFrame]) -> Iterator[list[tuple[float, Match]]]:
    still = [
        (match.place.tip.touch, at, match)
        for at, frame in enumerate(frames)
        for match in frame.matches
        if match.place.tip.touching and match.place.speed_mm_s < _STILL_MM_S
    ]
    in_order = sorted(still, key=lambda sample: sample[:2])
    # Consecutive frames of one touch have the same number minus rank.
    for _, group in groupby(enumerate(in_order), key=lambda item: (item[1][0], item[1][1] - item[0])):
        run = [(frames[at].t_s, match) for _, (_, at, match) in group]
        if run[-1][0] - run[0][0] >= _REST_S:
            yield run


def gaps_mm(frames: Sequence[ScoredFrame], hidden: AbstractSet[int]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the distances of two touching fingers of one hand: where each has a cursor, and where not.

    Only frames in which exactly these two touch, less than 120 mm apart and at under 500 mm/s, and no other fingertip
    is within 20 mm of the surface. Touches whose fingertip is ``hidden`` (their numbers), and the first 0.1 s of any,
    do not tell how near two may come: whether and how soon they are found is other figures' business.
    """
    resolved: list[float] = []
    unresolved: list[float] = []
    landed_s: dict[int, float] = {}
    for frame in frames:
        for place in frame.places:
            if place.tip.touching:
                landed_s.setdefault(place.tip.touch, frame.t_s)
        down = [place for place in frame.places if place.tip.clearance_mm < _LOW_MM]
        if not _is_pinch(down):
            continue
        a, b = (place.tip for place in down)
        if a.touch in hidden or b.touch in hidden:
            continue
        if frame.t_s - max(landed_s[a.touch], landed_s[b.touch]) < _LANDED_S:
            continue
        stood_for = {match.place.tip.touch for match in frame.matches}
        into = resolved if {a.touch, b.touch} <= stood_for else unresolved
        into.append(hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm))
    return tuple(resolved), tuple(unresolved)


def _is_pinch(down: Sequence[Place]) -> bool:
    if len(down) != 2 or any(place.speed_mm_s >= SLOW_MM_S for place in down):
        return False
    if not all(place.tip.touching and place.tip.inside for place in down):
        return False
    a, b = (place.tip for place in down)
    return a.hand == b.hand and hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm) < _PINCH_MM
