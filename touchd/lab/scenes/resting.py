"""Hands that stay: a forearm on the table, a finger held for minutes, fingers held in the air."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import dist

import numpy as np

from touchd.lab.scenes.cast import TRAVEL_MM, Cast, above, anywhere, end_ms, fly_to, lift, press, somewhere, visit
from touchd.lab.scenes.people import Person, pivot, someone
from touchd.lab.scenes.pointing import touch_once
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.timeline import Stance, Way, place_at
from touchd.table.postures import POINTING, WRITING
from touchd.table.scene import Place

_REST_MS = 61_000.0
_WRITING_LIFT_MM = 12.0
_CLEAR_OF_ARM_MM = 150.0
_LOOKED_AT = 25  # places along a way
_HELD_MS, _SWAY_MM = 600_000.0, 0.45
_LOWEST_MM, _HIGHEST_MM = 8.0, 36.0  # of hovers at 0.75 m; touchd follows them up to 40 mm

Line = tuple[Place, Place]  # from one place to another


def forearm(room: Room) -> Cast:
    """Rest heel and forearm on the table for a minute; its index finger works, and so does the other hand."""
    person = someone(room, 0)
    left = bool(room.rng.random() < 0.4)
    home = place_at(room.area.centre_mm, 0.1 * room.area.size_mm[1], person.side_deg + 180.0)
    stance = above(room, WRITING, home, room.between(32.0, 45.0))
    resting = visit(room, person, 0, stance, 200.0, partial(_write_on, room, home), WRITING, left)
    arm = home, pivot(room, person, left)
    begin = above(room, POINTING, _off_the_arm(room, arm), room.between(25.0, 55.0))
    part = partial(_work_beside, room, arm)
    other = visit(room, person, 1, begin, 2500.0, part, left=not left)
    return Cast((replace(resting, forearm_rests=True), other))


def held(room: Room) -> Cast:
    """Hold a finger on one spot for 10 minutes, with the sway of a hand that means to be still."""
    person = someone(room, 0)
    stance = above(room, POINTING, somewhere(room, person, 0.25), room.between(28.0, 50.0))
    return Cast((visit(room, person, 0, stance, 1000.0, partial(_hold_on, room)),))


def hover_height(room: Room) -> Cast:
    """Hold and move a finger at known heights, 8 to 36 mm (16 to 36 at 1.5 m), and touch from there."""
    lowest = min(_LOWEST_MM * room.lift, 0.5 * _HIGHEST_MM)
    heights = room.rng.permutation(np.linspace(lowest, _HIGHEST_MM, 8)).tolist()
    performers = []
    start_ms = 200.0
    for number in (0, 1):
        person = someone(room, number)
        begin = above(room, POINTING, somewhere(room, person, 0.2), room.between(22.0, 55.0))
        part = partial(_hover_and_touch, room, person, heights[4 * number : 4 * number + 4])
        performers.append(visit(room, person, number, begin, start_ms, part))
        start_ms = end_ms(performers[-1]) + 200.0
    return Cast(tuple(performers))


def _write_on(room: Room, home: Place, way: Way) -> None:
    """Let the heel down and tap and write around it until the minute is over."""
    raised = _WRITING_LIFT_MM * room.lift
    way.go(replace(way.here, lifts_mm=(raised,), heel_mm=0.0), 300.0)
    until_ms = way.now_ms + _REST_MS
    while way.now_ms < until_ms:
        spot = place_at(home, room.between(0.0, 14.0), room.between(0.0, 360.0))
        way.go(replace(way.here, at_mm=spot), room.between(120.0, 250.0))
        way.go(replace(way.here, lifts_mm=(0.0,)), room.between(90.0, 130.0))
        way.stay(room.between(80.0, 250.0))
        for _ in range(int(room.rng.integers(0, 4))):
            spot = place_at(home, room.between(3.0, 16.0), room.between(0.0, 360.0))
            way.go(replace(way.here, at_mm=spot), room.between(150.0, 300.0))
        way.go(replace(way.here, lifts_mm=(raised,)), room.between(90.0, 130.0))
        way.stay(room.between(100.0, 900.0))
    lift(room, way, 250.0)


def _work_beside(room: Room, arm: Line, way: Way) -> None:
    while way.now_ms < _REST_MS - 5000.0:
        for _ in range(3):
            fly_to(way, _off_the_arm(room, arm))
            touch_once(room, way, room.between(80.0, 400.0))
        fly_to(way, _off_the_arm(room, arm))
        press(way, 120.0)
        way.draw(way.here.moved(_beside_the_arm(room, arm, way.here.at_mm)), room.between(150.0, 400.0))
        lift(room, way)
        way.stay(room.between(300.0, 1500.0))


def _off_the_arm(room: Room, arm: Line) -> Place:
    """Return a place off the line along which an arm lies."""
    return _clear(room, lambda at: _off_line(at, arm))


def _beside_the_arm(room: Room, arm: Line, begin: Place) -> Place:
    """Return a place to which a straight way leads past the arm, as no finger draws through it."""
    return _clear(room, lambda at: min(_off_line(point, arm) for point in _straight(begin, at)))


def _clear(room: Room, off_mm: Callable[[Place], float]) -> Place:
    """Return a place that is clear of an arm, or the farthest of many."""
    tries = [anywhere(room) for _ in range(20)]
    return next((at for at in tries if off_mm(at) > _CLEAR_OF_ARM_MM), max(tries, key=off_mm))


def _straight(begin: Place, end: Place) -> list[Place]:
    shares = np.linspace(0.0, 1.0, _LOOKED_AT).tolist()
    return [(begin[0] + t * (end[0] - begin[0]), begin[1] + t * (end[1] - begin[1])) for t in shares]


def _off_line(at: Place, arm: Line) -> float:
    """Return how far a place is from the line between two others."""
    (ax, ay), (bx, by) = arm
    length = dist(*arm)
    along = min(max(((at[0] - ax) * (bx - ax) + (at[1] - ay) * (by - ay)) / length**2, 0.0), 1.0)
    return dist(at, (ax + along * (bx - ax), ay + along * (by - ay)))


def _hold_on(room: Room, way: Way) -> None:
    press(way, 150.0)
    rest = way.here
    until_ms = way.now_ms + _HELD_MS
    while way.now_ms < until_ms:
        at = place_at(rest.at_mm, _SWAY_MM * float(np.sqrt(room.rng.random())), room.between(0.0, 360.0))
        pitch, turn = rest.pitch_deg + room.between(-1.2, 1.2), rest.turn_deg + room.between(-1.0, 1.0)
        way.go(replace(rest.moved(at), pitch_deg=pitch, turn_deg=turn), room.between(500.0, 1500.0))
    way.go(way.here.lifted(TRAVEL_MM * room.lift), 150.0)


def _hover_and_touch(room: Room, person: Person, heights_mm: list[float], way: Way) -> None:
    for number, height in enumerate(heights_mm):
        fly_to(way, somewhere(room, person, 0.25))
        way.go(way.here.lifted(height), 250.0)
        way.stay(500.0)
        way.draw(_aside(room, way.here, 50.0, 100.0), room.between(60.0, 200.0))
        way.stay(300.0)
        if number % 2:
            touch_once(room, way, 250.0)
            continue
        land = _aside(room, way.here, 90.0, 130.0)
        on = (2.0 * land.at_mm[0] - way.here.at_mm[0], 2.0 * land.at_mm[1] - way.here.at_mm[1])
        land = land.lifted(0.0)
        way.swipe(land, land.moved(_pulled_in(room, on, land.at_mm)), room.between(150.0, 300.0))
        lift(room, way)


def _aside(room: Room, stance: Stance, least_mm: float, most_mm: float) -> Stance:
    """Return a stance some way off, well inside the area."""
    (cx, cy), (width, height) = room.area.centre_mm, room.area.size_mm
    tries = [place_at(stance.at_mm, room.between(least_mm, most_mm), room.between(0.0, 360.0)) for _ in range(12)]
    return stance.moved(min(tries, key=lambda at: max(abs(at[0] - cx) / width, abs(at[1] - cy) / height, 0.3)))


def _pulled_in(room: Room, at: Place, towards: Place) -> Place:
    """Return a place, or so much of the way to it from another one as lies inside the area."""
    (cx, cy), (width, height) = room.area.centre_mm, room.area.size_mm
    share = 1.0
    while share > 0.1:
        x, y = (t + share * (a - t) for a, t in zip(at, towards, strict=True))
        if abs(x - cx) < 0.46 * width and abs(y - cy) < 0.46 * height:
            return (x, y)
        share -= 0.1
    return towards
