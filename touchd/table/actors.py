"""What hands do: gestures, and the actor that makes them one after the other."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Hand, Place


@dataclass(frozen=True, slots=True)
class Touch:
    """A tap or a hold: down at a place, still for so long, and up again."""

    at_mm: Place
    contact_ms: float


@dataclass(frozen=True, slots=True)
class Drag:
    """Down at a place, along the table to another one in so long, and up again; the hand turns on the way."""

    from_mm: Place
    to_mm: Place
    contact_ms: float
    turn_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Circle:
    """Down at the top of a circle, round it clockwise so many times in so long, and up again."""

    centre_mm: Place
    radius_mm: float
    turns: float
    contact_ms: float


@dataclass(frozen=True, slots=True)
class Pinch:
    """Thumb and index finger down, from one distance between them to another in so long, and up again."""

    at_mm: Place
    from_spread_mm: float
    to_spread_mm: float
    contact_ms: float
    turn_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Hover:
    """Over a place at a clearance for so long."""

    at_mm: Place
    clearance_mm: float
    stay_ms: float


Gesture: TypeAlias = Touch | Drag | Circle | Pinch | Hover


@dataclass(frozen=True, slots=True)
class Actor:
    """A hand that comes in from where its arm is, makes its gestures one after the other, and leaves.

    ``grip`` is how it is held; its place and clearance are overwritten. ``travel_mm`` is the clearance it
    moves at.
    """

    grip: HandPose
    gestures: tuple[Gesture, ...]
    start_ms: float = 0.0
    travel_mm: float = 25.0
    shape: Callable[[HandPose], Hand] = pointing_hand
