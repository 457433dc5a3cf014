"""Several fingers of a hand: pinching, ten fingers, a flat palm, a writing hand."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from touchd.lab.scenes.cast import Cast, above, fly_to, lift, press, somewhere, spread_of, visit
from touchd.lab.scenes.people import Person, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.anatomy import INDEX, THUMB
from touchd.table.postures import FLAT, OPEN, PINCHING, TWO_FINGERS, WRITING
from touchd.table.scene import Place

_FLAT_PITCH_DEG = 4.0
_WRITING_LIFT_MM = 12.0


def pinch(room: Room) -> Cast:
    """Draw thumb and index finger together and apart, down to where they all but meet."""
    person = someone(room, 0)
    stance = above(room, PINCHING, somewhere(room, person, 0.3), room.between(30.0, 46.0), spread=80.0)
    return Cast((visit(room, person, 0, stance, 200.0, partial(_pinches, room, person), PINCHING),))


def two_fingers(room: Room) -> Cast:
    """Slide index and middle finger together, side by side."""
    person = someone(room, 0)
    stance = above(
        room, TWO_FINGERS, somewhere(room, person, 0.25), room.between(25.0, 45.0), spread=room.between(1.0, 1.3)
    )
    return Cast((visit(room, person, 0, stance, 200.0, partial(_slides, room, person), TWO_FINGERS),))


def five(room: Room) -> Cast:
    """Bring all five fingers of a hand down, slide and turn them."""
    person = someone(room, 0)
    return Cast((_open_hand(room, person, 0, somewhere(room, person, 0.33), 200.0, left=None),))


def ten(room: Room) -> Cast:
    """Slide and turn all ten fingers of one person."""
    person = someone(room, 0)
    return Cast(both_hands_open(room, person, 0, somewhere(room, person, 0.44), 200.0))


def flat_palm(room: Room) -> Cast:
    """Lay a hand flat on the surface: its five fingertips touch, its palm does not count."""
    person = someone(room, 0)
    stance = above(room, FLAT, somewhere(room, person, 0.33), _FLAT_PITCH_DEG, spread=room.between(0.95, 1.1))
    return Cast((visit(room, person, 0, stance, 200.0, partial(_lay_flat, room, person), FLAT, wrist_deg=0.0),))


def writing(room: Room) -> Cast:
    """Write small letters with an index finger while the hand's heel rests on the surface."""
    person = someone(room, 0)
    stance = above(room, WRITING, somewhere(room, person, 0.3), room.between(32.0, 45.0))
    return Cast((visit(room, person, 0, stance, 200.0, partial(_write, room, person), WRITING),))


def both_hands_open(
    room: Room, person: Person, first_hand: int, middle: Place, start_ms: float
) -> tuple[Performer, Performer]:
    """Return both hands of a person, open, beside each other around a place."""
    apart = max(115.0 * person.build.scale, 0.16 * room.area.size_mm[0])
    left = place_at(middle, apart, person.side_deg + 90.0)
    right = place_at(middle, apart, person.side_deg - 90.0)
    return (
        _open_hand(room, person, first_hand, left, start_ms, left=True),
        _open_hand(room, person, first_hand + 1, right, start_ms + room.between(0.0, 200.0), left=False),
    )


def _open_hand(room: Room, person: Person, hand: int, at: Place, start_ms: float, left: bool | None) -> Performer:
    stance = above(room, OPEN, at, room.between(26.0, 42.0), spread=room.between(0.92, 1.12))
    slide = _slider(room, at)
    return visit(room, person, hand, stance, start_ms, slide, OPEN, left, wrist_deg=room.between(-8.0, 8.0))


def _slider(room: Room, home: Place) -> Callable[[Way], None]:
    def part(way: Way) -> None:
        _land(room, way)
        for _ in range(3):
            near = place_at(home, room.between(10.0, 40.0), room.between(0.0, 360.0))
            way.draw(way.here.moved(near), room.between(80.0, 300.0))
            way.go(replace(way.here, turn_deg=room.between(-18.0, 18.0)), room.between(600.0, 1000.0))
            way.go(spread_of(way.here, room.between(0.92, 1.15)), room.between(300.0, 600.0))
        lift(room, way)

    return part


def _land(room: Room, way: Way) -> None:
    """Bring the fingertips down, not quite at the same time."""
    lifts = list(way.here.lifts_mm)
    near = way.here.lifted(6.0 * room.lift)
    way.go(near, 130.0)
    for tip in room.rng.permutation(len(lifts)).tolist():
        down = tuple(0.0 if i == tip else value for i, value in enumerate(way.here.lifts_mm))
        way.go(replace(way.here, lifts_mm=down), room.between(20.0, 60.0))


def _slides(room: Room, person: Person, way: Way) -> None:
    for _ in range(3):
        fly_to(way, somewhere(room, person, 0.25))
        press(way, 120.0)
        way.draw(way.here.moved(somewhere(room, person, 0.25)), room.between(150.0, 500.0))
        lift(room, way)


def _pinches(room: Room, person: Person, way: Way) -> None:
    thick = person.build.tip_radius_mm(THUMB) + person.build.tip_radius_mm(INDEX)
    closest = max(16.0, thick * person.build.breadth + 1.0)
    widest = 100.0 * person.build.scale
    for share in (0.0, 0.2, 0.4, 0.7):
        fly_to(way, somewhere(room, person, 0.25))
        narrow = closest + share * 45.0
        way.go(spread_of(way.here, widest), 200.0)
        press(way, 120.0)
        turn = room.between(-30.0, 30.0)
        way.go(replace(way.here, spread=narrow, turn_deg=turn), room.between(600.0, 1000.0))
        way.stay(250.0)
        way.go(replace(way.here, spread=widest, turn_deg=0.0), room.between(600.0, 1000.0))
        lift(room, way)


def _lay_flat(room: Room, person: Person, way: Way) -> None:
    for _ in range(2):
        press(way, room.between(180.0, 260.0))
        way.stay(room.between(700.0, 1200.0))
        near = place_at(way.here.at_mm, room.between(20.0, 60.0), room.between(0.0, 360.0))
        way.draw(way.here.moved(near), room.between(60.0, 150.0))
        lift(room, way, 200.0)
        fly_to(way, somewhere(room, person, 0.33))


def _write(room: Room, person: Person, way: Way) -> None:
    """Write words: the heel rests while the finger draws strokes of a few mm, and hops between words."""
    for _ in range(3):
        home = way.here.at_mm
        # The finger hangs over the surface, then the heel comes down, then the finger.
        raised = _WRITING_LIFT_MM * room.lift
        way.go(replace(way.here, lifts_mm=(raised,), heel_mm=0.0), 220.0)
        for _ in range(4):
            spot = place_at(home, room.between(0.0, 12.0), room.between(0.0, 360.0))
            way.go(replace(way.here, at_mm=spot), room.between(90.0, 150.0))
            way.go(replace(way.here, lifts_mm=(0.0,)), 90.0)
            for _ in range(int(room.rng.integers(2, 5))):
                spot = place_at(home, room.between(3.0, 16.0), room.between(0.0, 360.0))
                way.go(replace(way.here, at_mm=spot), room.between(120.0, 260.0))
            way.go(replace(way.here, lifts_mm=(raised,)), 90.0)
        lift(room, way, 200.0)
        fly_to(way, somewhere(room, person, 0.3))
