"""People, drawn at random: child to large adult, from any side of the table, right- or left-handed."""

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.timeline import Stance, Way, place_at
from touchd.table.anatomy import Build
from touchd.table.body import Sleeve
from touchd.table.postures import Grip
from touchd.table.scene import Place

_FAR_MM = 620.0  # from the area's edge to where arms seem to come from
_SHOULDERS_MM = 190.0  # between a person's middle and either shoulder
_CHILD_SHARE = 0.2
_REACH_MM = 540.0  # from the area's edge to where an adult still touches at ease
_OUTSIDE_MM = 190.0  # how far beyond the picture's edge a fingertip is before its hand comes in
_STEP_MM = 40.0
_MOST_STEPS = 60


@dataclass(frozen=True, slots=True)
class Person:
    """Someone at the table. ``side_deg`` is where they are: 180 below the picture, 90 to its right."""

    number: int
    build: Build
    side_deg: float
    shoulder_mm: float
    sleeve: Sleeve | None


def someone(room: Room, number: int, side_deg: float | None = None) -> Person:
    """Return a person drawn at random; ``side_deg`` None: from any side."""
    rng = room.rng
    scale = room.between(0.62, 0.82) if rng.random() < _CHILD_SHARE else room.between(0.86, 1.12)
    # Thickness goes with size, 11 mm for a small child to 17 for a large adult, and with the person.
    tip_mm = float(np.clip(11.2 + 9.6 * (scale - 0.62) + rng.normal(0.0, 0.9), 11.0, 17.0))
    build = Build(
        scale=scale,
        tip_mm=tip_mm,
        breadth=room.between(1.05, 1.22),
        taper=room.between(1.05, 1.25),
        follow=room.between(-0.15, 0.3),
    )
    side = float(rng.choice([0.0, 90.0, 180.0, 270.0])) + room.between(-25.0, 25.0) if side_deg is None else side_deg
    sleeve = Sleeve(room.between(0.1, 0.8)) if rng.random() < 0.6 else None
    return Person(number, build, side, room.between(260.0, 400.0) * min(scale, 1.0), sleeve)


def in_reach(room: Room, person: Person, tries: list[Place]) -> Place:
    """Return the first of several places that the person reaches without climbing on the table, or the nearest."""
    deepest = _REACH_MM * min(person.build.scale, 1.0)
    depths = [_depth_mm(room, person, at) for at in tries]
    good = (at for at, depth in zip(tries, depths, strict=True) if depth <= deepest)
    return next(good, tries[depths.index(min(depths))])


def _depth_mm(room: Room, person: Person, at: Place) -> float:
    """Return how far a place lies from the area's edge at which the person is."""
    (width, height), (x_mm, y_mm) = room.area.size_mm, room.area.centre_mm
    out = place_at((0.0, 0.0), 1.0, person.side_deg)
    edge = 0.5 * (width * abs(out[0]) + height * abs(out[1]))
    return edge - (at[0] - x_mm) * out[0] - (at[1] - y_mm) * out[1]


def hand_of(
    room: Room, person: Person, hand: int, grip: Grip, way: Way, left: bool, wrist_deg: float | None = None
) -> Performer:
    """Return a person's hand on its way; the rest of what it takes is drawn at random."""
    return Performer(
        person=person.number,
        hand=hand,
        build=replace(person.build, left=left),
        grip=replace(grip, gap_mm=grip.gap_mm * room.lift * room.between(0.9, 1.8)),
        pivot_mm=pivot(room, person, left),
        shoulder_mm=person.shoulder_mm,
        wrist_deg=room.between(-22.0, 22.0) if wrist_deg is None else wrist_deg,
        sleeve=person.sleeve,
        legs=tuple(way.legs),
    )


def pivot(room: Room, person: Person, left: bool) -> Place:
    """Return the far place outside the table from which a person's arm comes."""
    width, height = room.area.size_mm
    middle = place_at(room.area.centre_mm, 0.5 * hypot(width, height) + _FAR_MM, person.side_deg)
    # Seen from behind the person, who looks at the table, the right hand is on the right.
    return place_at(middle, _SHOULDERS_MM * person.build.scale, person.side_deg + (90.0 if left else -90.0))


def enter(room: Room, person: Person, left: bool, stance: Stance, start_ms: float) -> Way:
    """Return a way that comes in from outside the picture to a stance."""
    way = Way(outside(room, person, left, stance), start_ms)
    way.reach(stance)
    return way


def leave(room: Room, person: Person, left: bool, way: Way) -> None:
    """End a way outside the picture."""
    way.reach(outside(room, person, left, way.here))


def outside(room: Room, person: Person, left: bool, stance: Stance, beyond_mm: float = _OUTSIDE_MM) -> Stance:
    """Return where a hand is before it comes in: so far beyond the picture's edge, back along its arm."""
    far = pivot(room, person, left)
    x_mm, y_mm = stance.at_mm
    distance = hypot(far[0] - x_mm, far[1] - y_mm)
    step = ((far[0] - x_mm) / distance * _STEP_MM, (far[1] - y_mm) / distance * _STEP_MM)
    for _ in range(_MOST_STEPS):
        pixel = room.camera.pixels(np.array([x_mm, y_mm, 0.0]))
        if not bool(np.all((pixel >= 0.0) & (pixel <= np.array([639.0, 479.0])))):
            break
        x_mm, y_mm = x_mm + step[0], y_mm + step[1]
    beyond = beyond_mm / _STEP_MM
    place = (x_mm + beyond * step[0], y_mm + beyond * step[1])
    return stance.lifted(60.0 * room.lift).moved(place)
