"""Heights above the surface, and what a pixel is worth on it: tables made once per surface."""

from dataclasses import dataclass
from math import atan2, cos, hypot, sin
from typing import NamedTuple, TypeAlias, cast

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from touchd.geometry import Doubles, SurfaceMap, mm_per_raw, raw_of_depth
from touchd.model import Floats, Image16, Mask, Surface, SurfaceRows

Bytes: TypeAlias = NDArray[np.uint8]

_CELL_PX = 8
_EXACT_AT_MM = 13.0
_LEAST_FACING = 0.2
_LEAST_COSINE = 0.5  # between the surface's normal and the way that the camera looks
_COARSEST_MM = 16.0  # a raw step as high as this tells no finger from the surface
_HOLE_PX = 7  # smaller blind spots are surface like what surrounds them
_LOW_MM = -20.0  # heights are cut to these; lower is no reading, higher is all hand
HIGHEST_MM = 120.0
_ELSEWHERE_RAW = 4.0  # so far from where it was learned a surface's raw steps have another size


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of pixels in the whole picture: columns left..right - 1 and rows top..bottom - 1."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def window(self) -> tuple[slice, slice]:
        """The box as an index of a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class Lay(NamedTuple):
    """How the surface lies under a place of the picture, in plain numbers.

    A step in the surface's tangent plane, x and y in mm, leads ``u_by_x`` · x + ``u_by_y`` · y px to the right in the
    picture, and likewise down. ``u_by_z``, ``v_by_z``: how far a point moves for each mm that it is raised along the
    normal; ``x_by_z``, ``y_by_z``: how far (mm) on the surface. ``pixel_mm`` is the size of a pixel on
    the surface, ``step_mm`` the height of a raw step and of the noise.
    """

    u_by_x: float
    u_by_y: float
    v_by_x: float
    v_by_y: float
    u_by_z: float
    v_by_z: float
    x_by_z: float
    y_by_z: float
    pixel_mm: float
    step_mm: float

    def along(self, angle: float) -> tuple[float, float]:
        """Return where in the picture a mm along a direction of the surface leads."""
        c, s = cos(angle), sin(angle)
        return self.u_by_x * c + self.u_by_y * s, self.v_by_x * c + self.v_by_y * s

    def on_surface(self, du: float, dv: float) -> tuple[float, float]:
        """Return how far on the surface, x and y in mm, a step in the picture leads."""
        area = self.u_by_x * self.v_by_y - self.u_by_y * self.v_by_x
        return (self.v_by_y * du - self.u_by_y * dv) / area, (self.u_by_x * dv - self.v_by_x * du) / area

    def seen_from(self, angle: float, du: float, dv: float) -> tuple[float, float]:
        """Return the same along a direction of the surface and across it, in mm."""
        (x_mm, y_mm), c, s = self.on_surface(du, dv), cos(angle), sin(angle)
        return x_mm * c + y_mm * s, y_mm * c - x_mm * s

    def angle_of(self, du: float, dv: float) -> float:
        """Return the direction on the surface that a step in the picture has."""
        # The inverse of a 2 x 2 matrix but for its determinant, which is above 0 and turns nothing.
        return atan2(self.u_by_x * dv - self.v_by_x * du, self.v_by_y * du - self.u_by_y * dv)


_SLID, _PIXEL, _STEP = slice(6, 8), 8, 9  # where in it
_BY_DEPTH = np.array([-1.0] * 6 + [0.0, 0.0, 1.0, 0.0], np.float32)  # the power of the depth that each goes with


def as_floats(picture: MatLike) -> Floats:
    """Return an OpenCV picture that is known to be float32 as such; nothing is copied."""
    return cast("Floats", picture)


def as_bytes(picture: MatLike) -> Bytes:
    """Return an OpenCV picture that is known to be uint8 as such; nothing is copied."""
    return cast("Bytes", picture)


class Heights:
    """The heights above one surface, for every reading at every pixel."""

    def __init__(self, surface: Surface, surface_map: SurfaceMap, inside: Mask) -> None:
        """``inside`` (H, W): where touches are looked for; elsewhere nothing stands out.

        Where the surface itself gave no reading its depth is that of its surroundings, so that a hand above such a
        place is seen whole; ``sure`` (H, W) leaves those places out, and where the surface is too steep or too far.
        """
        sensor = surface.sensor
        facing = np.maximum(-np.sum(surface_map.rays * surface_map.normals, axis=2), _LEAST_FACING)
        z_mm = surface_map.depth.astype(np.float64)
        here_raw = raw_of_depth(sensor, z_mm)
        # A raw step is worth a little less the higher above the surface: exact where fingertips are.
        gain = _EXACT_AT_MM / (here_raw - raw_of_depth(sensor, z_mm - _EXACT_AT_MM))
        known = inside & np.isfinite(gain)
        self.usable = known
        self._gain = np.where(known, gain * facing, 0.0).astype(np.float32)
        reference = np.where(surface.valid, surface.reference, here_raw)
        self._reference = np.where(known, reference, 0.0).astype(np.float32)
        self._learned, self._learned_gain = self._reference.copy(), self._gain.copy()
        self._mm_per_raw = np.nan_to_num(mm_per_raw(sensor), nan=1.0)
        self._to_mm = np.nan_to_num(sensor.to_mm, nan=1.0)
        self._facing = facing
        self._readable = _limits(sensor.to_mm)
        self._invalid_is_far = sensor.invalid > self._readable[1]  # and so reads as low by itself
        self._surface = surface
        self._z_mm = z_mm
        step = sensor.step_mm[np.clip(np.rint(np.nan_to_num(here_raw)), 0, len(sensor.step_mm) - 1).astype(int)]
        # Noise blurs as rounding to steps does.
        noise = float(np.median(surface.noise[known])) if known.any() else 0.0
        self._lay = _lay_of(surface_map, step * facing.astype(np.float32) * np.float32(hypot(1.0, noise)))
        self._learned_lay = self._lay.copy()
        cosine = facing / np.linalg.norm(surface_map.rays, axis=2)
        sure = known & surface.valid & (cosine > _LEAST_COSINE) & (step < _COARSEST_MM)
        self.sure = cv2.morphologyEx(sure.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((_HOLE_PX, _HOLE_PX))) > 0

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the surface to read differently from now on."""
        rows = now.rows
        np.copyto(self._reference[rows], now.reference, where=self.usable[rows])
        if self._is_elsewhere(rows):
            self._gain[rows] = self._learned_gain[rows] * self._growth(rows)
            self._lay_anew(rows)
        else:
            self._gain[rows] = self._learned_gain[rows]

    def _is_elsewhere(self, rows: slice) -> bool:
        return cv2.norm(self._reference[rows], self._learned[rows], cv2.NORM_INF) > _ELSEWHERE_RAW

    def _lay_anew(self, rows: slice) -> None:
        """Put the cells of the surface, whose slope is as it was, as far from the camera as they are by now."""
        cells = slice(rows.start // _CELL_PX, rows.stop // _CELL_PX)
        at = np.s_[rows.start + _CELL_PX // 2 : rows.stop : _CELL_PX, _CELL_PX // 2 :: _CELL_PX]
        now, then = (reference[at].astype(np.int32) for reference in (self._reference, self._learned))
        farther = self._to_mm.take(now, mode="clip") / self._to_mm.take(then, mode="clip")
        lay = self._learned_lay[cells, : now.shape[1]][: len(now)]
        found = lay * farther[..., None] ** _BY_DEPTH
        steps = self._mm_per_raw.take(now, mode="clip") / self._mm_per_raw.take(then, mode="clip")
        found[..., _STEP] *= steps
        self._lay[cells, : now.shape[1]][: len(now)] = found

    def _growth(self, rows: slice) -> Floats:
        """Return by what factor a raw step is worth more mm (n, W) than where the surface was learned."""
        now, then = (
            self._mm_per_raw.take(reference[rows].astype(np.int32), mode="clip")
            for reference in (self._reference, self._learned)
        )
        return now / then

    def raw_below(self, height_mm: float) -> Floats:
        """Return by how much (H, W, raw) the surface reads farther than what stands so high over it.

        As it was learned; NaN where nothing can be told, and where what stands so high is nearer than the sensor reads.
        """
        sensor = self._surface.sensor
        raised = raw_of_depth(sensor, self._z_mm - height_mm / self._facing)
        return np.where(self.usable, raw_of_depth(sensor, self._z_mm) - raised, np.nan).astype(np.float32)

    def between(self, low: Floats, high: Floats, rows: slice) -> tuple[Image16, Image16]:
        """Return the least and the greatest reading of what stands between two heights over some rows (n, W).

        ``low``, ``high``: :meth:`raw_below` of both in these rows. Where nothing can be told the least is above the
        greatest.
        """
        least, most = self._readable
        reference = self._reference[rows]
        if self._is_elsewhere(rows):
            growth = self._growth(rows)
            low, high = low / growth, high / growth
        farthest = reference - low
        known = farthest > least
        # What would be nearer than the sensor reads is not there.
        first = np.where(known, np.fmax(np.floor(reference - high) + 1.0, least), most)
        return first.astype(np.uint16), np.where(known, np.floor(farthest), 0.0).astype(np.uint16)

    def over(self, raw: Image16, box: Box) -> tuple[Floats, Bytes]:
        """Return the heights in mm within a box, float32, and as uint8 (255 or 0) which of them are readings."""
        seen = raw[box.window]
        readings = cv2.inRange(seen, *self._readable)
        nearer = cv2.subtract(self._reference[box.window], seen, dtype=cv2.CV_32F)
        heights = as_floats(cv2.multiply(nearer, self._gain[box.window], dst=nearer))
        # In one pass each; numpy's clip takes twice as long.
        cv2.threshold(heights, HIGHEST_MM, 0.0, cv2.THRESH_TRUNC, dst=heights)
        cv2.max(heights, _LOW_MM, dst=heights)  # type: ignore[call-overload]
        if not self._invalid_is_far:
            np.copyto(heights, _LOW_MM, where=readings == 0)
        return heights, as_bytes(readings)

    def around(self, raw: Image16, u: float, v: float, reach_px: float) -> tuple[Floats, int]:
        """Return the heights in mm (N,) of all readings in a square around a pixel, and how many pixels it has."""
        rows, columns = (slice(max(int(at - reach_px), 0), max(int(at + reach_px) + 1, 0)) for at in (v, u))
        seen = raw[rows, columns]
        least, most = self._readable
        heights = (self._reference[rows, columns] - seen) * self._gain[rows, columns]
        return heights[(seen >= least) & (seen <= most)], seen.size

    def lay(self, u: float, v: float) -> Lay:
        """Return how the surface lies under a pixel."""
        rows, columns = self._lay.shape[:2]
        row, column = min(max(int(v) // _CELL_PX, 0), rows - 1), min(max(int(u) // _CELL_PX, 0), columns - 1)
        return Lay(*self._lay[row, column].tolist())

    def sizes_mm(self) -> tuple[Floats, Floats]:
        """Return the sizes of pixels and of raw steps all over the usable surface, (N,) each."""
        at = self._usable_lay()
        return at[:, _PIXEL], at[:, _STEP]

    def steepest_lean(self) -> float:
        """Return how far at most (mm) what stands 1 mm higher is seen elsewhere on the usable surface."""
        at = self._usable_lay()[:, _SLID]
        return float(np.hypot(at[:, 0], at[:, 1]).max(initial=0.0))

    def _usable_lay(self) -> Floats:
        seen = self.usable[_CELL_PX // 2 :: _CELL_PX, _CELL_PX // 2 :: _CELL_PX]
        found: Floats = self._lay[: seen.shape[0], : seen.shape[1]][seen]
        return found


def _limits(to_mm: Floats) -> tuple[int, int]:
    """Return the least and the greatest raw value that is a reading."""
    known = np.flatnonzero(np.isfinite(to_mm))
    return int(known[0]), int(known[-1])


def _lay_of(surface_map: SurfaceMap, step_mm: Floats) -> Floats:
    """Return the numbers of :class:`Lay` (rows, columns, 10) for each cell of the picture.

    With a ray d and its depth Z, a step along the picture moves the point P = Z·d within the tangent plane n·dP = 0:
    dP = Z·dd - Z·(n·dd)/(n·d)·d. Raising P by one mm along n turns its ray by (n - d·n_z)/Z.
    """
    height, width = surface_map.depth.shape
    row, column = (np.minimum(np.arange(0, size, _CELL_PX) + _CELL_PX // 2, size - 2) for size in (height, width))
    at = np.ix_(row, column)
    rays = surface_map.rays.astype(np.float64)
    normal, depth, ray = (
        surface_map.normals[at].astype(np.float64),
        surface_map.depth[at][..., None].astype(np.float64),
        rays[at],
    )
    by_u = 0.5 * (rays[np.ix_(row, column + 1)] - rays[np.ix_(row, column - 1)])
    by_v = 0.5 * (rays[np.ix_(row + 1, column)] - rays[np.ix_(row - 1, column)])
    along_u, along_v = (_on_surface(turn, ray, normal, depth) for turn in (by_u, by_v))
    first = along_u / np.linalg.norm(along_u, axis=-1, keepdims=True)
    second = np.cross(first, normal)
    second *= np.sign(np.sum(second * along_v, axis=-1, keepdims=True))
    mm_per_px = np.stack(
        [np.stack([_dot(step, axis) for step in (along_u, along_v)], -1) for axis in (first, second)], -2
    )
    turned = ((normal - ray * normal[..., 2:]) / depth)[..., :2]
    rise = np.linalg.solve(np.stack([by_u[..., :2], by_v[..., :2]], -1), turned[..., None])[..., 0]
    pixel_mm = np.sqrt(np.abs(np.linalg.det(mm_per_px)))
    slid = (mm_per_px @ rise[..., None])[..., 0]
    parts = [
        np.linalg.inv(mm_per_px).reshape(*pixel_mm.shape, 4),
        rise,
        slid,
        pixel_mm[..., None],
        step_mm[at][..., None],
    ]
    return np.concatenate(parts, axis=-1).astype(np.float32)


def _on_surface(turn: Doubles, ray: Doubles, normal: Doubles, depth: Doubles) -> Doubles:
    share = np.sum(normal * turn, -1, keepdims=True) / np.sum(normal * ray, -1, keepdims=True)
    moved: Doubles = depth * (turn - share * ray)
    return moved


def _dot(a: Doubles, b: Doubles) -> Doubles:
    return np.asarray(np.sum(a * b, axis=-1), np.float64)
