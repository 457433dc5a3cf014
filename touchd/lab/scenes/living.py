"""A surface that does not stay what it was: drift, a knocked camera, a camera that sees nothing for a while."""

from collections.abc import Callable
from functools import partial
from math import atan, cos, degrees, dist, radians, sin
from typing import TypeAlias

import numpy as np

from touchd.geometry import raw_of_depth
from touchd.lab.scenes.cast import NS, Cast, above, end_ms, fly_to, lift, press, somewhere, visit
from touchd.lab.scenes.people import Person, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.play import Prop
from touchd.lab.scenes.pointing import tap_burst, touch_once
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.strokes import draw_line
from touchd.lab.scenes.timeline import Way
from touchd.lab.scenes.upsets import Drift, Knock, Span, Upsets
from touchd.table.postures import POINTING
from touchd.table.scene import Hand, Sphere

EMPTY_MS = 3000.0  # how long a table is empty before touches must be right again
_DRIFT_RAW, _DRIFT_MS = 3.0, 25_000.0
_LONG_RAW, _LONG_MS = 10.0, 600_000.0
_KNOCK_RAW, _KNOCK_MS = 3.0, 2600.0
_SIGHT_AGAIN_MS = 500.0  # after which touches can be asked for once a camera sees again
_COVER_MS, _COVERED_MS, _COVER_WAY_MS = 2000.0, 1200.0, 200.0
_COVER_RADIUS_MM, _COVER_OFF_MM, _COVER_ASIDE_MM = 120.0, 190.0, 420.0
_GLARE_MS = 1000.0

Work: TypeAlias = Callable[[Room, Person, Way], None]


def drift(room: Room) -> Cast:
    """Tap and draw while readings drift by 3 raw steps in 25 s, to the near or the far."""
    performers: list[Performer] = []
    start_ms = 200.0
    while start_ms < _DRIFT_MS:
        person = someone(room, len(performers))
        begin = above(room, POINTING, somewhere(room, person, 0.15), room.between(22.0, 58.0))
        performers.append(visit(room, person, len(performers), begin, start_ms, partial(_tap_and_draw, room, person)))
        start_ms = end_ms(performers[-1]) + room.between(100.0, 400.0)
    return Cast(tuple(performers), upsets=Upsets(drift=Drift(_either_way(room, _DRIFT_RAW), _DRIFT_MS)))


def drift_long(room: Room) -> Cast:
    """Tap every few seconds while readings drift by 10 raw steps in 10 minutes."""
    people = [someone(room, number) for number in range(4)]
    performers: list[Performer] = []
    start_ms = 1000.0
    while start_ms < _LONG_MS:
        person = people[len(performers) % len(people)]
        begin = above(room, POINTING, somewhere(room, person, 0.12), room.between(22.0, 58.0))
        part = partial(_tap_around, room, person)
        performers.append(visit(room, person, person.number, begin, start_ms, part, left=False))
        start_ms = end_ms(performers[-1]) + room.between(1500.0, 3500.0)
    return Cast(tuple(performers), upsets=Upsets(drift=Drift(_either_way(room, _LONG_RAW), _LONG_MS)))


def knock(room: Room) -> Cast:
    """Knock the camera while one hand holds and another taps; then the table is empty for 3 s, then people touch.

    The camera really turns, by as much as changes readings by 3 raw steps from one side of the picture to the other:
    hands, shadows and pattern go along, and the picture of the table moves, as when a real one is knocked. What is true
    stays where it was on the table.
    """
    person = someone(room, 0)
    at = somewhere(room, person, 0.2)
    performers = [
        visit(room, person, 0, above(room, POINTING, at, 40.0), 200.0, partial(_hold_and_draw, room, person, 5000.0)),
        _working(room, 1, 300.0, _tap_around),
        _working(room, 2, 1900.0, _tap_around),
    ]
    again_ms = max(end_ms(performer) for performer in performers) + EMPTY_MS
    performers.append(_working(room, 3, again_ms, _tap_and_draw))
    performers.append(_working(room, 4, end_ms(performers[-1]) + 200.0, _tap_and_draw))
    turn_deg = _either_way(room, _turn_deg(room, _KNOCK_RAW))
    bearing = radians(room.between(-30.0, 30.0))
    turned_deg = (turn_deg * cos(bearing), turn_deg * sin(bearing))
    return Cast(tuple(performers), upsets=Upsets(knock=Knock(Span.of_ms(_KNOCK_MS, again_ms), turned_deg)))


def blind(room: Room) -> Cast:
    """Cover the camera for a second while a finger draws, and dazzle it for a second while another one does."""
    first, second = someone(room, 0), someone(room, 1)
    begin = above(room, POINTING, somewhere(room, first, 0.2), 40.0)
    performers = [visit(room, first, 0, begin, 200.0, partial(_hold_and_draw, room, first, 4500.0))]
    glare_ms = end_ms(performers[-1]) + 2000.0
    begin = above(room, POINTING, somewhere(room, second, 0.2), 40.0)
    part = partial(_hold_and_draw, room, second, glare_ms + _GLARE_MS + 800.0)
    performers.append(visit(room, second, 1, begin, end_ms(performers[-1]) + 200.0, part))
    performers.append(_working(room, 2, end_ms(performers[-1]) + 100.0, _tap_and_draw))
    covered_ms, dazzled_ms = _COVER_MS + _COVERED_MS, glare_ms + _GLARE_MS
    upsets = Upsets(
        blind=(
            Span.of_ms(_COVER_MS, covered_ms + _COVER_WAY_MS + _SIGHT_AGAIN_MS),
            Span.of_ms(glare_ms, dazzled_ms + _SIGHT_AGAIN_MS),
        ),
        glare=Span.of_ms(glare_ms, dazzled_ms),
    )
    return Cast(tuple(performers), (_cover(room),), upsets=upsets)


def _either_way(room: Room, value: float) -> float:
    return value if room.rng.random() < 0.5 else -value


def _turn_deg(room: Room, steps: float) -> float:
    """Return by how much to turn a camera so that readings of the table change by raw steps from side to side."""
    raw = round(float(raw_of_depth(room.told, np.array(room.height_mm))))
    width_mm = 639.0 / room.camera.intrinsics.fx * room.height_mm
    return degrees(atan(steps * float(room.told.step_mm[raw]) / width_mm))


def _working(room: Room, number: int, start_ms: float, part: Work) -> Performer:
    person = someone(room, number)
    begin = above(room, POINTING, somewhere(room, person, 0.15), room.between(22.0, 58.0))
    return visit(room, person, number, begin, start_ms, partial(part, room, person))


def _tap_and_draw(room: Room, person: Person, way: Way) -> None:
    for _ in range(3):
        fly_to(way, somewhere(room, person, 0.1))
        touch_once(room, way, room.between(80.0, 300.0))
    fly_to(way, somewhere(room, person, 0.15))
    draw_line(room, person, way, room.between(150.0, 450.0))
    fly_to(way, somewhere(room, person, 0.2))
    tap_burst(room, way, 4)


def _tap_around(room: Room, person: Person, way: Way) -> None:
    for _ in range(3):
        touch_once(room, way, room.between(60.0, 200.0))
        fly_to(way, somewhere(room, person, 0.1))


def _hold_and_draw(room: Room, person: Person, until_ms: float, way: Way) -> None:
    """Draw short lines slowly, without lifting the finger, until a time."""
    press(way, 130.0)
    while way.now_ms < until_ms - 1000.0:
        tries = [somewhere(room, person, 0.2) for _ in range(8)]
        here = way.here
        way.draw(here.moved(min(tries, key=lambda at: dist(at, here.at_mm))), room.between(120.0, 250.0))
        way.stay(200.0)
    way.wait(until_ms)
    lift(room, way)


def _cover(room: Room) -> Prop:
    """Return something that slides before the lens, so near that nothing can be read of it, and away again."""
    eye = room.camera.eye_mm()
    before_lens = eye * (1.0 - _COVER_OFF_MM / float(np.linalg.norm(eye)))

    def slides(t_ns: int) -> Hand | None:
        t_ms = t_ns / NS
        until = (_COVER_MS - t_ms, t_ms - _COVER_MS - _COVERED_MS)
        away = min(max(*until, 0.0) / _COVER_WAY_MS, 1.0)
        if away == 1.0:
            return None
        x_mm, y_mm, z_mm = before_lens.tolist()
        return Hand((Sphere((x_mm + away * _COVER_ASIDE_MM, y_mm, z_mm), _COVER_RADIUS_MM),), ())

    return slides
