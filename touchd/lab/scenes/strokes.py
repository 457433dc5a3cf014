"""Fingers that slide: lines, circles, two that pass each other closely."""

from functools import partial
from math import atan2, degrees, hypot

from touchd.lab.scenes.cast import Cast, above, anywhere, far_from, fly_to, lift, one_by_one, press, somewhere, visit
from touchd.lab.scenes.people import Person, in_reach, someone
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.postures import POINTING
from touchd.table.scene import Place

_PASSING_MM = 45.0
_SAME_SIDE = 0.8  # of the distance between two sides of the table, seen from its middle at 1


def drag(room: Room) -> Cast:
    """Draw lines at 0.1 to 0.9 m/s."""
    return one_by_one(room, 2, _draw_lines)


def circles(room: Room) -> Cast:
    """Draw circles, either way round, at 0.2 to 0.9 m/s."""
    return one_by_one(room, 2, _draw_circles)


def passing(room: Room) -> Cast:
    """Slide two fingers past each other, 45 mm apart, there and back."""
    people = someone(room, 0), someone(room, 1)
    if room.rng.random() < 0.5:  # both hands of one person
        people = (people[0], people[0])
    # Each stays on their own side, so that no hand comes over the other's finger.
    bearing = _between_them_deg(*people) - 90.0 + room.between(-30.0, 30.0)
    middle = anywhere(room, 0.4)
    half = 0.22 * room.area.size_mm[1]
    performers = []
    for which, person in enumerate(people):
        side = 1.0 if which == 0 else -1.0
        line = place_at(middle, 0.5 * _PASSING_MM * side, bearing + 90.0)
        ends = place_at(line, half * side, bearing), place_at(line, -half * side, bearing)
        stance = above(room, POINTING, ends[0], room.between(30.0, 55.0))
        performers.append(
            visit(
                room,
                person,
                which,
                stance,
                200.0,
                partial(_there_and_back, room, ends),
                left=which == 1,
            )
        )
    return Cast(tuple(performers))


def _between_them_deg(one: Person, other: Person) -> float:
    """Return the direction from the second one's finger to the first one's: a right one, if they share a side."""
    x, y = (a - b for a, b in zip(*(place_at((0.0, 0.0), 1.0, who.side_deg) for who in (one, other)), strict=True))
    if hypot(x, y) < _SAME_SIDE:
        return one.side_deg - 90.0
    return degrees(atan2(x, -y))


def draw_line(room: Room, person: Person, way: Way, speed_mm_s: float) -> None:
    """Draw one line from here to somewhere else; the faster the longer."""
    press(way, room.between(90.0, 140.0))
    way.draw(way.here.moved(far_from(room, person, way.here.at_mm, 0.35 * speed_mm_s)), speed_mm_s)
    lift(room, way)


def _draw_lines(room: Room, person: Person, way: Way) -> None:
    for speed in (room.between(100.0, 200.0), room.between(250.0, 450.0), room.between(500.0, 700.0), 900.0):
        fly_to(way, somewhere(room, person))
        draw_line(room, person, way, speed)


def _draw_circles(room: Room, person: Person, way: Way) -> None:
    largest = 0.28 * room.area.size_mm[1]
    for speed in (room.between(200.0, 400.0), room.between(500.0, 700.0), 900.0):
        radius = room.between(0.35, 1.0) * largest
        width, height = room.area.size_mm
        rooms = 0.45 * width - radius, 0.45 * height - radius
        tries = [(room.between(-1.0, 1.0) * rooms[0], room.between(-1.0, 1.0) * rooms[1]) for _ in range(12)]
        centre = in_reach(room, person, tries)
        fly_to(way, place_at(centre, radius, room.between(0.0, 360.0)))
        press(way, 110.0)
        # As many rounds as a second and a half at this speed takes.
        turns = max(1.5 * speed / (6.283 * radius), 1.0)
        way.circle(centre, turns if room.rng.random() < 0.5 else -turns, speed)
        lift(room, way)


def _there_and_back(room: Room, ends: tuple[Place, Place], way: Way) -> None:
    press(way, 130.0)
    speed = 1.6 * hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1])  # both pass at the same time
    for _ in range(2):
        way.draw(way.here.moved(ends[1]), speed)
        way.stay(150.0)
        way.draw(way.here.moved(ends[0]), speed)
        way.stay(150.0)
    lift(room, way)
