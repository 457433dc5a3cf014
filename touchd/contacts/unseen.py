"""Touches for which no fingertip was found: what the picture shows in their place."""

from collections.abc import Sequence
from math import dist

import numpy as np

from touchd.contacts.heights import Heights
from touchd.model import Image16, Unseen

_CLOSE_MM, _WIDE_MM = 6.0, 12.0  # half the sides of the squares that are looked at
# What stands so high over this share of all around a touch hides it or begins to: what is left of it may seem to lift.
_HIDES_MM, _HIDES_SHARE = 70.0, 0.3
# Between these, in mm and raw steps, is the upper side of a finger that touches, blurred by edges and others.
_LOW_MM, _LOW_STEPS, _HIGH_MM, _HIGH_STEPS = 6.0, 0.5, 30.0, 1.0
# Fingers so near to each other may fuse into one in the picture; one that touches alone is found unless it lifted.
_FUSED_MM = 45.0


class UnseenTouches:
    """Tells of touches that are not found whether there is any sign that they ended, over one surface."""

    def __init__(self, heights: Heights, pixel_mm: float, step_mm: float) -> None:
        self._heights = heights
        self._close_px, self._wide_px, self._fused_px = (mm / pixel_mm for mm in (_CLOSE_MM, _WIDE_MM, _FUSED_MM))
        self._low_mm, self._high_mm = _LOW_MM + _LOW_STEPS * step_mm, _HIGH_MM + _HIGH_STEPS * step_mm

    def among(self, raw: Image16, places_px: Sequence[tuple[float, float]]) -> Unseen:
        """Return which touches at places of a picture (H, W) uint16 may go on unseen."""
        hidden, standing = set(), set()
        for which, (u, v) in enumerate(places_px):
            if self._is_hidden(raw, u, v):
                hidden.add(which)
            elif self._is_fused(which, places_px) and self._is_low(raw, u, v):
                standing.add(which)
        return Unseen(frozenset(hidden), frozenset(standing))

    def _is_fused(self, which: int, places_px: Sequence[tuple[float, float]]) -> bool:
        here = places_px[which]
        return any(dist(here, there) < self._fused_px for other, there in enumerate(places_px) if other != which)

    def _is_hidden(self, raw: Image16, u: float, v: float) -> bool:
        heights, pixels = self._heights.around(raw, u, v, self._wide_px)
        return bool(np.count_nonzero(heights > _HIDES_MM) > _HIDES_SHARE * pixels)

    def _is_low(self, raw: Image16, u: float, v: float) -> bool:
        heights, _ = self._heights.around(raw, u, v, self._close_px)
        return heights.size > 0 and self._low_mm < float(np.median(heights)) < self._high_mm
