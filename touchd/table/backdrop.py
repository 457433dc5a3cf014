"""The empty surface as a camera sees it: worked out once, by walking along each ray until it is under the surface."""

from dataclasses import dataclass

import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats, Mask, frozen_array
from touchd.table.relief import Ground
from touchd.table.scene import TableCamera

_STEPS = 96
_HALVINGS = 14
_SLANT = 2.5  # how far beside its foot, in its own height, a thing may be seen


@dataclass(frozen=True, slots=True)
class Backdrop:
    """True depth (H, W) in mm of the empty surface, and of the table's plane as if nothing were on or beside it.

    The plane is infinitely far where rays pass over it.
    """

    depth_mm: Floats
    plane_mm: Floats

    @property
    def flat(self) -> bool:
        """Whether there is nothing but the plane."""
        return bool(np.array_equal(self.depth_mm, self.plane_mm))


def backdrop(camera: TableCamera, ground: Ground, ray: Doubles) -> Backdrop:
    """Return what rays (H, W, 3) with z = 1 meet of the ground."""
    plane = _level_depth(camera, ray, 0.0)
    depth = plane.copy()
    if ground.things:
        _walk(camera, ground, ray, depth)
    if ground.edges_mm is not None:
        known = np.isfinite(plane)
        spots = _on_table(camera, ray, np.where(known, plane, 0.0))
        beside = known & ground.beside(spots[..., 0], spots[..., 1])
        depth[beside] = _level_depth(camera, ray[beside], ground.floor_mm)
    return Backdrop(frozen_array(depth.astype(np.float32)), frozen_array(plane.astype(np.float32)))


def _level_depth(camera: TableCamera, ray: Doubles, level_mm: float) -> Doubles:
    """Return the depth at which rays meet a level over the table, infinite where they pass over it."""
    up = camera.axes()[2]
    facing = ray @ up
    with np.errstate(divide="ignore"):
        depth: Doubles = (camera.origin_mm() @ up + level_mm) / facing
    return np.where(facing < 0.0, depth, np.inf)


def _on_table(camera: TableCamera, ray: Doubles, depth_mm: Doubles) -> Doubles:
    """Return points along rays, by their depth, in table coordinates."""
    points: Doubles = (ray * depth_mm[..., None] - camera.origin_mm()) @ camera.axes().T
    return points


def _walk(camera: TableCamera, ground: Ground, ray: Doubles, depth: Doubles) -> None:
    """Lower ``depth`` to where rays first meet a thing: a step at a time, then by halving the step that does."""
    known = np.isfinite(depth)
    known[known] = _near_things(ground, _on_table(camera, ray[known], depth[known]))
    directions = ray[known]
    far = depth[known]
    near = _level_depth(camera, directions, ground.top_mm)
    above, below, open_ = near.copy(), far.copy(), np.ones(far.shape, np.bool_)
    for step in range(1, _STEPS + 1):
        at = near + (far - near) * (step / _STEPS)
        under = open_ & _inside(camera, ground, directions, at)
        below[under] = at[under]
        open_ &= ~under
        above[open_] = at[open_]
    for _ in range(_HALVINGS):
        middle = 0.5 * (above + below)
        under = _inside(camera, ground, directions, middle)
        below, above = np.where(under, middle, below), np.where(under, above, middle)
    depth[known] = below


def _near_things(ground: Ground, points_mm: Doubles) -> Mask:
    """Return which points of the table (N, 3) have a thing above them or, seen slantwise, beside them."""
    near = np.zeros(len(points_mm), np.bool_)
    for thing in ground.things:
        away = np.hypot(points_mm[:, 0] - thing.centre_mm[0], points_mm[:, 1] - thing.centre_mm[1])
        near |= away < thing.reach_mm + _SLANT * thing.top_mm
    return near


def _inside(camera: TableCamera, ground: Ground, directions: Doubles, depth_mm: Doubles) -> Mask:
    """Return which points along rays lie under the surface."""
    points = _on_table(camera, directions, depth_mm)
    under: Mask = points[..., 2] <= ground.height_mm(points[..., 0], points[..., 1])
    return under
