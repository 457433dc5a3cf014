"""Touches for which no fingertip was found: what the picture shows in their place."""

from collections.abc import Sequence

import numpy as np

from touchd.contacts.heights import Heights
from touchd.model import Image16, Unseen

_AROUND_MM = 6.0
# What stands so high nearly all around a touch hides it. The hand of a finger that touches is lower.
_HIDES_MM, _HIDES_SHARE = 70.0, 0.75
# Between these, in mm and raw steps, is the upper side of a finger that touches, blurred by edges and others.
_LOW_MM, _LOW_STEPS, _HIGH_MM, _HIGH_STEPS = 6.0, 0.5, 30.0, 1.0


class UnseenTouches:
    """Tells of touches that are not found whether there is any sign that they ended, over one surface."""

    def __init__(self, heights: Heights, pixel_mm: float, step_mm: float) -> None:
        self._heights = heights
        self._reach_px = _AROUND_MM / pixel_mm
        self._low_mm, self._high_mm = _LOW_MM + _LOW_STEPS * step_mm, _HIGH_MM + _HIGH_STEPS * step_mm

    def among(self, raw: Image16, places_px: Sequence[tuple[float, float]]) -> Unseen:
        """Return which touches at places of a picture (H, W) uint16 may go on unseen."""
        hidden, standing = set(), set()
        for which, (u, v) in enumerate(places_px):
            heights, pixels = self._heights.around(raw, u, v, self._reach_px)
            if np.count_nonzero(heights > _HIDES_MM) > _HIDES_SHARE * pixels:
                hidden.add(which)
            elif heights.size and self._low_mm < np.median(heights) < self._high_mm:
                standing.add(which)
        return Unseen(frozenset(hidden), frozenset(standing))
