"""A table to align on, and what is seen of a rectangle on it."""

import math

import numpy as np
from touchd.geometry import (
    Doubles,
    SurfaceMap,
    kinect_v1_sensor,
    map_surface,
    project_ideal,
    raw_of_depth,
    rays,
)
from touchd.model import Intrinsics, Surface

LENS = Intrinsics(580.0, 580.0, 319.5, 239.5, k1=0.05, k2=-0.1)
SENSOR = kinect_v1_sensor(intrinsics=LENS)
FRAME_NS = 33_333_333
NORMAL = np.array([0.0, math.sin(0.3), -math.cos(0.3)])
# A rectangle of 500 x 300 mm on the tilted table, turned a little in it.
AROUND = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
GRID = np.array([(x, y) for y in (-1.0, 0.0, 1.0) for x in (-1.0, 0.0, 1.0)])


def tilted_table() -> SurfaceMap:
    """Return a flat table, 942 mm away along the optical axis and tilted by 0.3 rad."""
    v, u = np.mgrid[0:480, 0:640].astype(float)
    directions = rays(LENS, np.stack([u, v], axis=-1))
    reference = raw_of_depth(SENSOR, 900.0 / (directions @ -NORMAL))
    everywhere = np.ones(reference.shape, bool)
    surface = Surface(
        sensor=SENSOR,
        reference=reference.astype(np.float32),
        dmax=np.floor(reference).astype(np.uint16),
        noise=np.full(reference.shape, 0.2, np.float32),
        valid=everywhere,
        moved=~everywhere,
        frames=1,
        made_from="a test",
    )
    return map_surface(surface)


def pixels(places: Doubles, off_mm: Doubles | float = 0.0) -> list[tuple[float, float]]:
    """Undistorted pixels of places in the rectangle, its corners at ±1, moved by so many mm on the table."""
    along = np.array([math.cos(0.1), math.sin(0.1), 0.0])
    along -= (along @ NORMAL) * NORMAL
    along /= np.linalg.norm(along)
    down = np.cross(along, NORMAL)
    down *= np.sign(down[1])
    flat = places * np.array([250.0, 150.0]) + off_mm
    points = np.array([0.0, 0.0, 900.0 / math.cos(0.3)]) + flat[:, :1] * along + flat[:, 1:] * down
    return [(u, v) for u, v in project_ideal(LENS, points).tolist()]
