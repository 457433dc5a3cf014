"""From touched points to the area's corners, and how well the points agree on the surface."""

from collections.abc import Sequence

import cv2
import numpy as np

from touchd.align.alignment import Alignment, AlignmentError
from touchd.geometry import Doubles, SurfaceMap, distort
from touchd.model import Intrinsics

CORNER_NAMES = ("top-left corner", "top-right corner", "bottom-right corner", "bottom-left corner")
GRID_NAMES = (
    *("top-left corner", "middle of the top edge", "top-right corner"),
    *("middle of the left edge", "centre", "middle of the right edge"),
    *("bottom-left corner", "middle of the bottom edge", "bottom-right corner"),
)
POINT_NAMES = {len(CORNER_NAMES): CORNER_NAMES, len(GRID_NAMES): GRID_NAMES}

_GRID = np.array([(x, y) for y in (0.0, 0.5, 1.0) for x in (0.0, 0.5, 1.0)])
_GRID_CORNERS = [0, 2, 8, 6]
_LEAST_SIDE_MM = 20.0
_LEAST_SINE = 0.05  # of the angle at a corner: 3 degrees off a straight line, as in the config
# A touched point this far from where the other eight put it is another point: share of the shorter side, and mm.
_ASTRAY_SHARE, _ASTRAY_MM = 0.05, 25.0
_ORDER = "align again, in the order top-left, top-right, bottom-right, bottom-left"


def solve_alignment(
    touched: Sequence[tuple[float, float]], intrinsics: Intrinsics, surface_map: SurfaceMap
) -> Alignment:
    """Return the alignment from touched points, as undistorted pixels (u, v).

    Four points are the corners, in the order of ``CORNER_NAMES``; the residual is the rms distance on the surface
    from the rectangle that fits them best. Nine are the points of an even 3x3 grid, in the order of ``GRID_NAMES``:
    the corners follow from the homography that fits them best in the picture, and the residual is the rms distance
    between touched and fitted points on the surface.

    Raises AlignmentError, naming the point that looks wrong, if they are no outline of an area.
    """
    points = np.array(touched, np.float64)
    if len(points) == len(_GRID):
        _check_grid(points, intrinsics, surface_map)
        fitted = _fit_grid(_GRID, points, _GRID)
        corners = fitted[_GRID_CORNERS]
        off = on_surface(surface_map, intrinsics, points) - on_surface(surface_map, intrinsics, fitted)
        residual_mm = float(np.sqrt(np.mean(np.sum(off * off, axis=1))))
    else:
        corners = points
        residual_mm = rectangle_residual_mm(on_surface(surface_map, intrinsics, corners))
    on_table = on_surface(surface_map, intrinsics, corners)
    sides = np.linalg.norm(np.roll(on_table, -1, axis=0) - on_table, axis=1)
    _check_outline(corners, sides)
    a, b, c, d = distort(intrinsics, corners).tolist()
    return Alignment(
        corners_px=((a[0], a[1]), (b[0], b[1]), (c[0], c[1]), (d[0], d[1])),
        size_mm=(float(sides[0] + sides[2]) / 2.0, float(sides[1] + sides[3]) / 2.0),
        residual_mm=residual_mm,
        points=len(points),
    )


def on_surface(surface_map: SurfaceMap, intrinsics: Intrinsics, ideal_px: Doubles) -> Doubles:
    """Return the points (N, 3) of the surface, in mm in camera space, seen at undistorted pixels (N, 2)."""
    feet = (surface_map.foot(u, v, 0.0) for u, v in distort(intrinsics, ideal_px).tolist())
    return np.array([(foot.x_mm, foot.y_mm, foot.z_mm) for foot in feet])


def rectangle_residual_mm(corners_mm: Doubles) -> float:
    """Return the rms distance of four points (4, 3), in order around, from the rectangle that fits them best.

    In the best plane through the points and with p their places around their mean, e = (−p0 + p1 + p2 − p3)/4 and
    f = (−p0 − p1 + p2 + p3)/4 are the half sides of the best parallelogram. The best rectangle with sides along
    the unit vectors u and u⟂ has the half sides u·e and u⟂·f, and leaves Σ|p|² − 4((u·e)² + (u⟂·f)²): least for u
    the principal vector of e·eᵀ + g·gᵀ, where g is f turned back by a right angle.
    """
    around = corners_mm - corners_mm.mean(axis=0)
    axes = np.linalg.svd(around, full_matrices=False)[2]
    flat = around @ axes[:2].T
    e = np.array([-1.0, 1.0, 1.0, -1.0]) @ flat / 4.0
    f = np.array([-1.0, -1.0, 1.0, 1.0]) @ flat / 4.0
    g = np.array([f[1], -f[0]])
    explained = float(np.linalg.eigvalsh(np.outer(e, e) + np.outer(g, g))[-1])
    return float(np.sqrt(max(0.0, float(np.sum(around * around)) / 4.0 - explained)))


def _fit_grid(grid: Doubles, touched: Doubles, wanted: Doubles) -> Doubles:
    """Return where the homography that fits best from ``grid`` to ``touched`` (both (N, 2)) puts ``wanted``."""
    found, _ = cv2.findHomography(grid, touched, 0)
    fitted = np.full(wanted.shape, np.nan)
    if found is not None:
        fitted = np.asarray(cv2.perspectiveTransform(wanted[None], found)[0], np.float64)
    if not np.isfinite(fitted).all():
        raise AlignmentError("the touched points lie on a line or on one another; align again")
    return fitted


def _check_grid(touched: Doubles, intrinsics: Intrinsics, surface_map: SurfaceMap) -> None:
    """Refuse nine points if one of them is far from where the others say that it is."""
    there = on_surface(surface_map, intrinsics, touched)
    worst, spread_mm, astray_mm = 0, np.inf, 0.0
    for index in range(len(_GRID)):
        others = np.arange(len(_GRID)) != index
        expected = on_surface(surface_map, intrinsics, _fit_grid(_GRID[others], touched[others], _GRID))
        off_mm = np.linalg.norm(there - expected, axis=1)
        if float(np.sum(off_mm[others] ** 2)) < spread_mm:
            worst, spread_mm, astray_mm = index, float(np.sum(off_mm[others] ** 2)), float(off_mm[index])
    corners = there[_GRID_CORNERS]
    shorter_mm = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).min())
    if astray_mm > max(_ASTRAY_MM, _ASTRAY_SHARE * shorter_mm):
        raise AlignmentError(
            f"the {GRID_NAMES[worst]} was touched {astray_mm:.0f} mm from where the other points put it; align again, "
            "row by row from the top-left corner"
        )


def _check_outline(corners: Doubles, sides_mm: Doubles) -> None:
    """Refuse corners (4, 2), as undistorted pixels, that are not convex and clockwise in the picture."""
    for first in range(4):
        if sides_mm[first] < _LEAST_SIDE_MM:
            raise AlignmentError(
                f"the {CORNER_NAMES[first]} and the {CORNER_NAMES[(first + 1) % 4]} were touched {sides_mm[first]:.0f} "
                f"mm apart, and an area's sides are at least {_LEAST_SIDE_MM:.0f} mm long; {_ORDER}"
            )
    sines = _turns(corners)
    flattest = int(np.argmin(np.abs(sines)))
    rights = int(np.count_nonzero(sines > 0.0))
    if rights >= 3 and abs(sines[flattest]) < _LEAST_SINE:
        raise AlignmentError(f"the {CORNER_NAMES[flattest]} lies in a line with its neighbours; {_ORDER}")
    if rights == 0:
        raise AlignmentError(f"the corners run anticlockwise for the camera, as in a mirror; {_ORDER}")
    if rights == 2:
        raise AlignmentError(f"{_swapped(corners)} look swapped; {_ORDER}")
    if rights != 4:
        odd = int(np.argmin(sines) if rights == 3 else np.argmax(sines))
        raise AlignmentError(f"the {CORNER_NAMES[odd]} dents the area inwards; {_ORDER}")


def _turns(corners: Doubles) -> Doubles:
    """Return the sines of the turns at the corners; with v down, a turn to the right in the picture is positive."""
    after = np.roll(corners, -1, axis=0) - corners
    before = np.roll(after, 1, axis=0)
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    sines: Doubles = cross / np.maximum(lengths, 1e-9)
    return sines


def _swapped(corners: Doubles) -> str:
    for first in range(4):
        second = (first + 1) % 4
        order = np.arange(4)
        order[[first, second]] = second, first
        if (_turns(corners[order]) > 0.0).all():
            return f"the {CORNER_NAMES[first]} and the {CORNER_NAMES[second]}"
    return "two corners"
