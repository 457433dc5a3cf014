"""What a picture shows of the surface, in blocks of pixels: where it is in sight, and by how much it reads off."""

from dataclasses import dataclass

import cv2
import numpy as np

from touchd.geometry import SurfaceMap, raw_of_depth
from touchd.model import COARSE_PX, CoarsePicture, Floats, Image16, Mask, Surface
from touchd.surface.calibrate import bin_width_raw

BLOCK_PX = 16
MIDDLES = (slice(BLOCK_PX // 2, None, BLOCK_PX), slice(BLOCK_PX // 2, None, BLOCK_PX))
COARSER = (slice(None, None, 2), slice(None, None, 2))  # every other sample of a coarse picture will do
_SAMPLED = (slice(COARSE_PX // 2, None, 2 * COARSE_PX), slice(COARSE_PX // 2, None, 2 * COARSE_PX))

# What reads off by more than this and a raw step is something else than the surface.
_THING_MM, _THING_STEPS = 4.0, 1.0
# What stands as high may be a hand, whose fingers reach so far beyond it and may lie as low as the surface's noise.
_HAND_MM, _FINGER_MM = 28.0, 110.0
_FAR_ABOVE_MM = 60.0  # no hand that rests on the surface covers much of it so high
_READ_SHARE = 0.6  # of a block's known samples must have a reading, or something that cannot be read is there
_ALL = 255
_NEAR_PLANE_SHARE = 0.05  # of its depth: so far off the table's plane a pixel still belongs to it
_LEAST_REGION_SHARE = 0.3


@dataclass(frozen=True, slots=True)
class Sight:
    """One picture in blocks; all arrays (rows, columns).

    ``off``: by how much each block's middle reads off the surface, in units of noise (:attr:`Blocks.unit_raw`),
    farther is more. ``readable``: where it has a reading and belongs to the surface that is watched. ``free``: where
    nothing but the surface is, nor near. ``above``: readable, and something stands far above it.
    """

    off: Floats
    readable: Mask
    free: Mask
    above: Mask


class Blocks:
    """Divides the pictures of one surface into blocks."""

    def __init__(self, surface: Surface, surface_map: SurfaceMap) -> None:
        sensor = surface.sensor
        self.region = _region(surface, surface_map)[MIDDLES]
        self.shape = self.region.shape
        self.unit_raw = float(bin_width_raw(sensor, np.rint(surface.reference[surface.valid]).astype(np.uint16)))
        self._thing_mm = thing_mm(surface, surface_map)
        self._thing_low_mm = -self._thing_mm
        self._hand_mm = _HAND_MM + float(np.min(self._thing_mm, initial=_HAND_MM)) - _THING_MM
        self._sampled = np.s_[2::4, 2::4]  # the coarse samples beside the blocks' middles
        self._known = self._mean(_bytes(surface.valid[_SAMPLED]))
        self._readable = np.isfinite(sensor.to_mm)
        away_mm = float(np.median(surface_map.depth))
        reach = int(_FINGER_MM * sensor.intrinsics.fx / away_mm / BLOCK_PX) + 1
        self._around, self._around_hand = (np.ones((2 * n + 1, 2 * n + 1), np.uint8) for n in (1, reach))

    def look(self, raw: Image16, level: Floats, coarse: CoarsePicture) -> Sight:
        """Return what a picture (H, W) uint16 shows; ``level`` (rows, columns): how the surface reads there, raw."""
        seen = raw[MIDDLES]
        readable = self._readable.take(seen, mode="clip") & self.region
        return Sight(
            off=(seen - level) * np.float32(1.0 / self.unit_raw),
            readable=readable,
            free=self._free(coarse),
            above=readable & (coarse.heights_mm[self._sampled] > _FAR_ABOVE_MM),
        )

    def _free(self, coarse: CoarsePicture) -> Mask:
        heights = np.ascontiguousarray(coarse.heights_mm[COARSER])
        flat = self._mean(cv2.inRange(heights, self._thing_low_mm, self._thing_mm))
        read = self._mean(_bytes(coarse.readings[COARSER]))
        near: Mask = np.greater(cv2.dilate(np.less(flat, _ALL).view(np.uint8), self._around), 0)
        near |= np.less(read, _READ_SHARE * self._known)
        if heights.max(initial=0.0) > self._hand_mm:
            hands = np.greater(self._mean(_bytes(np.greater(heights, self._hand_mm))), 0)
            near |= np.greater(cv2.dilate(hands.view(np.uint8), self._around_hand), 0)
        return ~near

    def _mean(self, samples: cv2.typing.MatLike) -> cv2.typing.MatLike:
        rows, columns = self.shape
        return cv2.resize(samples, (columns, rows), interpolation=cv2.INTER_AREA)


def _bytes(mask: Mask) -> cv2.typing.MatLike:
    """Return a mask as uint8, 255 where it is true."""
    return np.multiply(mask.view(np.uint8), np.uint8(_ALL))


def thing_mm(surface: Surface, surface_map: SurfaceMap) -> Floats:
    """Return from which height on something is no surface, at every other sample of a coarse picture."""
    sensor = surface.sensor
    raw = np.nan_to_num(raw_of_depth(sensor, surface_map.depth[_SAMPLED].astype(np.float64)))
    step_mm = np.nan_to_num(sensor.step_mm[np.rint(raw).astype(int)], nan=np.inf)
    found: Floats = (_THING_MM + _THING_STEPS * step_mm).astype(np.float32)
    return found


def filled_reference(surface: Surface, surface_map: SurfaceMap) -> Floats:
    """Return how a surface reads (H, W), where it gave no reading as its surroundings do."""
    around = np.nan_to_num(raw_of_depth(surface.sensor, surface_map.depth.astype(np.float64)))
    return np.where(surface.valid, surface.reference, around).astype(np.float32)


def _region(surface: Surface, surface_map: SurfaceMap) -> Mask:
    """Return the pixels (H, W) of the surface itself, without a floor beside it where it has a plane."""
    plane = surface_map.plane
    if plane is None:
        return surface.valid
    depth = surface_map.depth
    off_mm = np.abs(plane.depth_mm(surface_map.rays.astype(np.float64)) - depth)
    near: Mask = surface.valid & (off_mm < _NEAR_PLANE_SHARE * depth)
    return near if near.sum() > _LEAST_REGION_SHARE * surface.valid.sum() else surface.valid
