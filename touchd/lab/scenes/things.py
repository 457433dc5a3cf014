"""Things that people put on the table, push and take away: what they look like, and where they are at a time."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, inf, pi, radians, sin

import numpy as np

from touchd.geometry import Doubles
from touchd.lab.scenes.performer import Performer
from touchd.table.relief import Book
from touchd.table.scene import Block, Capsule, Place, Point, Solid

_LID_MM, _LID_LEAN_DEG = 6.0, -20.0  # a laptop's lid: how thick, and how far back from upright
_CURL_MM = ((40.0, 1.3), (30.0, 2.6), (20.0, 3.8), (10.0, 5.0))  # of a curled corner: size and height of its steps
_CUP_SIDES = 12


@dataclass(frozen=True, slots=True)
class Laid:
    """Where a thing is: the middle of its base, how high that is over the table, and how it is turned."""

    at_mm: Place
    z_mm: float
    turn_deg: float
    held: bool

    def place(self, along_mm: float, across_mm: float) -> Place:
        """Return the place of the table under one of the thing's own: along its width, across towards its owner."""
        turn = radians(self.turn_deg)
        x_mm, y_mm = self.at_mm
        return (
            x_mm + along_mm * cos(turn) - across_mm * sin(turn),
            y_mm + along_mm * sin(turn) + across_mm * cos(turn),
        )

    def point(self, along_mm: float, across_mm: float, up_mm: float) -> Point:
        """Return the same with a height over the thing's base."""
        return (*self.place(along_mm, across_mm), self.z_mm + up_mm)


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of thing.

    ``size_mm`` are its width, its depth and how high its touchable upper side is. People hold it with a fingertip
    ``hold_up_mm`` over its base and ``hold_in_mm`` inside the edge that is nearest to them. ``look`` makes its solids.
    ``top_mm`` is the rectangle of its upper side that can be touched, in its own (along, across): two corners.
    """

    name: str
    size_mm: tuple[float, float, float]
    hold_up_mm: float
    hold_in_mm: float
    look: Callable[["Kind", Laid], tuple[Solid, ...]]
    top_mm: tuple[Place, Place]

    @property
    def held_over_mm(self) -> float:
        """How high over its base hands are that hold it: fingers over its upper side; 0 where they are beside it."""
        return self.hold_up_mm if self.hold_in_mm > 0.0 else 0.0

    def solids(self, laid: Laid) -> tuple[Solid, ...]:
        """Return what it looks like where it is laid."""
        return self.look(self, laid)

    def corners_mm(self, laid: Laid, up_mm: float) -> Doubles:
        """Return the corners (4, 3) of its rectangle, so high over its base, in table coordinates."""
        width, depth, _ = self.size_mm
        signs = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
        return np.array([laid.point(a * width, b * depth, up_mm) for a, b in signs])

    def as_ground(self, laid: Laid) -> Book:
        """Return its upper side as something that hands move over."""
        width, depth, height = self.size_mm
        return Book(laid.at_mm, (width, depth), height, laid.turn_deg)

    def edge_mm(self, laid: Laid, bearing_deg: float) -> float:
        """Return how far its edge is from its middle in a direction; bearing 0 is up the picture, 90 to the right."""
        off = radians(bearing_deg - laid.turn_deg)
        ways = ((0.5 * self.size_mm[0], abs(sin(off))), (0.5 * self.size_mm[1], abs(cos(off))))
        return min(half / share if share > 1e-9 else inf for half, share in ways)


@dataclass(frozen=True, slots=True)
class Phase:
    """A time in which a thing lies still, or goes along with the hand that holds it.

    ``at_mm`` is where it lies, or its way from the holder's fingertip to its middle.
    """

    start_ns: int
    end_ns: int
    at_mm: Place
    holder: Performer | None = None


@dataclass(frozen=True, slots=True)
class Thing:
    """A thing and its way through a scene; before its first phase and after its last it is not there."""

    kind: Kind
    turn_deg: float
    phases: tuple[Phase, ...]

    def laid(self, t_ns: int) -> Laid | None:
        """Return where it is at a time."""
        phase = next((phase for phase in self.phases if phase.start_ns <= t_ns < phase.end_ns), None)
        if phase is None:
            return None
        leg = None if phase.holder is None else phase.holder.leg(t_ns)
        if leg is None:
            return Laid(phase.at_mm, 0.0, self.turn_deg, held=False)
        stance = leg.at(t_ns)
        at_mm = (stance.at_mm[0] + phase.at_mm[0], stance.at_mm[1] + phase.at_mm[1])
        return Laid(at_mm, max(stance.lifts_mm[0] - self.kind.hold_up_mm, 0.0), self.turn_deg, held=True)


def phone(thick_mm: float) -> Kind:
    """Return a phone."""
    return Kind("phone", (146.0, 71.0, thick_mm), thick_mm, 22.0, _slab, ((-55.0, -20.0), (55.0, 20.0)))


def book(width_mm: float, depth_mm: float, thick_mm: float) -> Kind:
    """Return a closed book."""
    top = ((-0.5 * width_mm + 28.0, -0.5 * depth_mm + 28.0), (0.5 * width_mm - 28.0, 0.5 * depth_mm - 28.0))
    return Kind("book", (width_mm, depth_mm, thick_mm), thick_mm, 28.0, _slab, top)


def paper(thick_mm: float) -> Kind:
    """Return a sheet of paper, or a few, with a curled corner."""
    return Kind("paper", (297.0, 210.0, thick_mm), thick_mm, 25.0, _sheet, ((-90.0, -75.0), (120.0, 75.0)))


def cup(height_mm: float, width_mm: float) -> Kind:
    """Return a cup with a lid and a handle."""
    top = 0.22 * width_mm
    size = (width_mm, width_mm, height_mm)
    return Kind("cup", size, 0.65 * height_mm, -8.0, _cup, ((-top, -top), (top, top)))


def laptop() -> Kind:
    """Return a laptop with its lid raised at the side away from its owner."""
    return Kind("laptop", (320.0, 220.0, 20.0), 20.0, 30.0, _laptop, ((-125.0, -10.0), (125.0, 82.0)))


def _slab(kind: Kind, laid: Laid) -> tuple[Solid, ...]:
    return (Block(laid.point(0.0, 0.0, 0.0), kind.size_mm, laid.turn_deg),)


def _sheet(kind: Kind, laid: Laid) -> tuple[Solid, ...]:
    width, depth, thick = kind.size_mm
    curl = [
        Block(laid.point(0.5 * (size - width), 0.5 * (size - depth), 0.0), (size, size, thick + up), laid.turn_deg)
        for size, up in _CURL_MM
    ]
    return (*_slab(kind, laid), *curl)


def _cup(kind: Kind, laid: Laid) -> tuple[Solid, ...]:
    """Return a prism made of cuboids that each join two opposite sides of it, and a handle."""
    diameter, _, height = kind.size_mm
    size = (diameter * cos(pi / _CUP_SIDES), diameter * sin(pi / _CUP_SIDES), height)
    base = laid.point(0.0, 0.0, 0.0)
    turns = [laid.turn_deg + 360.0 / _CUP_SIDES * side for side in range(_CUP_SIDES // 2)]
    out = 0.5 * diameter + 14.0
    handle = Capsule(laid.point(out, 0.0, 0.3 * height), laid.point(out, 0.0, 0.75 * height), 6.0, 6.0)
    return (*(Block(base, size, turn) for turn in turns), handle)


def _laptop(kind: Kind, laid: Laid) -> tuple[Solid, ...]:
    width, depth, thick = kind.size_mm
    hinge = laid.point(0.0, 0.5 * (_LID_MM - depth), thick)
    lid = Block(hinge, (width, _LID_MM, depth - 10.0), laid.turn_deg, _LID_LEAN_DEG)
    return (*_slab(kind, laid), lid)
