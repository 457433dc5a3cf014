"""Heights above the surface in a coarse picture, for all that does not need every pixel: hands, arms, things, drift."""

import numpy as np

from touchd.geometry import SurfaceMap, mm_per_raw
from touchd.model import COARSE_PX, CoarsePicture, Image16, Surface, SurfaceRows, frozen_array

_LEAST_FACING = 0.2
_SAMPLED = (slice(COARSE_PX // 2, None, COARSE_PX), slice(COARSE_PX // 2, None, COARSE_PX))


class CoarseHeights:
    """The heights above one surface at one pixel of every 4 × 4, exact however high."""

    def __init__(self, surface: Surface, surface_map: SurfaceMap) -> None:
        facing = np.maximum(-np.sum(surface_map.rays[_SAMPLED] * surface_map.normals[_SAMPLED], axis=2), _LEAST_FACING)
        self._facing = facing.astype(np.float32)
        self._to_mm = np.nan_to_num(surface.sensor.to_mm, nan=0.0).astype(np.float32)
        self._mm_per_raw = np.nan_to_num(mm_per_raw(surface.sensor))
        self._valid = surface.valid[_SAMPLED]
        self._surface_mm = np.zeros(self._valid.shape, np.float32)
        self.follow(SurfaceRows(slice(0, surface.valid.shape[0]), surface.reference))

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the empty surface to read differently from now on; they begin at a multiple of four."""
        seen = now.reference[_SAMPLED]
        first = now.rows.start // COARSE_PX
        rows = slice(first, first + len(seen))
        whole = seen.astype(np.int32)
        depth = self._to_mm.take(whole, mode="clip")
        depth += (seen - whole) * self._mm_per_raw.take(whole, mode="clip")
        self._surface_mm[rows] = depth * self._valid[rows]

    def over(self, raw: Image16) -> CoarsePicture:
        """Return the heights that a picture (H, W) uint16 shows."""
        seen_mm = self._to_mm.take(raw[_SAMPLED], mode="clip")
        readings = np.greater(seen_mm, 0.0)
        readings &= np.greater(self._surface_mm, 0.0)
        heights = np.subtract(self._surface_mm, seen_mm, out=seen_mm)
        heights *= self._facing
        heights *= readings
        return CoarsePicture(frozen_array(heights), frozen_array(readings))
