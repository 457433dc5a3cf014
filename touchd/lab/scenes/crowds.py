"""Awkward views and many hands: along the camera's ray, behind one's own hand, two people."""

from functools import partial
from math import atan2, degrees, hypot

from touchd.lab.scenes.cast import Cast, above, end_ms, fly_to, lift, press, somewhere, visit
from touchd.lab.scenes.many_fingers import both_hands_open
from touchd.lab.scenes.people import Person, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.pointing import tap_burst, touch_once
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.strokes import draw_line
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.postures import POINTING
from touchd.table.scene import Place

_BESIDE_MM, _OPPOSITE_MM = 110.0, 120.0  # between the fingertips of hands that meet
_MEET_MS = 7500.0
_ARCH_DEG = 12.0  # by which a pointing finger's last bone is steeper than the finger


def along_the_ray(room: Room) -> Cast:
    """Touch with fingers that point along the camera's own ray, so that little but their end is seen."""
    return _seen_from_behind(room, leaning_deg=0.0)


def own_hand(room: Room) -> Cast:
    """Touch with fingers that lean towards the camera, so that the hand hides them wholly or in part."""
    return _seen_from_behind(room, leaning_deg=10.0)


def two_people(room: Room) -> Cast:
    """Tap and draw with both hands of two people at opposite sides."""
    side = 180.0 + room.between(-20.0, 20.0)
    performers = []
    for number in (0, 1):
        person = someone(room, number, side + 180.0 * number)
        for left in (False, True):
            hand = 2 * number + int(left)
            at = room.area.at(0.28 + 0.44 * (hand in (0, 3)), 0.3 + 0.4 * (hand in (0, 1)))
            begin = above(room, POINTING, at, room.between(25.0, 55.0))
            start = 200.0 + room.between(0.0, 500.0)
            performers.append(visit(room, person, hand, begin, start, partial(_work_around, room, at), left=left))
    return Cast(tuple(performers))


def four_hands(room: Room) -> Cast:
    """Tap and draw with both hands of two people, each hand from its own side; at times two are near each other."""
    side = 180.0 + room.between(-20.0, 20.0)
    performers = []
    for number in (0, 1):
        person = someone(room, number, side + 180.0 * number)
        for left in (False, True):
            hand = 2 * number + int(left)
            right_half, near_half = hand in (0, 3), hand in (0, 1)
            home = room.area.at(0.26 + 0.48 * right_half, 0.3 + 0.4 * near_half)
            towards = (1.0 if right_half else -1.0, 1.0 if near_half else -1.0)
            begin = above(room, POINTING, home, room.between(25.0, 55.0))
            part = partial(_work_and_meet, room, home, towards)
            performers.append(visit(room, person, hand, begin, 200.0 + room.between(0.0, 500.0), part, left=left))
    return Cast(tuple(performers))


def crowd(room: Room) -> Cast:
    """Slide all twenty fingers of two people."""
    side = room.between(-20.0, 20.0) + (90.0 if room.rng.random() < 0.5 else 0.0)
    people = someone(room, 0, side), someone(room, 1, side + 180.0)
    out = 0.2 * room.area.size_mm[0 if abs(side) > 45.0 else 1]
    performers: list[Performer] = []
    for person in people:
        middle = place_at(room.area.centre_mm, out, person.side_deg)
        start = 200.0 + person.number * room.between(300.0, 900.0)
        performers += both_hands_open(room, person, 2 * person.number, middle, start)
    return Cast(tuple(performers))


def _work_around(room: Room, home: Place, way: Way) -> None:
    """Touch and draw within a part of the area that no other hand uses."""
    reach = 0.12 * min(room.area.size_mm)

    def near() -> Place:
        return (home[0] + room.between(-reach, reach), home[1] + room.between(-reach, reach))

    for _ in range(2):
        fly_to(way, near())
        touch_once(room, way, room.between(150.0, 500.0))
    fly_to(way, near())
    way.go(way.here.lifted(0.0), 120.0)
    way.draw(way.here.moved(near()), room.between(100.0, 300.0))
    way.go(way.here.lifted(25.0 * room.lift), 120.0)
    fly_to(way, home)
    tap_burst(room, way, 4)


def _work_and_meet(room: Room, home: Place, towards: Place, way: Way) -> None:
    """Work at home, beside the same person's other hand, at home, and opposite the other person's hand.

    ``towards`` is the direction (right, down) of this hand's quarter from the middle of the table.
    """
    x_mm, y_mm = room.area.centre_mm
    beside = (x_mm + 0.5 * _BESIDE_MM * towards[0], home[1])
    opposite = (home[0], y_mm + 0.5 * _OPPOSITE_MM * towards[1])
    for meeting, place in enumerate((beside, opposite)):
        _work_around(room, home, way)
        way.wait(_MEET_MS * (meeting + 1))
        fly_to(way, place)
        for _ in range(3):
            touch_once(room, way, room.between(120.0, 350.0))
        press(way, 120.0)
        way.draw(way.here.moved(place_at(place, 30.0, room.between(0.0, 360.0))), room.between(60.0, 120.0))
        way.draw(way.here.moved(place), room.between(60.0, 120.0))
        lift(room, way)
        fly_to(way, home)


def _seen_from_behind(room: Room, leaning_deg: float) -> Cast:
    """Return touches by arms that come from the camera's side, at the angle of the camera's ray or leaning over it.

    ``leaning_deg``: by how much the finger's last bone is steeper than the ray.
    """
    x_mm, y_mm, eye_mm = room.camera.eye_mm().tolist()
    performers: list[Performer] = []
    start_ms = 200.0
    for hand in range(4):
        person = someone(room, hand)
        at = _beyond_the_foot(room, person, (x_mm, y_mm))
        rise = degrees(atan2(eye_mm, hypot(at[0] - x_mm, at[1] - y_mm)))
        pitch = rise - _ARCH_DEG + leaning_deg + room.between(-4.0, 4.0)
        begin = above(room, POINTING, at, min(pitch, 88.0))

        def part(way: Way, person: Person = person) -> None:
            for _ in range(2):
                touch_once(room, way, room.between(200.0, 500.0))
            draw_line(room, person, way, room.between(100.0, 200.0))

        performers.append(visit(room, person, hand, begin, start_ms, part, wrist_deg=0.0))
        start_ms = end_ms(performers[-1]) + 100.0
    return Cast(tuple(performers))


def _beyond_the_foot(room: Room, person: Person, foot: Place) -> Place:
    """Return the place in a person's reach that lies farthest beyond the camera's foot, as the person sees it."""
    out = place_at((0.0, 0.0), 1.0, person.side_deg)
    tries = [somewhere(room, person, 0.08) for _ in range(6)]
    return min(tries, key=lambda at: (at[0] - foot[0]) * out[0] + (at[1] - foot[1]) * out[1])
