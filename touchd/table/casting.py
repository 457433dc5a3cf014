"""Rays against solids, in camera space.

All rays start in the camera and have z = 1, so that the length t along a ray is the depth itself. Many small solids
are met at once: their rays lie one after the other in flat arrays, so that each step is one call for all.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

import cv2
import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats
from touchd.table.scene import Capsule, Point, Sphere

_TINY = 1e-6
_LONGEST = 2.5  # length over mean thickness of a piece that is cast as one


@dataclass(frozen=True, slots=True)
class Swept:
    """A ball swept along a line in camera space, its radius growing evenly by ``grow`` on the way ``along``.

    ``room`` is the squared length of the way minus the square of ``grow``; it is positive.
    """

    start: Doubles  # (3,)
    along: Doubles  # (3,)
    radius: float
    grow: float
    room: float

    @property
    def nearest(self) -> float:
        """Return the least depth of any of it."""
        begin = float(self.start[2])
        return min(begin - self.radius, begin + float(self.along[2]) - self.radius - self.grow)


@dataclass(frozen=True, slots=True)
class Cuboid:
    """A cuboid in camera space: its middle, its own axes as the rows of a matrix, and half its size along them."""

    centre: Doubles  # (3,)
    axes: Doubles  # (3, 3)
    half: Doubles  # (3,)

    @property
    def nearest(self) -> float:
        """Return the least depth of any of it."""
        return float(self.centre[2] - np.abs(self.axes[:, 2]) @ self.half)


def swept(start: Doubles, end: Doubles, radius: float, end_radius: float) -> Swept:
    """Return what a ball sweeps between two places (3,); where one end's ball holds the other's, that ball alone."""
    along, grow = end - start, end_radius - radius
    room = float(along @ along) - grow * grow
    if room > _TINY:
        return Swept(start, along, radius, grow, room)
    return Swept(start if grow <= 0.0 else end, np.zeros(3), max(radius, end_radius), 0.0, 1.0)


def pieces(solid: Capsule | Sphere) -> list[tuple[Point, Point, float, float]]:
    """Return a solid as swept balls (from, to, radii) so short that boxes around them hold little else."""
    match solid:
        case Sphere(centre_mm, radius_mm):
            return [(centre_mm, centre_mm, radius_mm, radius_mm)]
        case Capsule(a_mm, b_mm, radius_a_mm, radius_b_mm):
            count = max(1, round(dist(a_mm, b_mm) / (_LONGEST * (radius_a_mm + radius_b_mm))))
            shares = [i / count for i in range(count + 1)]
            joints = [_between(a_mm, b_mm, share) for share in shares]
            radii = [radius_a_mm + (radius_b_mm - radius_a_mm) * share for share in shares]
            return list(zip(joints[:-1], joints[1:], radii[:-1], radii[1:], strict=True))


def swept_depths(bodies: Sequence[Swept], rays: Sequence[int], x: Floats, y: Floats, length2: Floats) -> Floats:
    """Return the depth (N,) at which rays (x, y, 1) of squared length ``length2`` meet their body, NaN for a miss.

    The first ``rays[0]`` of the N rays belong to the first body, and so on.

    The balls' common envelope is a cone: |t·ray - start|² - radius² - s²·room = 0 where s = (t·to_along +
    lead)/room says which ball touches it there (from eliminating s between the ball's equation and its
    derivative by s). Where that s lies beyond an end, the end's own ball is what the ray may still meet.
    """
    numbers = _constants(bodies)
    mine = numbers if len(bodies) == 1 else np.repeat(numbers, rays, axis=1)
    to_start, to_along = _dot(x, y, mine[0:3]), _dot(x, y, mine[3:6])
    minus_room, lead_share, rest = mine[6:9]
    half = to_along * lead_share
    half += to_start
    square = to_along * to_along
    square *= minus_room
    square += length2
    square *= rest
    under_root = half * half
    under_root -= square
    with np.errstate(invalid="ignore"):  # the root of a negative number is how a ray says that it misses
        share = rest / _root_sum(half, under_root)
        share *= to_along
        share *= -minus_room
        share += lead_share
        np.clip(share, 0.0, 1.0, out=share)
        to_along *= share
        to_along += to_start
        depth: Floats = _sphere(to_along, length2, _centre_rest(share, mine[9:12]))
    return depth


def cuboid_depth(cuboid: Cuboid, x: Floats, y: Floats) -> Floats:
    """Return the depth at which rays (x, y, 1) first lie between all pairs of a cuboid's sides, NaN for a miss."""
    enter = np.full(x.shape, -np.inf, np.float32)
    leave = np.full(x.shape, np.inf, np.float32)
    with np.errstate(divide="ignore"):
        for axis, half in zip(cuboid.axes, cuboid.half.tolist(), strict=True):
            slant, middle = np.float32(1.0) / _plain_dot(x, y, axis), float(axis @ cuboid.centre)
            first, second = slant * np.float32(middle - half), slant * np.float32(middle + half)
            np.maximum(enter, np.minimum(first, second), out=enter)
            np.minimum(leave, np.maximum(first, second), out=leave)
    enter[enter > leave] = np.nan
    return enter


def _constants(bodies: Sequence[Swept]) -> Floats:
    """Return what the equations need of each body (12, bodies).

    Start and way, -1/room, lead/room, the cone's rest, and the three of :func:`_centre_rest`.
    """
    start = np.array([body.start for body in bodies])
    along = np.array([body.along for body in bodies])
    radius, grow, room = np.array([(body.radius, body.grow, body.room) for body in bodies]).T
    lead = radius * grow - np.sum(start * along, 1)
    ball = np.sum(start * start, 1) - radius * radius
    rows = [*start.T, *along.T, -1.0 / room, lead / room, ball - lead * lead / room, room, -2.0 * lead, ball]
    numbers: Floats = np.array(rows, np.float32)
    return numbers


def _centre_rest(share: Floats, numbers: Floats) -> Floats:
    """Return |centre|² - radius² of the balls at shares of the way: room·s² - 2·lead·s + that of the first."""
    rest: Floats = share * numbers[0]
    rest += numbers[1]
    rest *= share
    rest += numbers[2]
    return rest


def _between(a_mm: Point, b_mm: Point, share: float) -> Point:
    x_mm, y_mm, z_mm = (a * (1.0 - share) + b * share for a, b in zip(a_mm, b_mm, strict=True))
    return (x_mm, y_mm, z_mm)


def _dot(x: Floats, y: Floats, vector: Floats) -> Floats:
    """Return the dot product of rays (x, y, 1) with vectors (3, 1 or N)."""
    out: Floats = x * vector[0]
    out += y * vector[1]
    out += vector[2]
    return out


def _plain_dot(x: Floats, y: Floats, vector: Doubles) -> Floats:
    """Return the dot product of rays (x, y, 1) with one vector."""
    out = np.empty(x.shape, np.float32)
    cv2.addWeighted(x, float(vector[0]), y, float(vector[1]), float(vector[2]), dst=out)
    return out


def _sphere(to_centre: Floats, length2: Floats, rest: Floats) -> Floats:
    """Return where rays meet a ball, NaN where they miss: t²·length2 - 2t·to_centre + rest = 0."""
    under_root = to_centre * to_centre
    under_root -= length2 * rest
    depth: Floats = rest / _root_sum(to_centre, under_root)
    return depth


def _root_sum(half: Floats, under_root: Floats) -> Floats:
    """Return half + root, a quadratic's denominator that does not cancel; tiny for what lies behind the camera."""
    np.sqrt(under_root, out=under_root)
    under_root += half
    return np.maximum(under_root, np.float32(_TINY), out=under_root)
