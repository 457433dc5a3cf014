"""The way of an actor's hand as strokes, each with the smooth speed of a real reach.

A reach between two places follows the minimum-jerk curve 10s³ - 15s⁴ + 6s⁵ (Flash and Hogan, 1985).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import cos, dist, radians, sin

from touchd.geometry import KINECT_SIZE
from touchd.table.actors import Actor, Circle, Drag, Gesture, Hover, Pinch, Touch
from touchd.table.hands import HandPose
from touchd.table.scene import Fingertip, Place, TableCamera
from touchd.table.truth import HOVERING, in_view

_NS = 1_000_000
_PRESS_MS = 120.0  # down to the table, and up again
_REACH_MS = 180.0  # even the shortest reach takes this long
_REACH_MM_MS = 0.6
_ENTRY_RISE_MM = 40.0  # hands come in this much higher than they move about
_ENTRY_STEP_MM = 50.0
_ENTRY_STEPS = 60


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a hand is and what differs from its actor's grip; ``turn_deg`` is added to the grip's heading."""

    at_mm: Place
    clearance_mm: float
    turn_deg: float
    spread_mm: float

    def raised(self, by_mm: float) -> "Spot":
        """Return the spot higher up."""
        return replace(self, clearance_mm=self.clearance_mm + by_mm)

    def pose(self, grip: HandPose) -> HandPose:
        """Return the pose of a hand that is here."""
        return replace(
            grip,
            at_mm=self.at_mm,
            clearance_mm=self.clearance_mm,
            heading_deg=grip.heading_deg + self.turn_deg,
            spread_mm=self.spread_mm,
        )


@dataclass(frozen=True, slots=True)
class Orbit:
    """A way around a centre instead of straight on."""

    centre_mm: Place
    sweep_deg: float  # clockwise in the picture

    def moved(self, from_mm: Place, share: float) -> Place:
        """Return the place after a share of the way."""
        angle = radians(self.sweep_deg * share)
        x_mm, y_mm = from_mm[0] - self.centre_mm[0], from_mm[1] - self.centre_mm[1]
        return (
            self.centre_mm[0] + x_mm * cos(angle) - y_mm * sin(angle),
            self.centre_mm[1] + x_mm * sin(angle) + y_mm * cos(angle),
        )


@dataclass(frozen=True, slots=True)
class Stroke:
    """A reach from spot to spot; ``episode`` numbers the actor's touches from 0, and is -1 in between."""

    start_ns: int
    end_ns: int
    begin: Spot
    end: Spot
    episode: int
    orbit: Orbit | None

    def at(self, t_ns: int) -> Spot:
        """Return where the hand is at a time within the stroke."""
        s = (t_ns - self.start_ns) / (self.end_ns - self.start_ns)
        share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        begin, end = self.begin, self.end
        straight = (_between(begin.at_mm[0], end.at_mm[0], share), _between(begin.at_mm[1], end.at_mm[1], share))
        return Spot(
            straight if self.orbit is None else self.orbit.moved(begin.at_mm, share),
            _between(begin.clearance_mm, end.clearance_mm, share),
            _between(begin.turn_deg, end.turn_deg, share),
            _between(begin.spread_mm, end.spread_mm, share),
        )


@dataclass(frozen=True, slots=True)
class _Course:
    """A gesture's own part of the way: its ends, low as they are, and the time between."""

    begin: Spot
    end: Spot
    span_ms: float
    touches: bool = True
    orbit: Orbit | None = None


@dataclass(frozen=True, slots=True)
class _Leg:
    """Where an actor goes next, how long that takes, and in which touch of its it does so."""

    to: Spot
    span_ms: float
    episode: int = HOVERING
    orbit: Orbit | None = None


def strokes(actor: Actor, camera: TableCamera) -> list[Stroke]:
    """Return an actor's whole way, without a gap, from outside the camera's picture and back."""
    outside = _outside(actor, camera)
    way: list[Stroke] = []
    t_ns, here = round(actor.start_ms * _NS), outside
    for leg in _legs(actor, outside):
        end_ns = t_ns + max(1, round(leg.span_ms * _NS))
        way.append(Stroke(t_ns, end_ns, here, leg.to, leg.episode, leg.orbit))
        t_ns, here = end_ns, leg.to
    return way


def _legs(actor: Actor, outside: Spot) -> Iterator[_Leg]:
    here = outside
    for episode, gesture in enumerate(actor.gestures):
        course = _course(gesture, actor.grip)
        above = course.begin.raised(actor.travel_mm if course.touches else 0.0)
        yield _Leg(above, _reach_ms(here, above))
        if not course.touches:
            yield _Leg(course.end, course.span_ms)
            here = course.end
            continue
        yield _Leg(course.begin, _PRESS_MS, episode)
        yield _Leg(course.end, course.span_ms, episode, course.orbit)
        here = course.end.raised(actor.travel_mm)
        yield _Leg(here, _PRESS_MS, episode)
    yield _Leg(outside, _reach_ms(here, outside))


def _course(gesture: Gesture, grip: HandPose) -> _Course:
    def down(at_mm: Place, turn_deg: float = 0.0) -> Spot:
        return Spot(at_mm, 0.0, turn_deg, grip.spread_mm)

    match gesture:
        case Touch(at_mm, contact_ms):
            return _Course(down(at_mm), down(at_mm), contact_ms)
        case Drag(from_mm, to_mm, contact_ms, turn_deg):
            return _Course(down(from_mm), down(to_mm, turn_deg), contact_ms)
        case Circle(centre_mm, radius_mm, turns, contact_ms):
            orbit = Orbit(centre_mm, turns * 360.0)
            top = (centre_mm[0], centre_mm[1] - radius_mm)
            return _Course(down(top), down(orbit.moved(top, 1.0)), contact_ms, orbit=orbit)
        case Pinch(at_mm, from_spread_mm, to_spread_mm, contact_ms, turn_deg):
            closed = Spot(at_mm, 0.0, 0.0, from_spread_mm)
            return _Course(closed, Spot(at_mm, 0.0, turn_deg, to_spread_mm), contact_ms)
        case Hover(at_mm, clearance_mm, stay_ms):
            over = down(at_mm).raised(clearance_mm)
            return _Course(over, over, stay_ms, touches=False)


def _between(a: float, b: float, share: float) -> float:
    return a + share * (b - a)


def _reach_ms(here: Spot, there: Spot) -> float:
    return _REACH_MS + dist(here.at_mm, there.at_mm) / _REACH_MM_MS


def _outside(actor: Actor, camera: TableCamera) -> Spot:
    """Return where the fingertip is before the hand comes in: out of view, back along its arm."""
    grip = actor.grip
    x_mm, y_mm = _course(actor.gestures[0], grip).begin.at_mm if actor.gestures else grip.at_mm
    heading = radians(grip.heading_deg)
    back = (-sin(heading) * _ENTRY_STEP_MM, cos(heading) * _ENTRY_STEP_MM)
    clearance_mm = actor.travel_mm + _ENTRY_RISE_MM
    for _ in range(_ENTRY_STEPS):
        if not in_view(camera, KINECT_SIZE, Fingertip((x_mm, y_mm), clearance_mm)):
            break
        x_mm, y_mm = x_mm + back[0], y_mm + back[1]
    return Spot((x_mm + 2.0 * back[0], y_mm + 2.0 * back[1]), clearance_mm, 0.0, grip.spread_mm)
