"""What must not touch or must not disturb: sweeping hands, dark cloth and hair, a head, legs, things on the table."""

from dataclasses import replace
from functools import partial
from math import pi, radians, sin

import numpy as np

from touchd.lab.scenes.cast import NS, Cast, above, end_ms, fly_to, lift, press, somewhere, visit
from touchd.lab.scenes.people import Person, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.play import Prop
from touchd.lab.scenes.pointing import tap_burst, touch_once
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.strokes import draw_line
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.body import Sleeve, head, leg
from touchd.table.postures import IN_THE_AIR, POINTING
from touchd.table.scene import Block, Capsule, Hand, Place

_WALK_NS = 5_000_000_000  # to and fro
_HEAD_OFF_MM = 320.0  # from the camera to the top of a head that is too near for it
_HEAD_IN_MS, _HEAD_WAY_MS = 2200.0, 700.0
_STACK_STEP_MM, _STACK_STEP_MS, _TALLEST_MM = 1.0, 300.0, 44.0


def sweep(room: Room) -> Cast:
    """Sweep hands in, across and out, without touching."""
    performers = []
    start_ms = 200.0
    for hand in range(5):
        person = someone(room, hand)
        stance = above(room, IN_THE_AIR, somewhere(room, person, 0.15), room.between(12.0, 40.0))
        stance = stance.lifted(room.between(18.0, 80.0) * room.lift)
        performers.append(visit(room, person, hand, stance, start_ms, partial(_wave, room, person), IN_THE_AIR))
        start_ms = end_ms(performers[-1]) - 300.0
    return Cast(tuple(performers))


def dark_sleeve(room: Room) -> Cast:
    """Tap and draw with an arm in a black sleeve of which nothing can be read."""
    performers = []
    start_ms = 200.0
    for hand in range(2):
        person = replace(someone(room, hand), sleeve=Sleeve(room.between(0.0, 0.3), dark=True))
        performers.append(_worker(room, person, hand, start_ms))
        start_ms = end_ms(performers[-1]) + 150.0
    return Cast(tuple(performers))


def heads(room: Room) -> Cast:
    """Lean a head in between camera and table and out again, while another one touches."""
    return _leaning(room, dark_hair=False)


def dark_hair(room: Room) -> Cast:
    """Lean a head with black hair, of which nothing can be read, in and out while another one touches."""
    return _leaning(room, dark_hair=True)


def near_head(room: Room) -> Cast:
    """Hold a head nearer to the camera than it can see over a part of the table; others touch beside and under it."""
    ahead_deg = float(room.rng.choice([0.0, 90.0, 180.0, 270.0])) + room.between(-12.0, 12.0)
    free_side, under_side = someone(room, 0, ahead_deg), someone(room, 1, ahead_deg + 90.0)
    extent = room.area.size_mm[0 if abs(sin(radians(ahead_deg))) > 0.7 else 1]

    def place(ahead: float, aside: float) -> Place:
        return place_at(
            place_at(room.area.centre_mm, ahead * extent, ahead_deg), aside * room.area.size_mm[1], ahead_deg + 90.0
        )

    def holds(way: Way) -> None:
        press(way, 120.0)
        for _ in range(4):
            way.draw(way.here.moved(place(room.between(0.2, 0.4), -0.18)), room.between(50.0, 110.0))
            way.stay(300.0)
        lift(room, way)

    def taps(way: Way) -> None:
        for _ in range(7):
            fly_to(way, place(room.between(0.2, 0.4), room.between(0.08, 0.25)))
            touch_once(room, way, room.between(100.0, 300.0))

    def ends_under_it(way: Way) -> None:
        press(way, 120.0)
        way.wait(_HEAD_IN_MS + _HEAD_WAY_MS + 300.0)
        lift(room, way)

    performers = (
        visit(room, free_side, 0, above(room, POINTING, place(0.3, -0.18), 40.0), 200.0, holds, left=True),
        visit(room, free_side, 1, above(room, POINTING, place(0.3, 0.15), 45.0), 500.0, taps, left=False),
        visit(room, under_side, 2, above(room, POINTING, place(-0.3, 0.1), 40.0), 300.0, ends_under_it),
    )
    out_ms = max(end_ms(performer) for performer in performers[:2]) - 1500.0
    return Cast(performers, (_over_a_part(room, ahead_deg, extent, out_ms),), out_ms + _HEAD_WAY_MS + 500.0)


def legs(room: Room) -> Cast:
    """Walk beside a table that ends within the picture, while someone touches."""
    worker = _worker(room, someone(room, 0), 0, 900.0)
    span_ms = end_ms(worker)
    props = [_walker(room, number, span_ms) for number in range(4)]
    return Cast((worker,), tuple(props), span_ms)


def objects(room: Room) -> Cast:
    """Put a phone, a cup and a booklet on the table for good; then their owners touch beside them."""
    spots = [room.area.at(0.2, 0.25), room.area.at(0.8, 0.3), room.area.at(0.35, 0.8)]
    order = room.rng.permutation(3).tolist()
    phone, cup, booklet = (spots[i] for i in order)
    turn = room.between(0.0, 180.0)
    things: tuple[Block | Capsule, ...] = (
        Block((*phone, 0.0), (146.0, 71.0, room.between(7.5, 10.0)), turn),
        Capsule((*cup, 38.0), (*cup, 62.0), 38.0, 38.0),
        Block((*booklet, 0.0), (148.0, 105.0, room.between(3.0, 12.0)), turn + 40.0),
    )
    props: list[Prop] = []
    performers: list[Performer] = []
    owners = []
    for number, thing in enumerate(things):
        spot = spots[order[number]]
        owner = someone(room, number, _nearest_side_deg(room, spot))
        put = above(room, IN_THE_AIR, spot, 20.0).lifted(115.0)
        start = 200.0 + 1600.0 * number
        carrier = visit(room, owner, number, put, start, lambda way: way.stay(200.0), IN_THE_AIR)
        performers.append(carrier)
        props.append(_put_down(thing, carrier.legs[1].end_ns))
        owners.append((owner, spot))
    for owner, spot in owners:
        beside = place_at(spot, room.between(105.0, 125.0), owner.side_deg + room.between(-15.0, 15.0))
        begin = above(room, POINTING, _inside(room, beside), room.between(25.0, 55.0))
        start = end_ms(performers[-1]) + 100.0
        performers.append(visit(room, owner, owner.number, begin, start, partial(_touch_thrice, room)))
    return Cast(tuple(performers), tuple(props), end_ms(performers[-1]) + 2000.0)


def stacks(room: Room) -> Cast:
    """Grow three stacks of paper by a millimetre at a time to 44 mm, to see when they are taken for touches."""
    steps = round(_TALLEST_MM / _STACK_STEP_MM)
    spots = [room.area.at(x, room.between(0.25, 0.75)) for x in (0.2, 0.5, 0.8)]
    sizes = (20.0, 50.0, 76.0)

    def stand(t_ns: int) -> tuple[Block, ...]:
        step = int(t_ns / (_STACK_STEP_MS * NS))
        if not 1 <= step <= steps:
            return ()
        height = _STACK_STEP_MM * step
        return tuple(Block((*spot, 0.0), (size, size, height)) for spot, size in zip(spots, sizes, strict=True))

    return Cast((), props_end_ms=(steps + 1) * _STACK_STEP_MS, stacks=stand)


def _wave(room: Room, person: Person, way: Way) -> None:
    for _ in range(2):
        way.draw(way.here.moved(somewhere(room, person, 0.05)), room.between(300.0, 900.0))
        way.go(way.here.lifted(room.between(18.0, 80.0) * room.lift), 200.0)


def _worker(room: Room, person: Person, hand: int, start_ms: float) -> Performer:
    begin = above(room, POINTING, somewhere(room, person, 0.2), room.between(22.0, 58.0))

    def work(way: Way) -> None:
        for _ in range(3):
            fly_to(way, somewhere(room, person, 0.15))
            touch_once(room, way, room.between(120.0, 400.0))
        fly_to(way, somewhere(room, person, 0.15))
        draw_line(room, person, way, room.between(200.0, 500.0))
        fly_to(way, somewhere(room, person, 0.2))
        tap_burst(room, way, 5)

    return visit(room, person, hand, begin, start_ms, work)


def _leaning(room: Room, dark_hair: bool) -> Cast:
    worker = _worker(room, someone(room, 0), 0, 2200.0)
    span_ms = end_ms(worker)
    facing_deg = room.between(0.0, 360.0)
    ahead = place_at((0.0, 0.0), 1.0, facing_deg)
    deep = room.between(0.25, 0.45) * room.area.size_mm[1]  # how far from the middle the head stops
    high = min(room.between(280.0, 420.0), 0.45 * room.height_mm)
    scale = room.between(0.9, 1.1)
    start = -1.3 * room.height_mm

    def leans(t_ns: int) -> Hand | None:
        s = t_ns / (span_ms * NS)
        if not 0.0 < s < 1.0:
            return None
        inwards = sin(2.0 * pi * s) ** 2  # twice in and out
        way = start + (-deep - start) * inwards
        return head((ahead[0] * way, ahead[1] * way, high), ahead, scale, dark_hair)

    return Cast((worker,), (leans,), span_ms)


def _over_a_part(room: Room, ahead_deg: float, extent: float, out_ms: float) -> Prop:
    """Return a head that comes in over the table's side opposite to a bearing, and goes out again."""
    eye = room.camera.eye_mm()
    share = (_HEAD_OFF_MM + 98.0) / float(np.linalg.norm(eye))  # of the way from the camera to the table
    x, y = place_at((0.0, 0.0), 1.0, ahead_deg)
    front_mm = 104.0 / share  # how far in front of a head's middle its chin is seen on the table
    rest, start = -(0.06 * extent + front_mm), -(1.1 * extent + 3.0 * front_mm)

    def looms(t_ns: int) -> Hand | None:
        t_ms = t_ns / NS
        inwards = min(max((t_ms - _HEAD_IN_MS) / _HEAD_WAY_MS, 0.0), 1.0)
        outwards = min(max((t_ms - out_ms) / _HEAD_WAY_MS, 0.0), 1.0)
        if inwards == outwards:
            return None
        way = start + (rest - start) * sin(0.5 * pi * (inwards - outwards))
        at = eye + share * (np.array([x * way, y * way, 0.0]) - eye)
        return head((float(at[0]), float(at[1]), float(at[2])), (x, y), 1.0, dark_hair=False)

    return looms


def _walker(room: Room, number: int, span_ms: float) -> Prop:
    """Return a leg that goes to and fro beside one of the table's four sides."""
    width, height = room.area.size_mm
    along_x, sign = number % 2 == 0, -1.0 if number < 2 else 1.0
    off = sign * (0.5 * (height if along_x else width) + room.between(120.0, 170.0))
    swing = 0.35 * (width if along_x else height)
    scale, top, phase = room.between(0.7, 1.1), room.between(-260.0, 60.0), room.between(0.0, 2.0 * pi)

    def walks(t_ns: int) -> Hand | None:
        if t_ns > span_ms * NS:
            return None
        way = swing * sin(2.0 * pi * t_ns / _WALK_NS + phase)
        return leg((way, off) if along_x else (off, way), room.ground.floor_mm, top, scale)

    return walks


def _put_down(thing: Block | Capsule, placed_ns: int) -> Prop:
    def stands(t_ns: int) -> Hand | None:
        return Hand((thing,), ()) if t_ns >= placed_ns else None

    return stands


def _nearest_side_deg(room: Room, spot: Place) -> float:
    """Return the side of the table from which a place is nearest."""
    (width, height), (cx, cy) = room.area.size_mm, room.area.centre_mm
    x, y = (spot[0] - cx) / width, (spot[1] - cy) / height
    return (90.0 if x > 0.0 else 270.0) if abs(x) > abs(y) else (180.0 if y > 0.0 else 0.0)


def _touch_thrice(room: Room, way: Way) -> None:
    for _ in range(3):
        touch_once(room, way, room.between(150.0, 400.0))


def _inside(room: Room, place: Place) -> Place:
    """Return the place of the area that is nearest to a place."""
    (cx, cy), (w, h) = room.area.centre_mm, room.area.size_mm
    return (
        min(max(place[0], cx - 0.46 * w), cx + 0.46 * w),
        min(max(place[1], cy - 0.46 * h), cy + 0.46 * h),
    )
