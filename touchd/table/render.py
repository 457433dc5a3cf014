"""True depth: what an ideal camera would measure along its optical axis, one ray through each pixel.

The table is intersected once. Solids are intersected inside their own boxes of the picture, all rays of one
at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchd.geometry import Doubles, distort, project_ideal, rays
from touchd.model import Floats, frozen_array
from touchd.table.boxes import Box
from touchd.table.casting import Swept, depth_of, pieces
from touchd.table.scene import Hand, Solid, TableCamera

_NEAREST_MM = 20.0  # solids that come closer to the camera than this may cover the whole picture
_MARGIN_PX = 2
_CUBE = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
_RIM = np.array([[i, j] for i in (0.0, 0.5, 1.0) for j in (0.0, 0.5, 1.0)])


@dataclass(frozen=True, slots=True)
class Seen:
    """A part of a hand in the picture: the box that holds it, and a depth that none of it is nearer than."""

    box: Box
    nearest_mm: float


@dataclass(frozen=True, slots=True)
class DepthPicture:
    """True depth (H, W) in mm, and what is seen in it besides the table."""

    depth_mm: Floats
    seen: tuple[Seen, ...]


class DepthRenderer:
    """Renders hands over the table as seen by one camera."""

    def __init__(self, camera: TableCamera, size: tuple[int, int]) -> None:
        self.camera = camera
        self.size = size
        u, v = np.meshgrid(np.arange(size[0], dtype=np.float64), np.arange(size[1], dtype=np.float64))
        ray = rays(camera.intrinsics, np.stack([u, v], -1))
        self._x = np.ascontiguousarray(ray[..., 0], np.float32)
        self._y = np.ascontiguousarray(ray[..., 1], np.float32)
        self._length2 = np.sum(ray * ray, -1).astype(np.float32)
        self.table_mm: Floats = frozen_array(_plane_depth(camera, ray).astype(np.float32))

    def render(self, hands: Sequence[Hand]) -> DepthPicture:
        """Return the depth of the nearest surface for every pixel."""
        depth = self.table_mm.copy()
        seen: list[Seen] = []
        for swept, box in self._placed([solid for hand in hands for solid in hand.solids]):
            window = box.window
            hit = depth_of(swept, self._x[window], self._y[window], self._length2[window])
            np.fmin(depth[window], hit, out=depth[window])
            seen.append(Seen(box, swept.nearest))
        return DepthPicture(depth, tuple(seen))

    def _placed(self, solids: Sequence[Solid]) -> list[tuple[Swept, Box]]:
        """Return solids as swept balls in camera space with their boxes; nothing for those out of view."""
        parts = [piece for solid in solids for piece in pieces(solid)]
        if not parts:
            return []
        ends = self.camera.to_camera(np.array([(a, b) for a, b, _, _ in parts]))
        radii = np.array([(radius_a, radius_b) for _, _, radius_a, radius_b in parts])
        along = ends[:, 1] - ends[:, 0]
        grow = radii[:, 1] - radii[:, 0]
        room = np.sum(along * along, -1) - grow * grow
        return [
            (Swept(ends[i, 0], along[i], float(radii[i, 0]), float(grow[i]), float(room[i])), box)
            for i, box in enumerate(self._boxes(ends, radii))
            if not box.empty
        ]

    def _boxes(self, ends_mm: Doubles, radii_mm: Doubles) -> list[Box]:
        """Return boxes of the picture that hold what is spanned by balls at ends (N, 2, 3) with radii (N, 2).

        A ball lies inside its bounding cube, and the cube's corners bound its picture. The lens's distortion
        is radial and gentle, so that a box's corners and the middles of its sides bound the distorted box.
        """
        cubes = ends_mm[:, :, None, :] + radii_mm[:, :, None, None] * _CUBE
        near = cubes[..., 2].min((1, 2)) < _NEAREST_MM
        cubes[near] = 1.0
        ideal = project_ideal(self.camera.intrinsics, cubes)
        low, high = ideal.min((1, 2)), ideal.max((1, 2))
        rim = distort(self.camera.intrinsics, low[:, None] + _RIM * (high - low)[:, None])
        size = np.array(self.size)
        first = np.clip(np.floor(rim.min(1)) - _MARGIN_PX, 0, size).astype(int)
        last = np.clip(np.ceil(rim.max(1)) + _MARGIN_PX + 1, 0, size).astype(int)
        first[near], last[near] = 0, size
        return [Box(*corners) for corners in np.concatenate([first, last], 1).tolist()]


def _plane_depth(camera: TableCamera, ray: Doubles) -> Doubles:
    """Return the depth (H, W) at which rays (H, W, 3) meet the table, infinite where they pass over it."""
    up = camera.axes()[2]
    facing = ray @ up
    with np.errstate(divide="ignore"):
        depth: Doubles = camera.height_mm * up[2] / facing
    return np.where(facing < 0.0, depth, np.inf)
