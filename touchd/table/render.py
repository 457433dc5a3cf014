"""True depth: what an ideal camera would measure along its optical axis, one ray through each pixel.

The empty surface is intersected once. Solids are intersected inside their own boxes of the picture, all rays of one
at once.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from touchd.geometry import Doubles, distort, project_ideal, rays
from touchd.model import Floats, Mask
from touchd.table.backdrop import backdrop
from touchd.table.boxes import Box
from touchd.table.casting import Cuboid, Swept, cuboid_depth, pieces, swept, swept_depths
from touchd.table.relief import FLAT_TABLE, Ground
from touchd.table.scene import Block, Capsule, Hand, Solid, Sphere, TableCamera

_NEAREST_MM = 20.0  # solids that come closer to the camera than this may cover the whole picture
_MARGIN_PX = 2
_RAYS_AT_ONCE = 12_000  # so many that calls cost little, so few that the processor's cache holds them
_CUBE = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
_RIM = np.array([[i, j] for i in (0.0, 0.5, 1.0) for j in (0.0, 0.5, 1.0)])

Body: TypeAlias = Swept | Cuboid


@dataclass(frozen=True, slots=True)
class Seen:
    """A part of a hand in the picture: the box that holds it, and a depth that none of it is nearer than."""

    box: Box
    nearest_mm: float


@dataclass(frozen=True, slots=True)
class DepthPicture:
    """True depth (H, W) in mm, what is seen in it besides the empty surface, and where that is dark (None: nowhere)."""

    depth_mm: Floats
    seen: tuple[Seen, ...]
    dark: Mask | None = None


class DepthRenderer:
    """Renders hands over a surface as seen by one camera."""

    def __init__(self, camera: TableCamera, size: tuple[int, int], ground: Ground = FLAT_TABLE) -> None:
        self.camera = camera
        self.size = size
        u, v = np.meshgrid(np.arange(size[0], dtype=np.float64), np.arange(size[1], dtype=np.float64))
        ray = rays(camera.intrinsics, np.stack([u, v], -1))
        self._x = np.ascontiguousarray(ray[..., 0], np.float32)
        self._y = np.ascontiguousarray(ray[..., 1], np.float32)
        self._length2 = np.sum(ray * ray, -1).astype(np.float32)
        self.empty = backdrop(camera, ground, ray)

    @property
    def table_mm(self) -> Floats:
        """The depth (H, W) of the empty surface."""
        return self.empty.depth_mm

    def render(self, hands: Sequence[Hand]) -> DepthPicture:
        """Return the depth of the nearest surface for every pixel."""
        depth = self.table_mm.copy()
        lit = self._placed([solid for hand in hands for solid in hand.solids])
        for box, hit in self._hits(lit):
            np.fmin(depth[box.window], hit, out=depth[box.window])
        seen = [Seen(box, body.nearest) for body, box in lit]
        black = self._placed([solid for hand in hands for solid in hand.dark])
        if not black:
            return DepthPicture(depth, tuple(seen))
        dark = np.zeros(depth.shape, np.bool_)
        for box, hit in self._hits(black):
            dark[box.window] |= hit < depth[box.window]
            np.fmin(depth[box.window], hit, out=depth[box.window])
        return DepthPicture(depth, (*seen, *(Seen(box, body.nearest) for body, box in black)), dark)

    def _hits(self, placed: Sequence[tuple[Body, Box]]) -> Iterator[tuple[Box, Floats]]:
        """Yield the depth (h, w) of each body in its box, NaN where it is not."""
        several: list[tuple[Swept, Box]] = []
        for body, box in placed:
            if isinstance(body, Cuboid):
                yield box, cuboid_depth(body, self._x[box.window], self._y[box.window])
                continue
            several.append((body, box))
            if sum(box.area for _, box in several) > _RAYS_AT_ONCE:
                yield from self._swept_hits(several)
                several = []
        if several:
            yield from self._swept_hits(several)

    def _swept_hits(self, several: Sequence[tuple[Swept, Box]]) -> Iterator[tuple[Box, Floats]]:
        boxes = [box for _, box in several]
        counts = [box.area for box in boxes]
        x, y, length2 = (
            np.concatenate([picture[box.window].ravel() for box in boxes])
            for picture in (self._x, self._y, self._length2)
        )
        depths = swept_depths([body for body, _ in several], counts, x, y, length2)
        for box, depth in zip(boxes, np.split(depths, np.cumsum(counts)[:-1]), strict=True):
            yield box, depth.reshape(box.bottom - box.top, box.right - box.left)

    def _placed(self, solids: Sequence[Solid]) -> list[tuple[Body, Box]]:
        """Return solids in camera space with their boxes; nothing for those out of view."""
        bodies = self._swept([solid for solid in solids if isinstance(solid, Capsule | Sphere)])
        bodies += [self._cuboid(solid) for solid in solids if isinstance(solid, Block)]
        return [(body, box) for body, box in bodies if not box.empty]

    def _swept(self, solids: Sequence[Capsule | Sphere]) -> list[tuple[Body, Box]]:
        parts = [piece for solid in solids for piece in pieces(solid)]
        if not parts:
            return []
        ends = self.camera.to_camera(np.array([(a, b) for a, b, _, _ in parts]))
        radii = np.array([(radius_a, radius_b) for _, _, radius_a, radius_b in parts])
        return [
            (swept(ends[i, 0], ends[i, 1], parts[i][2], parts[i][3]), box)
            for i, box in enumerate(self._boxes(ends, radii))
            if not box.empty
        ]

    def _cuboid(self, block: Block) -> tuple[Body, Box]:
        corners = self.camera.to_camera(block.corners_mm())
        (box,) = self._boxes(corners[None], np.zeros((1, 8)))
        return Cuboid(corners.mean(0), block.axes() @ self.camera.axes(), 0.5 * np.array(block.size_mm)), box

    def _boxes(self, ends_mm: Doubles, radii_mm: Doubles) -> list[Box]:
        """Return boxes of the picture that hold what is spanned by balls at places (N, K, 3) with radii (N, K).

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
