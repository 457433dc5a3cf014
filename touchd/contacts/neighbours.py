"""Fingertips side by side: which are the same one, and which samples belong to which."""

from collections.abc import Iterator

import numpy as np

from touchd.contacts.fit import ANGLE, Bed, Tips
from touchd.model import Floats

_NEAR_MM = 50.0


def distinct(points_px: Floats, rank: Floats, apart_px: float) -> list[int]:
    """Return which of some points (N, 2) to keep, the higher ranked first, so that no two are nearer than a limit."""
    places = points_px.tolist()
    kept: list[int] = []
    limit = apart_px * apart_px
    # Plain Python: for a dozen points numpy's calls cost more than the sums.
    for i in np.argsort(-rank, kind="stable").tolist():
        x, y = places[i]
        if all((places[k][0] - x) ** 2 + (places[k][1] - y) ** 2 > limit for k in kept):
            kept.append(i)
    return kept


def owned_samples(tips: Tips, bed: Bed) -> Floats:
    """Return 1 for the samples (N, S) that are nearer to their own finger's axis than to any other's, else 0."""
    along, across = bed.places_mm[:, 0], bed.places_mm[:, 1]
    owned = np.ones(along.shape, np.float32)
    pairs = list(_pairs(tips.state[:, :2].tolist(), bed.lay.pixel_mm.tolist()))
    if not pairs:
        return owned
    one, other = (list(column) for column in zip(*pairs, strict=True))
    apart_px = tips.state[other, :2] - tips.state[one, :2]
    offset = np.linalg.solve(bed.lay.px_per_mm[one], apart_px[..., None])[..., 0]
    cos, sin = np.cos(tips.state[:, ANGLE, None]), np.sin(tips.state[:, ANGLE, None])
    x = along[one] * cos[one] - across[one] * sin[one] - offset[:, :1]
    y = along[one] * sin[one] + across[one] * cos[one] - offset[:, 1:]
    theirs = _from_axis(x * cos[other] + y * sin[other], y * cos[other] - x * sin[other])
    lost = theirs < _from_axis(along, across)[one]
    for pair, tip in enumerate(one):
        owned[tip][lost[pair]] = 0.0
    return owned


def _pairs(places: list[list[float]], pixel_mm: list[float]) -> Iterator[tuple[int, int]]:
    """Yield which places (in px) have which others near them."""
    for one, (u, v) in enumerate(places):
        near = (_NEAR_MM / pixel_mm[one]) ** 2
        for other, (x, y) in enumerate(places):
            if other != one and (u - x) ** 2 + (v - y) ** 2 < near:
                yield one, other


def _from_axis(along_mm: Floats, across_mm: Floats) -> Floats:
    """Return squared distances from the half line along >= 0, across = 0."""
    before = np.minimum(along_mm, 0.0)
    squared: Floats = before * before + across_mm * across_mm
    return squared
