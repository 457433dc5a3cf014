"""Fingertips side by side: which are the same one, and which samples belong to which."""

import numpy as np

from touchd.contacts.fit import Tips
from touchd.contacts.heights import Lay
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


def owned_samples(tips: Tips, lay: Lay, places_mm: tuple[Floats, Floats]) -> Floats:
    """Return 1 for the samples (N, S) that are nearer to their own finger's axis than to any other's, else 0.

    ``places_mm``: where the samples lie along and across their finger, (N, S) each.
    """
    along, across = places_mm
    owned = np.ones(along.shape, np.float32)
    apart_px = tips.centres_px[:, None] - tips.centres_px[None]
    near = np.hypot(apart_px[..., 0], apart_px[..., 1]) * lay.pixel_mm[:, None] < _NEAR_MM
    np.fill_diagonal(near, val=False)
    one, other = np.nonzero(near)
    if not len(one):
        return owned
    offset = np.linalg.solve(lay.px_per_mm[one], -apart_px[one, other][..., None])[..., 0]
    cos, sin = np.cos(tips.angle)[:, None], np.sin(tips.angle)[:, None]
    x = along[one] * cos[one] - across[one] * sin[one] - offset[:, :1]
    y = along[one] * sin[one] + across[one] * cos[one] - offset[:, 1:]
    theirs = _from_axis(x * cos[other] + y * sin[other], y * cos[other] - x * sin[other])
    lost = theirs < _from_axis(along, across)[one]
    for pair, tip in enumerate(one.tolist()):
        owned[tip][lost[pair]] = 0.0
    return owned


def _from_axis(along_mm: Floats, across_mm: Floats) -> Floats:
    """Return squared distances from the half line along >= 0, across = 0."""
    before = np.minimum(along_mm, 0.0)
    squared: Floats = before * before + across_mm * across_mm
    return squared
