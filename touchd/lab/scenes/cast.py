"""What a family of scenes makes for a room: who and what appears, and the gestures that most of them share."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import dist
from typing import TypeAlias

from touchd.lab.scenes.people import Person, enter, hand_of, in_reach, leave, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.play import Prop, Stacks
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.things import Thing
from touchd.lab.scenes.timeline import Stance, Way
from touchd.lab.scenes.upsets import NO_UPSETS, Upsets
from touchd.table.postures import POINTING, Grip
from touchd.table.scene import Place

NS = 1_000_000
_TRIES = 12
TRAVEL_MM = 25.0  # how high hands move about at 0.75 m


@dataclass(frozen=True, slots=True)
class Cast:
    """Who and what appears in a scene. ``props_end_ms``: when the last thing is gone."""

    performers: tuple[Performer, ...]
    props: tuple[Prop, ...] = ()
    props_end_ms: float = 0.0
    stacks: Stacks | None = None
    things: tuple[Thing, ...] = ()
    upsets: Upsets = NO_UPSETS


Family: TypeAlias = Callable[[Room], Cast]
Part: TypeAlias = Callable[[Way], None]


def anywhere(room: Room, margin: float = 0.1) -> Place:
    """Return a place in the area, off its border by a share of its size."""
    return room.area.at(room.between(margin, 1.0 - margin), room.between(margin, 1.0 - margin))


def somewhere(room: Room, person: Person, margin: float = 0.1) -> Place:
    """Return a place in the area that the person reaches, off the area's border by a share of its size."""
    return in_reach(room, person, [anywhere(room, margin) for _ in range(_TRIES)])


def far_from(room: Room, person: Person, place: Place, least_mm: float) -> Place:
    """Return a place that the person reaches at least so far from another one, or the farthest of many."""
    tries = [somewhere(room, person) for _ in range(_TRIES)]
    return next((at for at in tries if dist(at, place) >= least_mm), max(tries, key=lambda at: dist(at, place)))


def above(room: Room, grip: Grip, at_mm: Place, pitch_deg: float, spread: float = 1.0) -> Stance:
    """Return the stance of a hand over a place, as high as hands travel."""
    return Stance(at_mm, (0.0,) * len(grip.tips), pitch_deg, spread=spread, anchor_mm=at_mm).lifted(
        TRAVEL_MM * room.lift
    )


def press(way: Way, span_ms: float) -> None:
    """Bring the fingertips straight down to the surface."""
    way.go(way.here.lifted(0.0), span_ms)


def lift(room: Room, way: Way, span_ms: float = 120.0, height_mm: float = TRAVEL_MM) -> None:
    """Take the fingertips straight up."""
    way.go(way.here.lifted(height_mm * room.lift), span_ms)


def fly_to(way: Way, at_mm: Place) -> None:
    """Move to another place at the present height."""
    way.reach(way.here.moved(at_mm))


def visit(
    room: Room,
    person: Person,
    hand: int,
    begin: Stance,
    start_ms: float,
    part: Part,
    grip: Grip = POINTING,
    left: bool | None = None,
    wrist_deg: float | None = None,
) -> Performer:
    """Return a hand that comes in to a stance, does its part, and leaves."""
    side = bool(room.rng.random() < 0.4) if left is None else left
    way = enter(room, person, side, begin, start_ms)
    part(way)
    leave(room, person, side, way)
    return hand_of(room, person, hand, grip, way, side, wrist_deg)


def end_ms(performer: Performer) -> float:
    """Return when a performer has left."""
    return performer.end_ns / NS


def one_by_one(room: Room, count: int, part: Callable[[Room, Person, Way], None]) -> Cast:
    """Return people who come one after the other, each with a pointing finger, and do the same part."""
    performers: list[Performer] = []
    start_ms = 200.0
    for number in range(count):
        person = someone(room, number)
        begin = above(room, POINTING, somewhere(room, person, 0.15), room.between(20.0, 62.0))
        performers.append(visit(room, person, number, begin, start_ms, partial(part, room, person)))
        start_ms = end_ms(performers[-1]) + room.between(100.0, 400.0)
    return Cast(tuple(performers))


def spread_of(stance: Stance, spread: float) -> Stance:
    """Return the stance with another spread."""
    return replace(stance, spread=spread)
