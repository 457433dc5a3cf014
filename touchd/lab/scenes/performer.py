"""A hand in a scene: the person it belongs to, how it is held, and its way; and where that puts its fingertips."""

from dataclasses import dataclass
from math import atan2, degrees, hypot

from touchd.lab.scenes.timeline import Leg, Stance
from touchd.lab.scenes.truth import TrueTouch
from touchd.table.anatomy import Build
from touchd.table.body import Sleeve, with_arm
from touchd.table.postures import Aim, Grip, pose
from touchd.table.relief import Ground
from touchd.table.scene import Hand, Place, Point
from touchd.table.vectors import between, plus, turned

_SPEED_NS = 2_000_000
# Of how high it moves about, so much a hand keeps over what it passes. It rises before that, and sinks after it, over
# a share of its way; and less where it sets out and arrives.
_KEPT, _AHEAD, _ROUNDED, _STEPS = 0.8, 0.25, 0.1, 24


@dataclass(frozen=True, slots=True)
class Foot:
    """Where a fingertip stands or would stand on the surface, the surface's normal there, and the gap between."""

    place_mm: Point
    normal: Point
    height_mm: float


@dataclass(frozen=True, slots=True)
class Performer:
    """A hand that plays its part.

    ``pivot_mm`` is the far place outside the table from which the arm comes; ``wrist_deg`` how the hand is turned
    against it. ``ground`` is what it moves over where that is not the room's ground: a thing that lies there.
    ``holding_mm``: fingertips lower than this hold a thing and may be taken for touches; ``idle_over_mm``: how high
    that thing is under the other fingers. With ``forearm_rests`` the elbow is as high as the heel.
    """

    person: int
    hand: int
    build: Build
    grip: Grip
    pivot_mm: Place
    shoulder_mm: float
    wrist_deg: float
    sleeve: Sleeve | None
    legs: tuple[Leg, ...]
    ground: Ground | None = None
    holding_mm: float = 0.0
    idle_over_mm: float = 0.0
    forearm_rests: bool = False

    @property
    def end_ns(self) -> int:
        """When the hand has left."""
        return self.legs[-1].end_ns

    def leg(self, t_ns: int) -> Leg | None:
        """Return the leg that is under way at a time, None before the first and after the last."""
        return next((leg for leg in self.legs if leg.start_ns <= t_ns < leg.end_ns), None)

    def posed(self, leg: Leg, t_ns: int, ground: Ground) -> Hand:
        """Return the hand with its arm at a time within a leg."""
        stance = leg.at(t_ns)
        feet = self.feet(leg, t_ns, ground)
        radii = [self.build.tip_radius_mm(finger) for finger in self.grip.fingers]
        balls = tuple(
            plus(foot.place_mm, foot.normal, radius + foot.height_mm) for foot, radius in zip(feet, radii, strict=True)
        )
        heading = self._heading_deg(stance)
        floor_mm = max(ground.top_mm, self.idle_over_mm)
        aim = Aim(heading, stance.pitch_deg, balls, stance.anchor_mm, stance.heel_mm, floor_mm)
        held = pose(self.build, self.grip, aim)
        elbow_mm = stance.heel_mm if self.forearm_rests else None
        return with_arm(held, self.build, self.pivot_mm, self.shoulder_mm, self.sleeve, elbow_mm)

    def feet(self, leg: Leg, t_ns: int, ground: Ground) -> tuple[Foot, ...]:
        """Return where the fingertips in play are at a time within a leg, in the order of the grip."""
        stance = leg.at(t_ns)
        places = self._places(stance)
        if not ground.things:
            pairs = zip(places, stance.lifts_mm, strict=True)
            return tuple(Foot((*place, 0.0), (0.0, 0.0, 1.0), lift) for place, lift in pairs)
        return tuple(self._foot_on(leg, t_ns, ground, tip, place) for tip, place in enumerate(places))

    def speeds_mm_s(self, leg: Leg, t_ns: int) -> list[float]:
        """Return how fast the fingertips in play move along the surface."""
        before, after = max(t_ns - _SPEED_NS, leg.start_ns), min(t_ns + _SPEED_NS, leg.end_ns)
        pairs = zip(self._places(leg.at(before)), self._places(leg.at(after)), strict=True)
        return [hypot(b[0] - a[0], b[1] - a[1]) * 1e9 / (after - before) for a, b in pairs]

    def touches(self, tip: int) -> list[tuple[int, int]]:
        """Return the first and the last leg (their places in ``legs``) of each touch of a fingertip."""
        spans: list[tuple[int, int]] = []
        for i, leg in enumerate(self.legs):
            if leg.rests(tip):
                joined = bool(spans) and spans[-1][1] == i - 1
                spans = [*spans[:-1], (spans[-1][0], i)] if joined else [*spans, (i, i)]
        return spans

    def _foot_on(self, leg: Leg, t_ns: int, ground: Ground, tip: int, place: Place) -> Foot:
        """Return a foot on a surface that is not flat; through the air a hand does not follow its steps."""
        lift = leg.at(t_ns).lifts_mm[tip]
        here = ground.height_at(place)
        if not leg.rests(tip):
            share = leg.share(t_ns)
            begin, end = (ground.height_at(self._places(stance)[tip]) for stance in (leg.begin, leg.end))
            raised = self._raised_mm(leg, share, ground, tip, (begin, end))
            lift = max(lift + between(begin, end, share) + raised - here, 0.0)
        return Foot((*place, here), ground.normal_at(place), lift)

    def _raised_mm(self, leg: Leg, share: float, ground: Ground, tip: int, ends: tuple[float, float]) -> float:
        """Return how much higher than straight on a fingertip flies, so as to pass over what is in its way.

        ``ends``: how high the ground is where the leg begins and where it ends.
        """
        raised_mm = 0.0
        for step in range(_STEPS + 1):
            there = step / _STEPS
            stance = leg.begin.towards(leg.end, there)
            lift = stance.lifts_mm[tip]
            gap_mm = lift + between(*ends, there) - ground.height_at(self._places(stance)[tip])
            near = max(0.0, 1.0 - abs(share - there) / _AHEAD)
            raised_mm = max(raised_mm, near * (_KEPT * lift - gap_mm))
        return raised_mm * min(1.0, share / _ROUNDED, (1.0 - share) / _ROUNDED)

    def _places(self, stance: Stance) -> list[Place]:
        """Return the places under the fingertips in play."""
        stretch = stance.spread if self.grip.by_spread else stance.spread * self.build.scale
        side = -stretch if self.build.left else stretch
        heading = self._heading_deg(stance)
        places = []
        for _, (forward, right) in self.grip.tips:
            x_mm, y_mm = turned((forward * stretch, right * side), heading)
            places.append((stance.at_mm[0] + x_mm, stance.at_mm[1] + y_mm))
        return places

    def _heading_deg(self, stance: Stance) -> float:
        place = stance.anchor_mm if self.grip.resting else stance.at_mm
        x_mm, y_mm = place[0] - self.pivot_mm[0], place[1] - self.pivot_mm[1]
        return degrees(atan2(x_mm, -y_mm)) + self.wrist_deg + stance.turn_deg


@dataclass(frozen=True, slots=True)
class Numbered:
    """A touch with the legs that belong to it, with its way down and up: from leg ``first`` to leg ``last``."""

    touch: TrueTouch
    performer: int
    tip: int
    first: int
    last: int


def numbered(performers: tuple[Performer, ...]) -> tuple[Numbered, ...]:
    """Return all touches, numbered from 1 in the order in which their fingertips begin to come down."""
    found = []
    for which, performer in enumerate(performers):
        for tip, finger in enumerate(performer.grip.fingers):
            for begin, end in performer.touches(tip):
                first, last = max(begin - 1, 0), min(end + 1, len(performer.legs) - 1)
                times = performer.legs[begin].start_ns, performer.legs[end].end_ns
                found.append((performer.legs[first].start_ns, which, tip, finger, first, last, times))
    found.sort()
    return tuple(
        Numbered(_touch(number, performers[which], finger, times), which, tip, first, last)
        for number, (_, which, tip, finger, first, last, times) in enumerate(found, 1)
    )


def finger_number(hand: int, finger: int) -> int:
    """Return the scene-wide number of a hand's finger (0 thumb to 4 little)."""
    return 5 * hand + finger


def _touch(number: int, performer: Performer, finger: int, times: tuple[int, int]) -> TrueTouch:
    whose = finger_number(performer.hand, finger)
    return TrueTouch(number, whose, performer.hand, performer.person, *times)
