"""One finger at a time: targets, taps, slow descents, stillness, hovering."""

from dataclasses import replace
from functools import partial
from math import tau

from touchd.lab.scenes.cast import (
    TRAVEL_MM,
    Cast,
    above,
    fly_to,
    lift,
    one_by_one,
    press,
    somewhere,
    visit,
)
from touchd.lab.scenes.people import Person, someone
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.postures import OPEN, POINTING

_STILL_MS = 60_000.0


def targets(room: Room) -> Cast:
    """Touch targets, four each by five people, from all sides, with steep and flat fingers."""
    return one_by_one(room, 5, _touch_targets)


def taps(room: Room) -> Cast:
    """Tap 50 to 100 ms, three to five times a second, lifted 18 to 25 mm in between (36 to 50 at 1.5 m)."""
    return one_by_one(room, 3, _tap_quickly)


def descent(room: Room) -> Cast:
    """Come down and rise slowly, to see at what height a touch fires and releases."""
    return one_by_one(room, 3, _come_down_slowly)


def still(room: Room) -> Cast:
    """Hold a finger perfectly still for a minute."""
    return _holding(room, sway_deg=0.0)


def sway(room: Room) -> Cast:
    """Hold a finger on one spot for a minute while hand and arm sway a little."""
    return _holding(room, sway_deg=2.5)


def hover(room: Room) -> Cast:
    """Float over the surface at 8 to 60 mm (16 to 80 at 1.5 m) and never touch."""
    return one_by_one(room, 2, _float)


def hover_open(room: Room) -> Cast:
    """Float over the surface with an open hand and never touch."""
    person = someone(room, 0)
    stance = above(room, OPEN, somewhere(room, person, 0.3), room.between(26.0, 42.0))
    return Cast((visit(room, person, 0, stance, 200.0, partial(_float, room, person), OPEN),))


def touch_once(room: Room, way: Way, contact_ms: float) -> None:
    """Come down, stay, and rise."""
    press(way, room.between(100.0, 160.0))
    way.stay(contact_ms)
    lift(room, way, room.between(90.0, 150.0))


def tap_burst(room: Room, way: Way, count: int) -> None:
    """Tap quickly, here or in steps of up to 60 mm, inside the area."""
    rate, raised = room.between(3.0, 5.0), room.between(18.0, 25.0) * room.lift
    stride = room.between(0.0, 60.0)
    way.go(way.here.lifted(raised), 100.0)
    for _ in range(count):
        contact = room.between(50.0, 100.0)
        flight = max(1000.0 / rate - contact, 90.0)
        low = way.here.lifted(0.0)
        way.go(low, 0.5 * flight)
        way.stay(contact)
        following = _kept_inside(room, place_at(low.at_mm, stride, room.between(0.0, 360.0)), low.at_mm)
        middle = (0.5 * (low.at_mm[0] + following[0]), 0.5 * (low.at_mm[1] + following[1]))
        way.go(low.moved(middle).lifted(raised), 0.25 * flight)
        way.go(low.moved(following).lifted(raised), 0.25 * flight)


def _touch_targets(room: Room, person: Person, way: Way) -> None:
    for _ in range(4):
        pitch = room.between(15.0, 64.0)
        way.reach(
            replace(way.here.moved(somewhere(room, person, 0.07)), pitch_deg=pitch, turn_deg=room.between(-20.0, 20.0))
        )
        touch_once(room, way, room.between(250.0, 600.0))


def _tap_quickly(room: Room, person: Person, way: Way) -> None:
    for _ in range(2):
        fly_to(way, somewhere(room, person, 0.15))
        tap_burst(room, way, 8)


def _come_down_slowly(room: Room, person: Person, way: Way) -> None:
    height = TRAVEL_MM * room.lift
    for _ in range(2):
        fly_to(way, somewhere(room, person, 0.12))
        way.go(way.here.lifted(0.0), height / room.between(15.0, 40.0) * 1e3)
        way.stay(room.between(250.0, 500.0))
        way.go(way.here.lifted(height), height / room.between(15.0, 40.0) * 1e3)


def _holding(room: Room, sway_deg: float) -> Cast:
    person = someone(room, 0)
    stance = above(room, POINTING, somewhere(room, person, 0.2), room.between(25.0, 55.0))
    return Cast((visit(room, person, 0, stance, 200.0, partial(_hold, sway_deg)),))


def _hold(sway_deg: float, way: Way) -> None:
    press(way, 150.0)
    if sway_deg == 0.0:
        way.stay(_STILL_MS)
    else:
        rest = way.here
        steps = 24
        for step in range(steps):
            phase = tau * step / steps
            swing = sway_deg * (1.0 if step % 2 else -1.0)
            pitch = rest.pitch_deg + 0.6 * swing * (1.0 if phase < 3.0 else -1.0)
            way.go(replace(rest, pitch_deg=pitch, turn_deg=rest.turn_deg + swing), _STILL_MS / steps)
    way.go(way.here.lifted(TRAVEL_MM), 150.0)


def _float(room: Room, person: Person, way: Way) -> None:
    share = room.lift - 1.0  # 0 at 0.75 m, 1 at 1.5 m
    low, high = 8.0 + 8.0 * share, 60.0 + 20.0 * share
    for step in range(6):
        # Fewer high ones: near the surface it is harder.
        height = low + (high - low) * (step / 4.0) ** 2 if step % 2 == 0 else room.between(low, 2.0 * low)
        way.reach(way.here.moved(somewhere(room, person, 0.2)).lifted(max(height, 25.0 * room.lift)))
        way.go(way.here.lifted(height), 300.0)
        drift = _kept_inside(
            room, place_at(way.here.at_mm, room.between(0.0, 40.0), room.between(0.0, 360.0)), way.here.at_mm
        )
        way.go(way.here.moved(drift), room.between(700.0, 1100.0))


def _kept_inside(room: Room, wanted: tuple[float, float], otherwise: tuple[float, float]) -> tuple[float, float]:
    """Return a place, or another one where it lies outside the area."""
    (x, y), (cx, cy), (w, h) = wanted, room.area.centre_mm, room.area.size_mm
    return wanted if abs(x - cx) < 0.46 * w and abs(y - cy) < 0.46 * h else otherwise
