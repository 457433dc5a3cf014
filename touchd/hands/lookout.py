"""What the hands' stage knows of the surface: its border in the coarse picture, sizes, and ways to area coordinates."""

from dataclasses import dataclass
from math import dist

import cv2
import numpy as np

from touchd.geometry import AreaMap, SurfaceMap, distort_pixel, raw_of_depth
from touchd.model import COARSE_PX, Floats, Mask, Surface

_HALF = COARSE_PX // 2
_SAMPLED = (slice(_HALF, None, COARSE_PX), slice(_HALF, None, COARSE_PX))
_LEAST_FACING = 0.2
_KNOWN_SHARE = 0.2  # of a row or column of the picture that looks at the surface
_UNEVEN_MM = 150.0  # from its best plane: what is farther is no part of the surface
_LEAST_SHARE = 0.1  # of what is seen that must be near a plane, else there is none
_HOLE = np.ones((5, 5), np.uint8)  # smaller blind spots do not matter


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of coarse pixels: columns left..right - 1 and rows top..bottom - 1."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def index(self) -> tuple[slice, slice]:
        """The window as an index of a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class Lookout:
    """Tables made once per surface. Places are in px of the coarse picture, (column, row), unless named otherwise.

    ``known`` (rows, columns): where the surface has a reading; ``table``: where it is seen, blind spots included;
    ``window``: the rectangle around that.
    """

    def __init__(self, surface: Surface, surface_map: SurfaceMap, area: AreaMap) -> None:
        self._surface_map = surface_map
        self._sensor = surface.sensor
        facing = -np.sum(surface_map.rays[_SAMPLED] * surface_map.normals[_SAMPLED], axis=2)
        self._facing = np.maximum(facing, np.float32(_LEAST_FACING))
        self.relocate(area)
        valid = surface.valid[_SAMPLED]
        depth = surface_map.depth[_SAMPLED][valid]
        depth_mm = float(np.median(depth)) if depth.size else 1000.0
        self.shape = valid.shape
        self.depth_mm = depth_mm
        self.pixel_mm = COARSE_PX * depth_mm / area.intrinsics.fx
        self.step_mm = _step_mm(surface, depth_mm)
        self.known: Mask = valid
        self.table = _table(valid, surface_map)
        self.window = _around(self.table)

    def relocate(self, area: AreaMap) -> None:
        """Take the area to lie so from now on."""
        self._area = area
        self.area_mm = area.size_mm
        self._to_ideal: list[list[float]] = np.linalg.inv(np.array(area.to_area)).tolist()

    def px(self, mm: float) -> float:
        """Return a length on the surface in coarse px."""
        return mm / self.pixel_mm

    def apart_mm(self, a: tuple[float, float], b: tuple[float, float], height_mm: float) -> float:
        """Return how far two places so high above the surface lie apart."""
        return dist(a, b) * self.pixel_mm * max(0.0, 1.0 - height_mm / self.depth_mm)

    def under(self, place: tuple[float, float], height_mm: float) -> tuple[float, float]:
        """Return the area coordinates of the surface under what is seen at a place, so high above it."""
        u, v = (COARSE_PX * at + _HALF for at in place)
        rows, columns = self.shape
        facing = float(self._facing[min(max(round(place[1]), 0), rows - 1), min(max(round(place[0]), 0), columns - 1)])
        foot = self._surface_map.foot(u, v, height_mm / facing)
        return self._area.of_point(foot.x_mm, foot.y_mm, foot.z_mm)

    def raw_at(self, heights_mm: Floats) -> Floats:
        """Return what is read of something so high above the surface at every coarse pixel (rows, columns)."""
        depth = self._surface_map.depth[_SAMPLED] - heights_mm / self._facing
        return raw_of_depth(self._sensor, depth.astype(np.float64)).astype(np.float32)

    def place_of(self, x: float, y: float) -> tuple[float, float]:
        """Return where the surface at area coordinates is seen."""
        u, v, scale = (a * x + b * y + c for a, b, c in self._to_ideal)
        u, v = distort_pixel(self._area.intrinsics, u / scale, v / scale)
        return (u - _HALF) / COARSE_PX, (v - _HALF) / COARSE_PX


def _step_mm(surface: Surface, depth_mm: float) -> float:
    sensor = surface.sensor
    raw = int(np.nanargmin(np.abs(sensor.to_mm - np.float32(depth_mm))))
    return float(sensor.step_mm[raw])


def _table(valid: Mask, surface_map: SurfaceMap) -> Mask:
    """Return where (rows, columns) the camera sees the surface, and not a floor far below it."""
    table = valid
    if surface_map.plane is not None:
        points = surface_map.rays[_SAMPLED] * surface_map.depth[_SAMPLED][..., None]
        off = points @ surface_map.plane.normal + surface_map.plane.distance_mm
        near = valid & (np.abs(off) < _UNEVEN_MM)
        table = near if np.count_nonzero(near) > _LEAST_SHARE * np.count_nonzero(valid) else valid
    return cv2.morphologyEx(table.astype(np.uint8), cv2.MORPH_CLOSE, _HOLE) > 0


def _around(mask: Mask) -> Window:
    """Return the rectangle around what a mask shows; a camera may be blind along a side of its picture."""
    rows, columns = (np.flatnonzero(mask.mean(axis=axis) > _KNOWN_SHARE) for axis in (1, 0))
    if not rows.size or not columns.size:
        return Window(0, 0, mask.shape[1], mask.shape[0])
    return Window(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
