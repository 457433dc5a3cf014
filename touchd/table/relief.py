"""What the empty surface is like: a flat table, or one with a book or a shallow bowl on it, and where it ends.

Heights are over the table's plane, in table coordinates; arrays of any leading shape.
"""

from dataclasses import dataclass
from math import cos, hypot, radians, sin
from typing import TypeAlias

import numpy as np

from touchd.geometry import Doubles
from touchd.model import Mask
from touchd.table.scene import Place, Point

_RIM_MM = 4.0  # over which a bowl's rim falls to the table


@dataclass(frozen=True, slots=True)
class Book:
    """A closed book lying on the table."""

    centre_mm: Place
    size_mm: Place
    thick_mm: float
    turn_deg: float = 0.0

    @property
    def top_mm(self) -> float:
        """Its highest point."""
        return self.thick_mm

    @property
    def reach_mm(self) -> float:
        """How far from its centre any of it lies."""
        return 0.5 * hypot(*self.size_mm)

    def height_mm(self, x_mm: Doubles, y_mm: Doubles) -> Doubles:
        """Return how high it is at places; 0 beside it."""
        turn = radians(self.turn_deg)
        dx, dy = x_mm - self.centre_mm[0], y_mm - self.centre_mm[1]
        along, across = dx * cos(turn) + dy * sin(turn), dy * cos(turn) - dx * sin(turn)
        inside = (np.abs(along) <= 0.5 * self.size_mm[0]) & (np.abs(across) <= 0.5 * self.size_mm[1])
        return np.where(inside, self.thick_mm, 0.0)


@dataclass(frozen=True, slots=True)
class Bowl:
    """A shallow bowl: its inside is a paraboloid that touches the table in the middle and is highest at the rim."""

    centre_mm: Place
    radius_mm: float
    rim_mm: float

    @property
    def top_mm(self) -> float:
        """Its highest point."""
        return self.rim_mm

    @property
    def reach_mm(self) -> float:
        """How far from its centre any of it lies."""
        return self.radius_mm + _RIM_MM

    def height_mm(self, x_mm: Doubles, y_mm: Doubles) -> Doubles:
        """Return how high it is at places; 0 beside it."""
        r = np.hypot(x_mm - self.centre_mm[0], y_mm - self.centre_mm[1])
        inside = self.rim_mm * (r / self.radius_mm) ** 2
        outside = self.rim_mm * np.clip(1.0 - (r - self.radius_mm) / _RIM_MM, 0.0, 1.0)
        return np.where(r <= self.radius_mm, inside, outside)


Thing: TypeAlias = Book | Bowl


@dataclass(frozen=True, slots=True)
class Ground:
    """A table with things that belong to it.

    ``edges_mm`` is where it ends (left, top, right, bottom); beyond lies the floor at ``floor_mm``. None: it fills the
    picture.
    """

    things: tuple[Thing, ...] = ()
    edges_mm: tuple[float, float, float, float] | None = None
    floor_mm: float = -720.0

    @property
    def top_mm(self) -> float:
        """The highest point of anything on the table."""
        return max((thing.top_mm for thing in self.things), default=0.0)

    def height_mm(self, x_mm: Doubles, y_mm: Doubles) -> Doubles:
        """Return how high the surface is at places of the table."""
        height = np.zeros(np.shape(x_mm))
        for thing in self.things:
            height = np.maximum(height, thing.height_mm(x_mm, y_mm))
        return height

    def height_at(self, place: Place) -> float:
        """Return how high the surface is at one place."""
        return float(self.height_mm(np.array(place[0]), np.array(place[1]))) if self.things else 0.0

    def normal_at(self, place: Place) -> Point:
        """Return the unit vector that stands on the surface at one place, not on an edge."""
        for thing in self.things:
            if isinstance(thing, Bowl):
                dx, dy = place[0] - thing.centre_mm[0], place[1] - thing.centre_mm[1]
                if hypot(dx, dy) <= thing.radius_mm:
                    slope = 2.0 * thing.rim_mm / thing.radius_mm**2
                    normal = np.array([-slope * dx, -slope * dy, 1.0])
                    x, y, z = (normal / np.linalg.norm(normal)).tolist()
                    return (x, y, z)
        return (0.0, 0.0, 1.0)

    def beside(self, x_mm: Doubles, y_mm: Doubles) -> Mask:
        """Return which places lie beyond the table's edges."""
        if self.edges_mm is None:
            return np.zeros(np.shape(x_mm), np.bool_)
        left, top, right, bottom = self.edges_mm
        return (x_mm < left) | (x_mm > right) | (y_mm < top) | (y_mm > bottom)


FLAT_TABLE = Ground()
