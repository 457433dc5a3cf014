"""Touches on what is not flat: a book, a shallow bowl."""

from collections.abc import Callable
from functools import partial
from math import cos, radians, sin, sqrt

from touchd.lab.scenes.cast import Cast, above, anywhere, end_ms, fly_to, lift, press, visit
from touchd.lab.scenes.people import Person, in_reach, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.pointing import touch_once
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.postures import POINTING
from touchd.table.relief import Book
from touchd.table.scene import Place

_OFF_THE_EDGE_MM = 28.0


def targets_on_it(room: Room) -> Cast:
    """Touch targets on the thing, and some beside it."""
    return _people_who(room, _touch_on_and_beside)


def slides_on_it(room: Room) -> Cast:
    """Draw lines on the thing."""
    return _people_who(room, _slide_on_it)


def on_it(room: Room) -> Place:
    """Return a place on the thing that belongs to the surface, off its edge."""
    (thing,) = room.ground.things
    if isinstance(thing, Book):
        along, across = (room.between(-1.0, 1.0) * (0.5 * size - _OFF_THE_EDGE_MM) for size in thing.size_mm)
        turn = radians(thing.turn_deg)
        x_mm, y_mm = thing.centre_mm
        return (x_mm + along * cos(turn) - across * sin(turn), y_mm + along * sin(turn) + across * cos(turn))
    reach = (thing.radius_mm - _OFF_THE_EDGE_MM) * sqrt(room.between(0.0, 1.0))
    return place_at(thing.centre_mm, reach, room.between(0.0, 360.0))


def beside_it(room: Room) -> Place:
    """Return a place in the area on the bare table, off the thing."""
    (thing,) = room.ground.things
    tries = [anywhere(room, 0.07) for _ in range(40)]
    x_mm, y_mm = thing.centre_mm
    clear = [
        at for at in tries if all(room.ground.height_at(place_at(at, 30.0, turn)) == 0.0 for turn in range(0, 360, 45))
    ]
    return clear[0] if clear else max(tries, key=lambda at: abs(at[0] - x_mm) + abs(at[1] - y_mm))


def _people_who(room: Room, part: Callable[[Room, Person, Way], None]) -> Cast:
    performers: list[Performer] = []
    start_ms = 200.0
    for number in range(3):
        person = someone(room, number)
        begin = above(room, POINTING, on_it(room), room.between(28.0, 60.0))
        performers.append(visit(room, person, number, begin, start_ms, partial(part, room, person)))
        start_ms = end_ms(performers[-1]) + 200.0
    return Cast(tuple(performers))


def _touch_on_and_beside(room: Room, person: Person, way: Way) -> None:
    for step in range(5):
        tries = [beside_it(room) if step == 3 else on_it(room) for _ in range(4)]
        fly_to(way, in_reach(room, person, tries))
        touch_once(room, way, room.between(200.0, 500.0))


def _slide_on_it(room: Room, person: Person, way: Way) -> None:
    for _ in range(3):
        fly_to(way, in_reach(room, person, [on_it(room) for _ in range(8)]))
        press(way, 130.0)
        way.draw(way.here.moved(on_it(room)), room.between(80.0, 400.0))
        lift(room, way)
