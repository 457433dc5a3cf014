"""Where the active area is in the picture; guessing it: the largest flat rectangle around the picture's centre."""

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.geometry import AreaMap, SurfaceMap
from touchd.model import AreaCorners, Mask, Surface

# Nearer to the plane than this the surface counts as flat; a share of the distance, since noise grows with it.
_FLAT_SHARE = 0.012
_GRID_PX = 8
# Blobs are looked for this far outside the area, so that a finger on its border is seen whole.
_MARGIN_MM = 20.0


def inside_of(corners: AreaCorners, shape: tuple[int, ...]) -> Mask:
    """Return the pixels (H, W) of an area in a picture of this shape."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(mask, np.rint(np.array(corners.corners_px)).astype(np.int32), (1,))
    return mask > 0


def with_margin(inside: Mask, area: AreaMap, surface_map: SurfaceMap) -> Mask:
    """Return the pixels (H, W) of an area with those around it that a finger on its border may cover."""
    if not inside.any():
        return inside
    reach = int(_MARGIN_MM * area.intrinsics.fx / float(np.median(surface_map.depth[inside]))) + 1
    return cv2.dilate(inside.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0


def flat_area(surface: Surface, surface_map: SurfaceMap) -> AreaCorners | None:
    """Return the largest upright rectangle of flat surface that holds the picture's centre, or None without one.

    Works on a coarse grid; a cell is flat when nine tenths of its pixels are.
    """
    plane = surface_map.plane
    if plane is None:
        return None
    off_plane = np.abs(plane.depth_mm(surface_map.rays.astype(np.float64)) - surface_map.depth)
    flat: Mask = surface.valid & (off_plane < _FLAT_SHARE * surface_map.depth)
    rows, columns = flat.shape[0] // _GRID_PX, flat.shape[1] // _GRID_PX
    cells = cv2.resize(
        flat[: rows * _GRID_PX, : columns * _GRID_PX].astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA
    )
    box = _largest_box(cells >= 0.9, rows // 2, columns // 2)
    if box is None:
        return None
    top, bottom, left, right = (float(edge * _GRID_PX) for edge in box)
    return AreaCorners(((left, top), (right - 1, top), (right - 1, bottom - 1), (left, bottom - 1)))


def _largest_box(flat: NDArray[np.bool_], row: int, column: int) -> tuple[int, int, int, int] | None:
    """Return the largest all-true box (top, bottom, left, right; ends excluded) that holds a cell, or None."""
    if not flat[row, column]:
        return None
    best, best_size = None, 0
    left_limit = [_run(flat[r, : column + 1][::-1]) for r in range(len(flat))]
    right_limit = [_run(flat[r, column:]) for r in range(len(flat))]
    for top in range(row, -1, -1):
        if not left_limit[top]:
            break
        reach_left, reach_right = min(left_limit[top : row + 1]), min(right_limit[top : row + 1])
        for bottom in range(row, len(flat)):
            reach_left, reach_right = min(reach_left, left_limit[bottom]), min(reach_right, right_limit[bottom])
            if not reach_left:
                break
            size = (bottom - top + 1) * (reach_left + reach_right - 1)
            if size > best_size:
                best, best_size = (top, bottom + 1, column - reach_left + 1, column + reach_right), size
    return best


def _run(cells: NDArray[np.bool_]) -> int:
    """Return how many cells from the first on are true."""
    blocked = np.flatnonzero(~cells)
    return int(blocked[0]) if blocked.size else len(cells)
