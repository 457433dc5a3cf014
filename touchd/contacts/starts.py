"""Where fits begin: at the ends of outlines, and where a touch was expected that has no end near it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np

from touchd.contacts.candidates import Ends
from touchd.contacts.fit import ANGLE, CLEARANCE, PITCH, RADIUS
from touchd.contacts.heights import Box, Heights, Lay, as_floats
from touchd.contacts.method import Expected, Place
from touchd.contacts.neighbours import distinct
from touchd.geometry import Doubles, distort
from touchd.model import Floats, Mask

_HIGHEST_MM = 60.0  # what stands higher cannot be a fingertip near the surface
_PITCH_RAD, _RADIUS_MM = 0.6, 6.3  # of an ordinary finger
_THICK_MM = 13.0
_BEHIND_MM, _RISES_MM = 6.0, 5.0  # a finger rises by this much over that way
_TALLEST_CLEARANCE_MM = 40.0
_RING_MM = 8.0
_RING = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], 1).astype(np.float32)
_OWN_MM = 35.0  # an end so near may be that of an expected touch, if it is no other's


@dataclass(frozen=True, slots=True)
class Guesses:
    """First guesses of fingertips, N of them.

    ``state`` (N, 6): as in :class:`Tips`; ``shown`` (N,) bool: whether the picture shows it; ``live``: whether a touch
    was expected there; ``lay``: how the surface lies under them.
    """

    state: Floats
    shown: Mask
    live: list[bool]
    lay: Lay


class Starts:
    """Turns places of the picture into first guesses of fingertips, over one surface."""

    def __init__(self, heights: Heights, place: Place, ahead_px: Floats, pixel_mm: float) -> None:
        """``ahead_px`` (levels,): where along a finger the outline at each level lies, from the ball's centre."""
        self._heights = heights
        self._place = place
        self._ahead_px = ahead_px
        self._pixel_mm = pixel_mm
        self._to_ideal: Doubles = np.linalg.inv(np.array(place.area.to_area))

    def guesses(
        self, ends: Ends, expected: Sequence[Expected], smooth: Floats, box: Box, apart_px: float
    ) -> Guesses | None:
        """Return guesses in px of the box, None if there are none; ``smooth`` (H, W) are the heights in mm of the box.

        No two guesses that the picture shows are nearer than ``apart_px``.
        """
        centres = ends.points - ends.back * self._ahead_px[ends.level, None]
        kept = distinct(centres, ends.rank, apart_px)
        centres, back = centres[kept], ends.back[kept]
        shown = len(centres)
        wanted = self._wanted_px(expected, box)
        pairs = _paired(wanted.tolist(), centres.tolist(), _OWN_MM / self._pixel_mm)
        missing = wanted[[i for i in range(len(wanted)) if i not in pairs]]
        if len(missing):
            centres = np.concatenate([centres, missing])
            back = np.concatenate([back, self._uphill(missing, smooth)])
        here, behind = _sampled(smooth, np.stack([centres, centres + back * np.float32(_BEHIND_MM / self._pixel_mm)]))
        tall = np.maximum(here, behind - np.float32(_RISES_MM))
        low = np.flatnonzero((tall < _HIGHEST_MM) & (tall > 0.0))
        if not low.size:
            return None
        live = [i >= shown or i in pairs.values() for i in low.tolist()]
        state, lay = self._guess(centres[low], back[low], tall[low], box)
        return Guesses(state, low < shown, live, lay)

    def _guess(self, centres: Floats, back: Floats, tall: Floats, box: Box) -> tuple[Floats, Lay]:
        lay = self._heights.lay(centres + np.array([box.left, box.top], np.float32))
        began = np.empty((len(centres), 6), np.float32)
        began[:, :2] = centres
        # The inverse of a 2 × 2 matrix but for its determinant, which turns nothing.
        (a, b), (c, d) = lay.px_per_mm.transpose(1, 2, 0)
        began[:, ANGLE] = np.arctan2(a * back[:, 1] - c * back[:, 0], d * back[:, 0] - b * back[:, 1])
        began[:, PITCH], began[:, RADIUS] = _PITCH_RAD, _RADIUS_MM
        began[:, CLEARANCE] = np.clip(tall - np.float32(_THICK_MM), 0.0, _TALLEST_CLEARANCE_MM)
        return began, lay

    def _wanted_px(self, expected: Sequence[Expected], box: Box) -> Floats:
        """Return where in the box the balls' centres of expected touches should be seen (N, 2)."""
        if not expected:
            return np.zeros((0, 2), np.float32)
        place = self._place
        width_mm, height_mm = place.area.size_mm
        ideal = np.array([(x / width_mm, y / height_mm, 1.0) for x, y in expected]) @ self._to_ideal.T
        feet = distort(place.surface.sensor.intrinsics, ideal[:, :2] / ideal[:, 2:]).astype(np.float32)
        raised: Floats = feet + self._heights.lay(feet).rise_px_per_mm * np.float32(_RADIUS_MM)
        return raised - np.array([box.left, box.top], np.float32)

    def _uphill(self, centres: Floats, smooth: Floats) -> Floats:
        """Return unit vectors (N, 2) towards where the heights around rise: the way back along a finger."""
        ring = centres[:, None] + _RING * np.float32(_RING_MM / self._pixel_mm)
        rise = _sampled(smooth, ring) @ _RING
        uphill: Floats = rise / (np.hypot(rise[:, :1], rise[:, 1:]) + np.float32(1e-6))
        return uphill


def _paired(wanted: list[list[float]], places: list[list[float]], limit: float) -> dict[int, int]:
    """Return which of some points have which place of their own within a limit, the nearest pairs being made first."""
    near = sorted(
        (distance, row, column)
        for row, (u, v) in enumerate(wanted)
        for column, (x, y) in enumerate(places)
        if (distance := hypot(u - x, v - y)) < limit
    )
    pairs: dict[int, int] = {}
    for _, row, column in near:
        if row not in pairs and column not in pairs.values():
            pairs[row] = column
    return pairs


def _sampled(heights: Floats, pixels: Floats) -> Floats:
    """Return heights (M, N) at pixels (M, N, 2)."""
    if not pixels.size:
        return np.zeros(pixels.shape[:2], np.float32)
    seen = cv2.remap(heights, pixels, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)  # type: ignore[call-overload]
    return as_floats(seen)
