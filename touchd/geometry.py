"""Where things are: camera pixels, points in space, the surface, and the active area's own coordinates.

Camera space is in millimetres: x right, y down, z along the optical axis. Pixels are (u, v) with (0, 0) at the
centre of the top-left pixel. All functions take arrays of any leading shape.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import AreaCorners, Floats, Intrinsics, Sensor, Surface, frozen_array

Doubles = NDArray[np.float64]

KINECT_SIZE = (640, 480)
KINECT_INVALID = 2047
_PLANE_POINTS = 20_000  # more make a fit no better, only slower
_ON_PLANE_SHARE = 0.02  # of its depth: how far from a plane a point may lie and still refine it
_UNDISTORT_ROUNDS = 12  # a fixed point that gains a digit a round for any lens we support


@dataclass(frozen=True, slots=True)
class ZeroPlane:
    """The constants a Kinect v1 was given in the factory; the defaults are those of every unit seen so far."""

    emitter_distance_cm: float = 7.5
    reference_distance_cm: float = 120.0
    reference_pixel_size_mm: float = 0.1042
    const_shift: float = 200.0


def kinect_v1_sensor(
    zero_plane: ZeroPlane | None = None, intrinsics: Intrinsics | None = None, serial: str = ""
) -> Sensor:
    """Return the Sensor of a Kinect v1 that delivers raw 11-bit shift.

    Depth follows from the zero-plane constants as in libfreenect's registration:
    m = ((raw − 4·const_shift)/4 − 3/8)·pixel_size, Z = 10·(m·reference/(emitter − m) + reference) in mm.
    With the usual constants that is 345489 / (1089.41 − raw). Noise and fattening were measured on real recordings.
    """
    zp = zero_plane or ZeroPlane()
    raw = np.arange(2048, dtype=np.float64)
    metric = ((raw - 4.0 * zp.const_shift) / 4.0 - 0.375) * zp.reference_pixel_size_mm
    room = zp.emitter_distance_cm - metric
    with np.errstate(divide="ignore"):
        z_mm = 10.0 * (metric * zp.reference_distance_cm / room + zp.reference_distance_cm)
        step = (
            10.0
            * zp.reference_distance_cm
            * zp.emitter_distance_cm
            * (zp.reference_pixel_size_mm / 4.0)
            / (room * room)
        )
    readable = (room > 0.0) & (z_mm > 0.0) & (raw != KINECT_INVALID)
    return Sensor(
        kind="kinect-v1",
        serial=serial,
        size=KINECT_SIZE,
        intrinsics=intrinsics or Intrinsics(575.8, 575.8, 319.5, 239.5),
        unit="shift",
        invalid=KINECT_INVALID,
        to_mm=frozen_array(np.where(readable, z_mm, np.nan).astype(np.float32)),
        step_mm=frozen_array(np.where(readable, step, np.nan).astype(np.float32)),
        noise=0.22,
        shadow_side="left",
        fatten_px=4.0,
    )


def millimetre_sensor(
    kind: str, size: tuple[int, int], intrinsics: Intrinsics, noise_mm: float, step_mm: Floats | float = 1.0
) -> Sensor:
    """Return the Sensor of a camera whose raw values are millimetres, with 0 for no reading.

    ``step_mm`` is one number, or a table of 65536 for cameras whose real resolution is coarser than a millimetre.
    """
    to_mm = np.arange(65536, dtype=np.float32)
    to_mm[0] = np.nan
    steps = np.broadcast_to(np.asarray(step_mm, np.float32), (65536,)).copy()
    steps[0] = np.nan
    return Sensor(
        kind=kind,
        serial="",
        size=size,
        intrinsics=intrinsics,
        unit="mm",
        invalid=0,
        to_mm=frozen_array(to_mm),
        step_mm=frozen_array(steps),
        noise=noise_mm,
        shadow_side="none",
        fatten_px=0.0,
    )


def depth_mm(sensor: Sensor, raw: NDArray[np.integer | np.floating]) -> Doubles:
    """Return depth along the optical axis for raw values, whole or fractional; NaN where there is no reading."""
    values = np.asarray(raw, np.float64)
    last = len(sensor.to_mm) - 1
    known = (values >= 0.0) & (values <= last)
    below = np.where(known, values, 0.0).astype(np.intp)
    above = np.minimum(below + 1, last)
    share = values - below
    here = sensor.to_mm[below].astype(np.float64)
    # A whole raw value must not look at its neighbour, which may be no reading.
    depth = np.where(share > 0.0, here + share * (sensor.to_mm[above] - here), here)
    return np.asarray(np.where(known, depth, np.nan), np.float64)


def depth_of(sensor: Sensor, raw: float) -> float:
    """Return :func:`depth_mm` of a single value: the quick way for the hot path."""
    if not 0.0 <= raw <= len(sensor.to_mm) - 1:
        return math.nan
    below = int(raw)
    here = float(sensor.to_mm[below])
    return here if raw == below else here + (raw - below) * (float(sensor.to_mm[below + 1]) - here)


def raw_of_depth(sensor: Sensor, z_mm: Doubles) -> Doubles:
    """Return the fractional raw value of depths in mm: the inverse of :func:`depth_mm`; NaN beyond its range."""
    known = np.flatnonzero(np.isfinite(sensor.to_mm))
    return np.interp(z_mm, sensor.to_mm[known], known.astype(np.float64), left=np.nan, right=np.nan)


def mm_per_raw(sensor: Sensor) -> Floats:
    """Return by how many mm depth grows per raw unit, for each raw value; NaN where there is no reading."""
    return np.gradient(sensor.to_mm).astype(np.float32)


def undistort(intrinsics: Intrinsics, pixels: Doubles) -> Doubles:
    """Return where pixels (..., 2) as seen would lie without the lens's distortion."""
    k = intrinsics
    focal, centre = np.array([k.fx, k.fy]), np.array([k.cx, k.cy])
    seen = (np.asarray(pixels, np.float64) - centre) / focal
    if k.k1 == 0.0 and k.k2 == 0.0:
        return np.array(pixels, np.float64)
    ideal: Doubles = seen.copy()
    for _ in range(_UNDISTORT_ROUNDS):
        ideal = seen / _distortion(k, ideal)
    unbent: Doubles = ideal * focal + centre
    return unbent


def distort(intrinsics: Intrinsics, pixels: Doubles) -> Doubles:
    """Return where the lens shows undistorted pixels (..., 2): the inverse of :func:`undistort`."""
    k = intrinsics
    focal, centre = np.array([k.fx, k.fy]), np.array([k.cx, k.cy])
    ideal = (np.asarray(pixels, np.float64) - centre) / focal
    bent: Doubles = ideal * _distortion(k, ideal) * focal + centre
    return bent


def distort_pixel(intrinsics: Intrinsics, u: float, v: float) -> tuple[float, float]:
    """Return where the lens shows one undistorted pixel, as :func:`distort` does for many."""
    k = intrinsics
    x, y = (u - k.cx) / k.fx, (v - k.cy) / k.fy
    r2 = x * x + y * y
    bent = 1.0 + r2 * (k.k1 + r2 * k.k2)
    return x * bent * k.fx + k.cx, y * bent * k.fy + k.cy


def _distortion(k: Intrinsics, ideal: Doubles) -> Doubles:
    r2 = np.sum(ideal * ideal, axis=-1, keepdims=True)
    factor: Doubles = 1.0 + r2 * (k.k1 + r2 * k.k2)
    return factor


def rays(intrinsics: Intrinsics, pixels: Doubles) -> Doubles:
    """Return directions (..., 3) with z = 1 along which pixels (..., 2) as seen look; times depth: the point seen."""
    ideal = undistort(intrinsics, pixels)
    out = np.ones((*ideal.shape[:-1], 3))
    out[..., 0] = (ideal[..., 0] - intrinsics.cx) / intrinsics.fx
    out[..., 1] = (ideal[..., 1] - intrinsics.cy) / intrinsics.fy
    return out


def project_ideal(intrinsics: Intrinsics, points_mm: Doubles) -> Doubles:
    """Return the undistorted pixels (..., 2) of points (..., 3) in camera space."""
    xy = points_mm[..., :2] / points_mm[..., 2:]
    pixels: Doubles = xy * np.array([intrinsics.fx, intrinsics.fy]) + np.array([intrinsics.cx, intrinsics.cy])
    return pixels


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane in camera space: points P with ``normal @ P == -distance_mm``; the normal looks at the camera."""

    normal: Doubles  # (3,)
    distance_mm: float  # from the camera's centre, along the normal

    def depth_mm(self, directions: Doubles) -> Doubles:
        """Return the depth at which rays (..., 3) with z = 1 meet the plane; not positive where they never do."""
        facing = directions @ -self.normal
        with np.errstate(divide="ignore"):
            return np.asarray(self.distance_mm / facing, np.float64)


def fit_plane(points_mm: Doubles, rounds: int = 4) -> Plane | None:
    """Return the plane through most of the points (N, 3), or None if there are fewer than three or it is degenerate.

    Least squares on inverse depth, in which a plane is linear and a Kinect's noise even; after each round the points
    beyond three median absolute residuals are left out.
    """
    if len(points_mm) < 3:
        return None
    design = points_mm / points_mm[:, 2:]
    inverse = 1.0 / points_mm[:, 2]
    kept = np.ones(len(points_mm), bool)
    solution: Doubles = np.zeros(3)
    for _ in range(rounds):
        found, _, rank, _ = np.linalg.lstsq(design[kept], inverse[kept], rcond=None)
        solution = np.asarray(found, np.float64)
        if rank < 3:
            return None
        residual: Doubles = np.abs(design @ solution - inverse)
        kept = residual <= 3.0 * 1.4826 * np.median(residual) + 1e-12
        if int(kept.sum()) < 3:
            break
    length = float(np.linalg.norm(solution))
    if length == 0.0:
        return None
    return Plane(normal=-solution / length, distance_mm=1.0 / length)


@dataclass(frozen=True, slots=True)
class Foot:
    """Where something above the surface stands on it, in camera space, and its height above it.

    ``facing`` is the cosine, times the ray's length, between the surface's normal there and the viewing direction.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    height_mm: float
    facing: float


@dataclass(frozen=True, slots=True)
class SurfaceMap:
    """The surface in camera space, made once per surface.

    ``depth`` is its smoothed depth in mm, ``rays`` the viewing directions with z = 1, ``normals`` unit vectors that
    look at the camera; (H, W), (H, W, 3) and (H, W, 3) float32. ``pitch`` is how far the rays of neighbouring pixels
    lie apart, along rows and columns. ``plane`` is the best single plane, None without one.
    """

    depth: Floats
    rays: Floats
    normals: Floats
    pitch: tuple[float, float]
    plane: Plane | None

    def foot(self, u: float, v: float, drop_mm: float) -> Foot:
        """Return where a point above the surface stands on it.

        The point is seen at pixel (u, v), by ``drop_mm`` along the optical axis nearer than the surface behind it.
        Its foot is that of its perpendicular to the surface's tangent plane there.
        """
        height, width = self.depth.shape
        column, row = min(max(round(u), 0), width - 1), min(max(round(v), 0), height - 1)
        ray_x, ray_y, _ = self.rays[row, column].tolist()
        nx, ny, nz = self.normals[row, column].tolist()
        # Where the nearest pixel's ray meets the surface, and the ray of the fraction of a pixel beside it.
        facing_there = ray_x * nx + ray_y * ny + nz
        ray_x += (u - column) * self.pitch[0]
        ray_y += (v - row) * self.pitch[1]
        facing = ray_x * nx + ray_y * ny + nz
        z_mm = float(self.depth[row, column]) * facing_there / facing - drop_mm
        height_mm = -drop_mm * facing
        return Foot(
            x_mm=ray_x * z_mm - height_mm * nx,
            y_mm=ray_y * z_mm - height_mm * ny,
            z_mm=z_mm - height_mm * nz,
            height_mm=height_mm,
            facing=-facing,
        )


def map_surface(surface: Surface, window_px: int = 31) -> SurfaceMap:
    """Return the SurfaceMap of a surface.

    Within the window the inverse depth is fitted as a plane 1/Z = a·u + b·v + c (exact for a plane seen by a pinhole
    camera); the coefficients give the normal. Where the window spans an edge (a book's) the fit is poor, and the
    normal is that of the whole surface.
    """
    sensor = surface.sensor
    height, width = surface.valid.shape
    v, u = np.mgrid[0:height, 0:width].astype(np.float64)
    directions = rays(sensor.intrinsics, np.stack([u, v], axis=-1))
    z_mm = np.where(surface.valid, depth_mm(sensor, surface.reference), np.nan)
    known = np.isfinite(z_mm)
    plane = _plane_around_centre(directions * z_mm[..., None], known)
    inverse = np.where(known, 1.0 / np.where(known, z_mm, 1.0), 0.0)
    inverse = _fill(inverse, known, window_px, plane, directions)
    normals = _local_normals(inverse, directions, sensor.intrinsics, window_px)
    if plane is not None:
        step_share = np.abs(cv2.blur(inverse, (window_px, window_px)) - inverse) * (1.0 / inverse)
        rough = cv2.dilate((step_share > 0.008).astype(np.uint8), np.ones((window_px // 2, window_px // 2)))
        normals[rough > 0] = plane.normal
    smooth = cv2.medianBlur(inverse.astype(np.float32), 5)
    return SurfaceMap(
        depth=frozen_array((1.0 / smooth).astype(np.float32)),
        rays=frozen_array(directions.astype(np.float32)),
        normals=frozen_array(normals.astype(np.float32)),
        pitch=(1.0 / sensor.intrinsics.fx, 1.0 / sensor.intrinsics.fy),
        plane=plane,
    )


def _plane_around_centre(points_mm: Doubles, known: NDArray[np.bool_]) -> Plane | None:
    """Return the plane of what the picture's middle third shows, refined by all that lies on it.

    A floor beside the table, however large, does not pull it.
    """
    height, width = known.shape
    middle = np.zeros_like(known)
    middle[height // 3 : height - height // 3, width // 3 : width - width // 3] = True
    every = max(1, int(known.sum()) // _PLANE_POINTS)
    plane = fit_plane(points_mm[known & middle][::every]) or fit_plane(points_mm[known][::every])
    if plane is None:
        return None
    points = points_mm[known][::every]
    near = np.abs(points @ plane.normal + plane.distance_mm) < _ON_PLANE_SHARE * points[:, 2]
    return fit_plane(points[near]) or plane


def _fill(
    inverse: Doubles, known: NDArray[np.bool_], window_px: int, plane: Plane | None, directions: Doubles
) -> Doubles:
    weight = cv2.blur(known.astype(np.float64), (window_px, window_px))
    mean = cv2.blur(inverse, (window_px, window_px)) / np.maximum(weight, 1e-9)
    far_off = np.full(inverse.shape, float(np.median(inverse[known])) if known.any() else 1e-3)
    if plane is not None:
        on_plane = 1.0 / np.where(plane.depth_mm(directions) > 0.0, plane.depth_mm(directions), np.inf)
        far_off = np.where(on_plane > 1e-4, on_plane, far_off)
    return np.where(known, inverse, np.where(weight > 0.05, mean, far_off))


def _local_normals(inverse: Doubles, directions: Doubles, k: Intrinsics, window_px: int) -> Doubles:
    half = window_px // 2
    ramp = np.arange(-half, half + 1, dtype=np.float64)
    slope = ramp / (np.sum(ramp * ramp) * window_px)
    flat = np.ones(window_px)
    along_u = cv2.sepFilter2D(inverse, cv2.CV_64F, slope, flat) * k.fx
    along_v = cv2.sepFilter2D(inverse, cv2.CV_64F, flat, slope) * k.fy
    rest = cv2.blur(inverse, (window_px, window_px)) - along_u * directions[..., 0] - along_v * directions[..., 1]
    normals = -np.stack([along_u, along_v, rest], axis=-1)
    unit: Doubles = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    # Where the window hangs over the picture's border the fit is made of mirrored data.
    inside = unit[half:-half, half:-half]
    return np.pad(inside, ((half, half), (half, half), (0, 0)), mode="edge") if inside.size else unit


@dataclass(frozen=True, slots=True)
class AreaMap:
    """The four-corner homography from undistorted pixels to area coordinates, and the area's size."""

    to_area: tuple[tuple[float, float, float], ...]  # 3 rows of 3
    size_mm: tuple[float, float]
    intrinsics: Intrinsics

    def of_point(self, x_mm: float, y_mm: float, z_mm: float) -> tuple[float, float]:
        """Return the area coordinates of a point in camera space."""
        k = self.intrinsics
        return self.of_ideal_pixel(x_mm / z_mm * k.fx + k.cx, y_mm / z_mm * k.fy + k.cy)

    def of_ideal_pixel(self, u: float, v: float) -> tuple[float, float]:
        """Return the area coordinates of an undistorted pixel."""
        (a, b, c), (d, e, f), (g, h, i) = self.to_area
        scale = g * u + h * v + i
        return (a * u + b * v + c) / scale, (d * u + e * v + f) / scale


def map_area(area: AreaCorners, intrinsics: Intrinsics, size_mm: tuple[float, float]) -> AreaMap:
    """Return the AreaMap whose corners, as seen through the lens, are ``area.corners_px``."""
    ideal = undistort(intrinsics, np.array(area.corners_px)).astype(np.float32)
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return AreaMap(
        to_area=tuple((row[0], row[1], row[2]) for row in cv2.getPerspectiveTransform(ideal, unit).tolist()),
        size_mm=size_mm,
        intrinsics=intrinsics,
    )


def whole_picture(sensor: Sensor) -> AreaCorners:
    """Return the area that is the whole picture: x = u/(W−1), y = v/(H−1)."""
    right, bottom = float(sensor.size[0] - 1), float(sensor.size[1] - 1)
    return AreaCorners(((0.0, 0.0), (right, 0.0), (right, bottom), (0.0, bottom)))


def measured_size_mm(area: AreaCorners, surface_map: SurfaceMap) -> tuple[float, float]:
    """Return the area's width and height as they lie on the surface: means of opposite sides, in mm."""
    height, width = surface_map.depth.shape
    corners = np.clip(np.rint(np.array(area.corners_px)).astype(int), 0, [width - 1, height - 1])
    at = (corners[:, 1], corners[:, 0])
    points = surface_map.rays[at].astype(np.float64) * surface_map.depth[at][:, None]
    sides = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)
    return float(sides[0] + sides[2]) / 2.0, float(sides[1] + sides[3]) / 2.0
