"""Fingertips side by side: which are the same one, and which samples belong to which."""

from collections.abc import Sequence
from math import cos, sin
from sys import maxsize

import numpy as np

from touchd.contacts.tips import Tip
from touchd.model import Floats

_NEAR_MM = 50.0
_TWIN_MM, _ASIDE_MM = 16.0, 6.0  # one so near, and so little aside, is the same finger begun at another place

Places = Sequence[Sequence[float]]  # u and v, or x and y, of each


def close(places: Places, apart: float) -> bool:
    """Return whether any two of some points, of which there are few, are nearer than a limit."""
    limit = apart * apart
    for i, (u, v) in enumerate(places):
        for x, y in places[:i]:
            if (u - x) * (u - x) + (v - y) * (v - y) <= limit:
                return True
    return False


def distinct(places: Places, rank: Sequence[float], apart: float, most: int = maxsize) -> list[int]:
    """Return which of some points to keep, the higher ranked first, so that no two are nearer than a limit.

    ``most``: how many are kept at most.
    """
    limit = apart * apart
    kept: list[int] = []
    taken: list[Sequence[float]] = []
    for i in sorted(range(len(places)), key=rank.__getitem__, reverse=True):
        x, y = places[i]
        for u, v in taken:
            if (u - x) * (u - x) + (v - y) * (v - y) <= limit:
                break
        else:
            kept.append(i)
            taken.append(places[i])
        if len(kept) == most:
            break
    return kept


def paired(wanted: Places, places: Places, limit: float) -> dict[int, int]:
    """Return which of some points have which place of their own within a limit, the nearest pairs being made first."""
    squared = limit * limit
    near = sorted(
        [
            (distance, row, column)
            for row, (u, v) in enumerate(wanted)
            for column, (x, y) in enumerate(places)
            if (distance := (u - x) * (u - x) + (v - y) * (v - y)) < squared
        ]
    )
    pairs: dict[int, int] = {}
    for _, row, column in near:
        if row not in pairs and column not in pairs.values():
            pairs[row] = column
    return pairs


def owned_samples(tips: Sequence[Tip], places_mm: Floats) -> Floats:
    """Return 1 for the samples (N, S) that are nearer to their own finger's axis than to any other finger's, else 0.

    ``places_mm`` (N, 3, S): where the samples lie along and across their finger, and 1.
    """
    owned = np.ones((len(tips), places_mm.shape[2]), np.float32)
    pairs = [(one, other) for one, other in _pairs(tips) if not _are_twins(tips[one], tips[other])]
    if not pairs:
        return owned
    mine = [one for one, _ in pairs]
    along, across = places_mm[:, 0], places_mm[:, 1]
    own = _from_axis(along, across)[mine]
    turn = np.array([_way(tips[one], tips[other]) for one, other in pairs], np.float32)
    theirs = np.matmul(turn, places_mm[mine])
    lost = _from_axis(theirs[:, 0], theirs[:, 1]) < own
    for pair, one in enumerate(mine):
        owned[one][lost[pair]] = 0.0
    return owned


def _way(tip: Tip, other: Tip) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return what takes a tip's along, across and 1 to another one's along and across."""
    x_mm, y_mm = tip.guess.lay.on_surface(other.u - tip.u, other.v - tip.v)
    c, s = cos(tip.angle - other.angle), sin(tip.angle - other.angle)
    their_c, their_s = cos(other.angle), sin(other.angle)
    return (c, -s, -x_mm * their_c - y_mm * their_s), (s, c, x_mm * their_s - y_mm * their_c)


def _pairs(tips: Sequence[Tip]) -> list[tuple[int, int]]:
    """Return which tips have which others near them."""
    places = [(tip.u, tip.v) for tip in tips]
    pairs = []
    for one, (u, v) in enumerate(places):
        near = (_NEAR_MM / tips[one].guess.lay.pixel_mm) ** 2
        for other, (x, y) in enumerate(places):
            if other != one and (u - x) * (u - x) + (v - y) * (v - y) < near:
                pairs.append((one, other))
    return pairs


def _are_twins(tip: Tip, other: Tip) -> bool:
    """Return whether two tips, one before the other, are fitted to the same finger."""
    x_mm, y_mm = tip.guess.lay.on_surface(other.u - tip.u, other.v - tip.v)
    if x_mm * x_mm + y_mm * y_mm > _TWIN_MM * _TWIN_MM:
        return False
    return any(abs(y_mm * cos(angle) - x_mm * sin(angle)) < _ASIDE_MM for angle in (tip.angle, other.angle))


def _from_axis(along_mm: Floats, across_mm: Floats) -> Floats:
    """Return squared distances from the half line along >= 0, across = 0."""
    before = np.minimum(along_mm, 0.0)
    squared: Floats = before * before + across_mm * across_mm
    return squared
