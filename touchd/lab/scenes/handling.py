"""Things that are carried in, put down, touched, pushed and taken away."""

from dataclasses import dataclass, replace
from functools import partial
from math import atan2, cos, degrees, dist, hypot, radians

from touchd.lab.scenes import things
from touchd.lab.scenes.cast import NS, Cast, above, anywhere, end_ms, fly_to, lift, press, visit
from touchd.lab.scenes.people import Person, hand_of, outside, pivot, someone
from touchd.lab.scenes.performer import Performer
from touchd.lab.scenes.pointing import touch_once
from touchd.lab.scenes.room import Room
from touchd.lab.scenes.things import Kind, Laid, Phase, Thing
from touchd.lab.scenes.timeline import Way, place_at
from touchd.table.postures import IN_THE_AIR, POINTING
from touchd.table.relief import Ground
from touchd.table.scene import Place

TOUCHABLE_AFTER_S = 8.0  # what lies so long must be touchable
_CARRIED_MM = 100.0
_HOLDING_MM = 15.0  # fingertips that hold something lower than this, at 0.75 m, may be taken for touches
_THIN_MM = 2.0  # thinner things are pushed from above
_BESIDE_FROM_MM, _BESIDE_TO_MM = 35.0, 150.0
_BEHIND = 0.6  # as the cosine of how far to the side of straight ahead something is
# How far arms keep off a thing, from their middle, and where along them, from the fingertip, that is looked at.
_OFF_MM, _ALONG_ARM_MM = 50.0, (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
_OVER_MM = 20.0  # hands fly over things by this much
_TRIES = 400


@dataclass(frozen=True, slots=True)
class Owner:
    """Who handles a thing, with which hand, and which way they look: bearing 0 is up the picture, 90 to the right."""

    person: Person
    left: bool
    heading_deg: float

    def fingertip(self, kind: Kind, laid: Laid, inside_mm: float) -> Place:
        """Return where a fingertip is so far inside the edge of a thing that is nearest to its owner."""
        back_deg = self.heading_deg + 180.0
        return place_at(laid.at_mm, kind.edge_mm(laid, back_deg) - inside_mm, back_deg)


def phone(room: Room) -> Cast:
    """Handle a phone."""
    return _handled(room, things.phone(room.between(7.5, 8.5)))


def cup(room: Room) -> Cast:
    """Handle a cup with a lid."""
    return _handled(room, things.cup(room.between(80.0, 95.0), room.between(72.0, 84.0)))


def book(room: Room) -> Cast:
    """Handle a book."""
    return _handled(room, things.book(room.between(180.0, 230.0), room.between(120.0, 160.0), room.between(20.0, 40.0)))


def paper(room: Room) -> Cast:
    """Handle a sheet of paper."""
    return _handled(room, things.paper(room.between(0.1, 1.0)))


def laptop(room: Room) -> Cast:
    """Handle an open laptop."""
    return _handled(room, things.laptop())


def _handled(room: Room, kind: Kind) -> Cast:
    owner, lies = _someone_with_a_place(room)
    put = _carry(room, owner, kind, lies, 200.0)
    over_mm = kind.size_mm[2] + _OVER_MM
    beside = _touching(room, owner.person, _beside(room, owner, kind, lies, 3), end_ms(put) + 100.0, over_mm)
    on = _touching(room, owner.person, _on(room, kind, lies, 3), put.legs[2].end_ns / NS + 1e3 * TOUCHABLE_AFTER_S)
    on = replace(on, ground=Ground((kind.as_ground(lies),)))
    push_mm = room.between(58.0, 72.0)
    pushed = replace(lies, at_mm=place_at(lies.at_mm, push_mm, owner.heading_deg))
    push = _push(room, owner, kind, lies, push_mm, end_ms(on) + 200.0)
    freed = place_at(lies.at_mm, kind.edge_mm(lies, owner.heading_deg) - 0.45 * push_mm, owner.heading_deg + 180.0)
    again = [freed, *_beside(room, owner, kind, pushed, 1)]
    after = _touching(room, owner.person, again, end_ms(push) + 200.0, over_mm)
    take = _carry(room, owner, kind, pushed, end_ms(after) + 200.0)
    # Fingertips that take it by its upper side touch what has become part of the surface.
    take = replace(take, holding_mm=take.holding_mm + kind.held_over_mm)
    gone = _touching(room, owner.person, [*_on(room, kind, pushed, 3), freed], end_ms(take) + 100.0)
    phases = (
        _held(put, (0, 2), lies.at_mm, 2),
        Phase(put.legs[2].end_ns, push.legs[3].start_ns, lies.at_mm),
        _held(push, (3, 3), lies.at_mm, 3),
        Phase(push.legs[3].end_ns, take.legs[2].start_ns, pushed.at_mm),
        _held(take, (2, 4), pushed.at_mm, 2),
    )
    return Cast((put, beside, on, push, after, take, gone), things=(Thing(kind, lies.turn_deg, phases),))


def _someone_with_a_place(room: Room) -> tuple[Owner, Laid]:
    """Return an owner on one of the table's long sides, and where they put their thing."""
    person = someone(room, 0, float(room.rng.choice([0.0, 180.0])) + room.between(-12.0, 12.0))
    left = bool(room.rng.random() < 0.4)
    width, height = room.area.size_mm
    spot = place_at(room.area.centre_mm, room.between(0.1, 0.15) * height, person.side_deg)
    spot = (spot[0] + room.between(-0.08, 0.08) * width, spot[1])
    x_mm, y_mm = pivot(room, person, left)
    heading = degrees(atan2(spot[0] - x_mm, y_mm - spot[1]))
    return Owner(person, left, heading), Laid(spot, 0.0, heading + room.between(-12.0, 12.0), held=False)


def _carry(room: Room, owner: Owner, kind: Kind, laid: Laid, start_ms: float) -> Performer:
    """Return a hand that comes to where a thing lies, holds it there for a moment, and leaves.

    Its third leg (2) is the one in which it holds what lies; before it carries it in, or after it away.
    """
    low = above(room, IN_THE_AIR, owner.fingertip(kind, laid, kind.hold_in_mm), 20.0).lifted(kind.hold_up_mm)
    high = low.lifted(kind.hold_up_mm + _CARRIED_MM)
    beyond_mm = 100.0 + hypot(*kind.size_mm)
    way = Way(outside(room, owner.person, owner.left, low, beyond_mm).lifted(high.lifts_mm[0]), start_ms)
    way.reach(high)
    way.go(low, 450.0)
    way.stay(200.0)
    way.go(high, 350.0)
    way.reach(outside(room, owner.person, owner.left, low, beyond_mm).lifted(high.lifts_mm[0]))
    hand = hand_of(room, owner.person, int(owner.left), IN_THE_AIR, way, owner.left, wrist_deg=0.0)
    return replace(hand, holding_mm=_HOLDING_MM * room.lift, idle_over_mm=kind.held_over_mm)


def _push(room: Room, owner: Owner, kind: Kind, laid: Laid, push_mm: float, start_ms: float) -> Performer:
    """Return a finger that pushes a thing away from its owner, in its fourth leg (3)."""
    thin = kind.size_mm[2] < _THIN_MM
    ball_mm = owner.person.build.breadth * owner.person.build.tip_radius_mm(1)
    begin = owner.fingertip(kind, laid, kind.hold_in_mm if thin else -ball_mm - 2.0)

    def part(way: Way) -> None:
        press(way, 150.0)
        way.stay(150.0)
        end = place_at(way.here.at_mm, push_mm, owner.heading_deg)
        way.draw(way.here.moved(end), room.between(80.0, 150.0))
        way.stay(200.0)
        lift(room, way)

    stance = above(room, POINTING, begin, room.between(28.0, 45.0))
    hand = visit(room, owner.person, int(owner.left), stance, start_ms, part, left=owner.left, wrist_deg=0.0)
    return replace(hand, ground=Ground((kind.as_ground(laid),))) if thin else hand


def _touching(room: Room, person: Person, places: list[Place], start_ms: float, over_mm: float = 0.0) -> Performer:
    """Return a hand that touches places one after the other, and between them is at least so high."""
    begin = above(room, POINTING, places[0], room.between(28.0, 55.0))
    left = bool(room.rng.random() < 0.4)
    return visit(room, person, int(left), begin, start_ms, partial(_touch_each, room, places, over_mm), left=left)


def _touch_each(room: Room, places: list[Place], over_mm: float, way: Way) -> None:
    for place in places:
        low = way.here
        if over_mm > low.lifts_mm[0]:
            way.go(low.lifted(over_mm), 150.0)
            fly_to(way, place)
            way.go(low.moved(place), 150.0)
        else:
            fly_to(way, place)
        touch_once(room, way, room.between(150.0, 400.0))


def _on(room: Room, kind: Kind, laid: Laid, count: int) -> list[Place]:
    """Return places on a thing."""
    (left, far), (right, near) = kind.top_mm
    return [laid.place(room.between(left, right), room.between(far, near)) for _ in range(count)]


def _beside(room: Room, owner: Owner, kind: Kind, laid: Laid, count: int) -> list[Place]:
    """Return places beside a thing, near it and not behind it as its owner sees it."""
    tries = [anywhere(room, 0.06) for _ in range(_TRIES)]
    arms = [pivot(room, owner.person, left) for left in (False, True)]
    return [
        at
        for at in tries
        if _is_beside(owner, kind, laid, at) and not any(_arm_meets(kind, laid, at, arm) for arm in arms)
    ][:count]


def _is_beside(owner: Owner, kind: Kind, laid: Laid, at: Place) -> bool:
    behind = cos(radians(_bearing_deg(laid, at) - owner.heading_deg)) > _BEHIND
    return _BESIDE_FROM_MM < _off_mm(kind, laid, at) < _BESIDE_TO_MM and not behind


def _arm_meets(kind: Kind, laid: Laid, at: Place, pivot_mm: Place) -> bool:
    """Return whether the arm that comes from a pivot to a fingertip would go through a thing."""
    way_mm = dist(at, pivot_mm)
    shares = [along_mm / way_mm for along_mm in _ALONG_ARM_MM]
    arm = [(at[0] + k * (pivot_mm[0] - at[0]), at[1] + k * (pivot_mm[1] - at[1])) for k in shares]
    return any(_off_mm(kind, laid, place) < _OFF_MM for place in arm)


def _bearing_deg(laid: Laid, at: Place) -> float:
    """Return in which direction a place is from a thing's middle."""
    return degrees(atan2(at[0] - laid.at_mm[0], laid.at_mm[1] - at[1]))


def _off_mm(kind: Kind, laid: Laid, at: Place) -> float:
    """Return how far a place is from a thing's edge, outwards from its middle."""
    return dist(at, laid.at_mm) - kind.edge_mm(laid, _bearing_deg(laid, at))


def _held(holder: Performer, legs: tuple[int, int], middle_mm: Place, at_leg: int) -> Phase:
    """Return the time of some of a holder's legs, in one of which the thing's middle is where it is said to be."""
    x_mm, y_mm = holder.legs[at_leg].begin.at_mm
    way = (middle_mm[0] - x_mm, middle_mm[1] - y_mm)
    return Phase(holder.legs[legs[0]].start_ns, holder.legs[legs[1]].end_ns, way, holder)
