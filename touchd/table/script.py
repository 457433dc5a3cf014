"""A timeline of hands: gestures as strokes between places, each with the smooth speed of a real reach.

A reach between two places follows the minimum-jerk curve 10s³ - 15s⁴ + 6s⁵ (Flash and Hogan, 1985).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import cos, dist, radians, sin
from typing import TypeAlias

import numpy as np

from touchd.geometry import KINECT_SIZE
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Area, Fingertip, Hand, Place, TableCamera
from touchd.table.truth import HOVERING, TipTruth, in_view, tip_truth

_NS = 1_000_000
_PRESS_MS = 120.0  # down to the table, and up again
_REACH_MS = 180.0  # even the shortest reach takes this long
_REACH_MM_MS = 0.6
_ENTRY_RISE_MM = 40.0  # hands come in this much higher than they move about
_ENTRY_STEP_MM = 50.0
_ENTRY_STEPS = 60


@dataclass(frozen=True, slots=True)
class Touch:
    """A tap or a hold: down at a place, still for so long, and up again."""

    at_mm: Place
    contact_ms: float


@dataclass(frozen=True, slots=True)
class Drag:
    """Down at a place, along the table to another one in so long, and up again."""

    from_mm: Place
    to_mm: Place
    contact_ms: float


@dataclass(frozen=True, slots=True)
class Hover:
    """Over a place at a clearance for so long."""

    at_mm: Place
    clearance_mm: float
    stay_ms: float


Gesture: TypeAlias = Touch | Drag | Hover


@dataclass(frozen=True, slots=True)
class Actor:
    """A hand that comes in from where its arm is, makes its gestures one after the other, and leaves.

    ``grip`` is how it is held; its place and clearance are overwritten. ``travel_mm`` is the clearance it
    moves at.
    """

    grip: HandPose
    gestures: tuple[Gesture, ...]
    start_ms: float = 0.0
    travel_mm: float = 25.0
    shape: Callable[[HandPose], Hand] = pointing_hand


@dataclass(frozen=True, slots=True)
class Moment:
    """What a script shows at one time."""

    hands: tuple[Hand, ...]
    truth: tuple[TipTruth, ...]


@dataclass(frozen=True, slots=True)
class _Spot:
    x_mm: float
    y_mm: float
    clearance_mm: float


@dataclass(frozen=True, slots=True)
class _Stroke:
    """A reach from spot to spot; ``episode`` numbers the actor's touches from 0, and is -1 in between."""

    start_ns: int
    end_ns: int
    begin: _Spot
    end: _Spot
    episode: int

    def at(self, t_ns: int) -> _Spot:
        s = (t_ns - self.start_ns) / (self.end_ns - self.start_ns)
        share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        begin, end = self.begin, self.end
        return _Spot(
            begin.x_mm + share * (end.x_mm - begin.x_mm),
            begin.y_mm + share * (end.y_mm - begin.y_mm),
            begin.clearance_mm + share * (end.clearance_mm - begin.clearance_mm),
        )


class Script:
    """Actors over one area, seen by one camera."""

    def __init__(self, camera: TableCamera, area: Area, actors: Sequence[Actor]) -> None:
        self._camera = camera
        self._area = area
        self._parts = [(actor, _strokes(actor, camera)) for actor in actors]
        self._first_tips = _first_tips(self._parts)
        self.end_ns = max((strokes[-1].end_ns for _, strokes in self._parts), default=0)

    def at(self, t_ns: int) -> Moment:
        """Return the hands at a time, and the truth about those of their fingertips that are in view."""
        hands: list[Hand] = []
        truth: list[TipTruth] = []
        for which, (actor, strokes) in enumerate(self._parts):
            stroke = next((s for s in strokes if s.start_ns <= t_ns < s.end_ns), None)
            if stroke is None:
                continue
            spot = stroke.at(t_ns)
            place = (spot.x_mm, spot.y_mm)
            hand = actor.shape(replace(actor.grip, at_mm=place, clearance_mm=spot.clearance_mm))
            hands.append(hand)
            first = self._first_tips.get((which, stroke.episode))
            for finger, fingertip in enumerate(hand.fingertips):
                if in_view(self._camera, KINECT_SIZE, fingertip):
                    tip = HOVERING if first is None else first + finger
                    truth.append(tip_truth(self._area, fingertip, tip))
        return Moment(tuple(hands), tuple(truth))


def _first_tips(parts: Sequence[tuple[Actor, list[_Stroke]]]) -> dict[tuple[int, int], int]:
    """Return the first tip's number of every (actor, episode), counted in the order of time."""
    begins: dict[tuple[int, int], int] = {}
    for which, (_, strokes) in enumerate(parts):
        for stroke in strokes:
            if stroke.episode != HOVERING:
                begins.setdefault((which, stroke.episode), stroke.start_ns)
    numbers: dict[tuple[int, int], int] = {}
    following = 1
    for key in sorted(begins, key=lambda key: (begins[key], key)):
        actor = parts[key[0]][0]
        numbers[key] = following
        following += len(actor.shape(actor.grip).fingertips)
    return numbers


def _strokes(actor: Actor, camera: TableCamera) -> list[_Stroke]:
    """Return an actor's whole way, without a gap, from outside and back."""
    outside = _outside(actor, camera)
    strokes: list[_Stroke] = []
    t_ns, here = round(actor.start_ms * _NS), outside
    for spot, span_ms, episode in _legs(actor, outside):
        end_ns = t_ns + max(1, round(span_ms * _NS))
        strokes.append(_Stroke(t_ns, end_ns, here, spot, episode))
        t_ns, here = end_ns, spot
    return strokes


def _legs(actor: Actor, outside: _Spot) -> Iterator[tuple[_Spot, float, int]]:
    """Yield where an actor goes next, how long that takes in ms, and in which touch of its it does so."""
    here = outside
    for episode, gesture in enumerate(actor.gestures):
        begin_mm, end_mm, stay_ms, clearance_mm = _way(gesture)
        high_mm = actor.travel_mm if clearance_mm is None else clearance_mm
        above = _Spot(*begin_mm, high_mm)
        yield above, _reach_ms(here, above), HOVERING
        here = _Spot(*end_mm, high_mm)
        if clearance_mm is not None:
            yield here, stay_ms, HOVERING
            continue
        yield _Spot(*begin_mm, 0.0), _PRESS_MS, episode
        yield _Spot(*end_mm, 0.0), stay_ms, episode
        yield here, _PRESS_MS, episode
    yield outside, _reach_ms(here, outside), HOVERING


def _way(gesture: Gesture) -> tuple[Place, Place, float, float | None]:
    """Return a gesture's first and last place, the time between, and its clearance; None for the table."""
    match gesture:
        case Touch(at_mm, contact_ms):
            return at_mm, at_mm, contact_ms, None
        case Drag(from_mm, to_mm, contact_ms):
            return from_mm, to_mm, contact_ms, None
        case Hover(at_mm, clearance_mm, stay_ms):
            return at_mm, at_mm, stay_ms, clearance_mm


def _reach_ms(here: _Spot, there: _Spot) -> float:
    return _REACH_MS + dist((here.x_mm, here.y_mm), (there.x_mm, there.y_mm)) / _REACH_MM_MS


def _outside(actor: Actor, camera: TableCamera) -> _Spot:
    """Return where the fingertip is before the hand comes in: out of view, back along its arm."""
    x_mm, y_mm = _way(actor.gestures[0])[0] if actor.gestures else actor.grip.at_mm
    heading = radians(actor.grip.heading_deg)
    back = (-sin(heading) * _ENTRY_STEP_MM, cos(heading) * _ENTRY_STEP_MM)
    clearance_mm = actor.travel_mm + _ENTRY_RISE_MM
    for _ in range(_ENTRY_STEPS):
        if not in_view(camera, KINECT_SIZE, Fingertip((x_mm, y_mm), clearance_mm)):
            break
        x_mm, y_mm = x_mm + back[0], y_mm + back[1]
    return _Spot(x_mm + 2.0 * back[0], y_mm + 2.0 * back[1], clearance_mm)


def improvised(camera: TableCamera, area: Area, span_ms: float, rng: np.random.Generator) -> list[Actor]:
    """Return two hands that tap, hold, drag and hover, each in its own half and from changing sides.

    Contact times, drag speeds and clearances are spread as people's are: taps of 50 to 100 ms, drags of 60 to
    350 mm/s, hovering at 12 to 40 mm.
    """
    actors: list[Actor] = []
    for half in (0, 1):
        sides = (0.0, 180.0, 90.0 if half == 0 else 270.0)
        t_ms = float(rng.uniform(0.0, 600.0))
        turn = int(rng.integers(len(sides)))
        while t_ms < span_ms:
            actor = _visit(area, half, sides[turn % len(sides)], t_ms, rng)
            actors.append(actor)
            t_ms = _strokes(actor, camera)[-1].end_ns / _NS + float(rng.uniform(100.0, 600.0))
            turn += 1
    return actors


def _visit(area: Area, half: int, side_deg: float, start_ms: float, rng: np.random.Generator) -> Actor:
    grip = HandPose(
        (0.0, 0.0),
        heading_deg=side_deg + float(rng.uniform(-25.0, 25.0)),
        pitch_deg=float(rng.uniform(22.0, 50.0)),
        scale=float(rng.uniform(0.88, 1.15)),
        left=half == 0,
    )
    gestures = tuple(_gesture(area, half, rng) for _ in range(int(rng.integers(4, 8))))
    return Actor(grip, gestures, start_ms, travel_mm=float(rng.uniform(15.0, 35.0)))


def _gesture(area: Area, half: int, rng: np.random.Generator) -> Gesture:
    def somewhere() -> Place:
        return area.at(0.5 * half + float(rng.uniform(0.06, 0.40)), float(rng.uniform(0.1, 0.9)))

    first, second = somewhere(), somewhere()
    kind = rng.random()
    if kind < 0.5:
        return Touch(first, float(rng.uniform(50.0, 100.0)))
    if kind < 0.6:
        return Touch(first, float(rng.uniform(300.0, 900.0)))
    if kind < 0.85:
        speed_mm_ms = float(np.clip(0.12 * np.exp(0.6 * rng.standard_normal()), 0.06, 0.35))
        return Drag(first, second, max(150.0, dist(first, second) / speed_mm_ms))
    return Hover(first, float(rng.uniform(12.0, 40.0)), float(rng.uniform(200.0, 600.0)))
