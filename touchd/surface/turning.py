"""Where the area's corners are seen after a camera was knocked: as far as planes tell how it moved.

A plane tells how a camera turned towards it and how far off it is by now, but neither how it turned about the plane's
normal nor how it slid along the plane. A knocked mount does next to none of both, so the least motion that explains
the two planes is taken.
"""

import numpy as np

from touchd.geometry import Doubles, Plane, distort_pixel, undistort
from touchd.model import AreaCorners, Intrinsics

_OPPOSITE = -0.9  # cosine between two normals, of which no camera on a table turns as far


def corners_after(corners: AreaCorners, intrinsics: Intrinsics, before: Plane, after: Plane) -> AreaCorners | None:
    """Return where corners on a plane are seen once it lies otherwise; None if it lies as no knock would have it."""
    turn = turn_between(before.normal, after.normal)
    if turn is None:
        return None
    ideal = undistort(intrinsics, np.array(corners.corners_px, np.float64))
    k = intrinsics
    rays = np.column_stack([(ideal[:, 0] - k.cx) / k.fx, (ideal[:, 1] - k.cy) / k.fy, np.ones(len(ideal))])
    there = rays * before.depth_mm(rays)[:, None]
    now = there @ turn.T - (after.distance_mm - before.distance_mm) * after.normal
    if np.any(now[:, 2] <= 0.0):
        return None
    seen = [distort_pixel(k, x / z * k.fx + k.cx, y / z * k.fy + k.cy) for x, y, z in now.tolist()]
    return AreaCorners((seen[0], seen[1], seen[2], seen[3]), corners.size_mm)


def turn_between(before: Doubles, after: Doubles) -> Doubles | None:
    """Return the least rotation (3, 3) that takes one unit vector to another; None for nearly opposite ones.

    With v = a x b and c = a · b it is 1 + [v] + [v]² / (1 + c), where [v] w = v x w (Rodrigues).
    """
    cosine = float(np.dot(before, after))
    if cosine < _OPPOSITE:
        return None
    x, y, z = np.cross(before, after).tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Doubles = np.eye(3) + across + across @ across / (1.0 + cosine)
    return turn
