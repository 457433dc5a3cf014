"""Heights above the surface in a coarse picture, for all that does not need every pixel: hands, arms, things, drift."""

import numpy as np

from touchd.geometry import SurfaceMap, depth_mm
from touchd.model import COARSE_PX, CoarsePicture, Floats, Image16, Surface, frozen_array

_LEAST_FACING = 0.2
_SAMPLED = (slice(COARSE_PX // 2, None, COARSE_PX), slice(COARSE_PX // 2, None, COARSE_PX))


class CoarseHeights:
    """The heights above one surface at one pixel of every 4 × 4, exact however high."""

    def __init__(self, surface: Surface, surface_map: SurfaceMap) -> None:
        facing = np.maximum(-np.sum(surface_map.rays[_SAMPLED] * surface_map.normals[_SAMPLED], axis=2), _LEAST_FACING)
        self._sensor = surface.sensor
        self._facing = facing.astype(np.float32)
        self._to_mm = np.nan_to_num(surface.sensor.to_mm, nan=0.0).astype(np.float32)
        self._readable = np.isfinite(surface.sensor.to_mm)
        self._valid = surface.valid[_SAMPLED]
        self._surface_mm = np.zeros(self._valid.shape, np.float32)
        self.follow(surface.reference)

    def follow(self, reference: Floats) -> None:
        """Take the empty surface to read differently from now on: ``reference`` (H, W) raw."""
        depth = depth_mm(self._sensor, reference[_SAMPLED])
        self._surface_mm = np.where(self._valid & np.isfinite(depth), depth, 0.0).astype(np.float32)

    def over(self, raw: Image16) -> CoarsePicture:
        """Return the heights that a picture (H, W) uint16 shows."""
        seen = raw[_SAMPLED]
        readings = self._readable.take(seen, mode="clip") & (self._surface_mm > 0.0)
        heights = (self._surface_mm - self._to_mm.take(seen, mode="clip")) * self._facing * readings
        return CoarsePicture(frozen_array(heights), frozen_array(readings))
