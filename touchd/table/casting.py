"""Rays against solids, in camera space.

All rays start in the camera and have z = 1, so that the length t along a ray is the depth itself.
"""

from dataclasses import dataclass
from math import dist

import cv2
import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats
from touchd.table.scene import Capsule, Point, Solid, Sphere

_TINY = 1e-6
_LONGEST = 2.5  # length over mean thickness of a piece that is cast as one


@dataclass(frozen=True, slots=True)
class Swept:
    """A ball swept along a line in camera space, its radius growing evenly by ``grow`` on the way ``along``.

    ``room`` is the squared length of the way minus the square of ``grow``.
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

    def larger_end(self) -> tuple[Doubles, float]:
        """Return centre and radius of the larger one of the balls at its ends."""
        if self.grow <= 0.0:
            return self.start, self.radius
        return self.start + self.along, self.radius + self.grow


def pieces(solid: Solid) -> list[tuple[Point, Point, float, float]]:
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


def depth_of(swept: Swept, x: Floats, y: Floats, length2: Floats) -> Floats:
    """Return the depth at which rays (x, y, 1) of squared length ``length2`` meet a solid, NaN where they miss."""
    with np.errstate(invalid="ignore"):  # the root of a negative number is how a ray says that it misses
        if swept.room <= _TINY:  # one end's ball holds the other's
            centre, radius = swept.larger_end()
            return _sphere(_dot(x, y, centre), length2, float(centre @ centre) - radius * radius)
        return _capsule(_dot(x, y, swept.start), _dot(x, y, swept.along), length2, swept)


def _between(a_mm: Point, b_mm: Point, share: float) -> Point:
    x_mm, y_mm, z_mm = (a * (1.0 - share) + b * share for a, b in zip(a_mm, b_mm, strict=True))
    return (x_mm, y_mm, z_mm)


def _dot(x: Floats, y: Floats, vector: Doubles) -> Floats:
    """Return the dot product of the rays (x, y, 1) with a vector."""
    out = np.empty(x.shape, np.float32)
    cv2.addWeighted(x, float(vector[0]), y, float(vector[1]), float(vector[2]), dst=out)
    return out


def _sphere(to_centre: Floats, length2: Floats, rest: Floats | float) -> Floats:
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


def _capsule(to_start: Floats, to_along: Floats, length2: Floats, swept: Swept) -> Floats:
    """Return where rays meet a ball of changing radius swept along a line, NaN where they miss.

    The balls' common envelope is a cone: |t·ray - start|² - radius² - s²·room = 0 where s = (t·to_along +
    lead)/room says which ball touches it there (from eliminating s between the ball's equation and its
    derivative by s). Where that s lies beyond an end, the end's own ball is what the ray may still meet.
    """
    start, along, room = swept.start, swept.along, swept.room
    lead = swept.radius * swept.grow - float(start @ along)
    rest = float(start @ start) - swept.radius**2 - lead * lead / room
    square = to_along * to_along
    square *= np.float32(-1.0 / room)
    square += length2
    half = to_along * np.float32(lead / room)
    half += to_start
    under_root = half * half
    square *= np.float32(rest)
    under_root -= square
    which = np.float32(rest) / _root_sum(half, under_root)
    which *= to_along
    which += np.float32(lead)
    which *= np.float32(1.0 / room)
    np.clip(which, 0.0, 1.0, out=which)
    to_along *= which
    to_along += to_start
    return _sphere(to_along, length2, _centre_rest(which, swept))


def _centre_rest(which: Floats, swept: Swept) -> Floats:
    """Return |centre|² - radius² of the balls at the shares ``which`` of the way."""
    start, along = swept.start, swept.along
    rest = which * np.float32(swept.room)
    rest += np.float32(2.0 * (float(start @ along) - swept.radius * swept.grow))
    rest *= which
    rest += np.float32(float(start @ start) - swept.radius**2)
    return rest
