"""Where fits begin: at the ends of outlines, and where a touch was expected that has no end near it."""

from collections.abc import Sequence

import cv2
import numpy as np

from touchd.contacts.candidates import Ends
from touchd.contacts.fit import Tips
from touchd.contacts.heights import Box, Heights, as_floats
from touchd.contacts.memory import Memory
from touchd.contacts.method import Expected, Place
from touchd.contacts.neighbours import distinct
from touchd.geometry import Doubles, distort
from touchd.model import Floats, Mask

_HIGHEST_MM = 50.0  # what stands higher cannot be a fingertip near the surface
_PITCH_RAD, _RADIUS_MM = 0.6, 6.3  # of an ordinary finger
_THICK_MM = 13.0
_BEHIND_MM, _RISES_MM = 6.0, 5.0  # a finger rises by this much over that way
_TALLEST_CLEARANCE_MM = 40.0
_RING_MM = 8.0
_RING = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], 1).astype(np.float32)
_OWN_MM = 35.0  # an end so near may be that of an expected touch, if it is no other's


class Starts:
    """Turns places of the picture into first guesses of fingertips, over one surface."""

    def __init__(self, heights: Heights, place: Place, memory: Memory, ahead_px: Floats, pixel_mm: float) -> None:
        """``ahead_px`` (levels,): where along a finger the outline at each level lies, from the ball's centre."""
        self._heights = heights
        self._place = place
        self._memory = memory
        self._ahead_px = ahead_px
        self._pixel_mm = pixel_mm
        self._to_ideal: Doubles = np.linalg.inv(np.array(place.area.to_area))

    def tips(self, ends: Ends, expected: Sequence[Expected], smooth: Floats, box: Box, apart_px: float) -> Tips:
        """Return guesses in px of the box, no two nearer than ``apart_px``; ``smooth`` (H, W) are its heights in mm."""
        centres = ends.points - ends.back * self._ahead_px[ends.level, None]
        kept = distinct(centres, ends.rank, apart_px)
        centres, back = centres[kept], ends.back[kept]
        missing = self._missing_px(expected, centres, box)
        shown = np.arange(len(centres) + len(missing)) < len(centres)
        if len(missing):
            centres = np.concatenate([centres, missing])
            back = np.concatenate([back, self._uphill(missing, smooth)])
        tall = np.maximum(
            _sampled(smooth, centres),
            _sampled(smooth, centres + back * np.float32(_BEHIND_MM / self._pixel_mm)) - np.float32(_RISES_MM),
        )
        low = (tall < _HIGHEST_MM) & (tall > 0.0)
        return self._guess(centres[low], back[low], tall[low], shown[low], box)

    def _guess(self, centres: Floats, back: Floats, tall: Floats, shown: Mask, box: Box) -> Tips:
        origin = np.array([box.left, box.top], np.float32)
        lay = self._heights.lay(centres + origin)
        on_surface = np.linalg.solve(lay.px_per_mm, back[..., None])[..., 0]
        shape = np.empty((len(centres), 3), np.float32)
        shape[:, 0], shape[:, 2] = _PITCH_RAD, _RADIUS_MM
        shape[:, 1] = np.clip(tall - np.float32(_THICK_MM), 0.0, _TALLEST_CLEARANCE_MM)
        return Tips(
            centres,
            np.arctan2(on_surface[:, 1], on_surface[:, 0]),
            shape,
            shown,
            *self._memory.recall(centres + origin, self._pixel_mm),
        )

    def _missing_px(self, expected: Sequence[Expected], centres: Floats, box: Box) -> Floats:
        """Return where in the box the balls' centres of expected touches should be seen that no end is near (N, 2)."""
        if not expected:
            return np.zeros((0, 2), np.float32)
        place = self._place
        ideal = np.array([(x / place.area.size_mm[0], y / place.area.size_mm[1], 1.0) for x, y in expected])
        ideal = ideal @ self._to_ideal.T
        feet = distort(place.surface.sensor.intrinsics, ideal[:, :2] / ideal[:, 2:]).astype(np.float32)
        raised = feet + self._heights.lay(feet).rise_px_per_mm * np.float32(_RADIUS_MM)
        wanted = raised - np.array([box.left, box.top], np.float32)
        apart = wanted[:, None] - centres[None]
        return wanted[_unpaired(np.hypot(apart[..., 0], apart[..., 1]), _OWN_MM / self._pixel_mm)]

    def _uphill(self, centres: Floats, smooth: Floats) -> Floats:
        """Return unit vectors (N, 2) towards where the heights around rise: the way back along a finger."""
        ring = centres[:, None] + _RING * np.float32(_RING_MM / self._pixel_mm)
        rise = np.matmul(_sampled(smooth, ring.reshape(-1, 2)).reshape(-1, len(_RING)), _RING)
        uphill: Floats = rise / (np.hypot(rise[:, :1], rise[:, 1:]) + np.float32(1e-6))
        return uphill


def _unpaired(distances: Floats, limit: float) -> list[int]:
    """Return the rows that find no column of their own within a limit, the nearest pairs being made first."""
    rows, columns = np.nonzero(distances < limit)
    taken_rows: set[int] = set()
    taken_columns: set[int] = set()
    for pair in np.argsort(distances[rows, columns], kind="stable").tolist():
        row, column = int(rows[pair]), int(columns[pair])
        if row not in taken_rows and column not in taken_columns:
            taken_rows.add(row)
            taken_columns.add(column)
    return [row for row in range(len(distances)) if row not in taken_rows]


def _sampled(heights: Floats, pixels: Floats) -> Floats:
    """Return heights (N,) at pixels (N, 2)."""
    if not len(pixels):
        return np.zeros(0, np.float32)
    u, v = np.ascontiguousarray(pixels[:, 0]), np.ascontiguousarray(pixels[:, 1])
    return as_floats(cv2.remap(heights, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)).reshape(-1)
