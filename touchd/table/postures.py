"""How hands are held: fingertips where they are wanted, the palm and the idle fingers where they follow from it."""

from dataclasses import dataclass
from math import cos, radians, sin

from touchd.table.anatomy import (
    INDEX,
    KNUCKLES_MM,
    LITTLE,
    MIDDLE,
    RING,
    THUMB,
    Build,
    Palm,
    bent,
    finger_solids,
    lowest_of_palm_mm,
    palm_facing,
    palm_solids,
    reaching,
)
from touchd.table.scene import Place, Point, Solid
from touchd.table.vectors import length, mean, minus, plus, times, turned, unit

Bends = tuple[float, float, float]

CURLED: Bends = (68.0, 98.0, 45.0)
RELAXED: Bends = (24.0, 38.0, 20.0)
_SPREADS_DEG = (0.0, -7.0, 0.0, 6.0, 13.0)
_THUMB_TUCKED: tuple[Point, ...] = ((52.0, -40.0, -16.0), (78.0, -33.0, -27.0), (95.0, -17.0, -33.0))
_THUMB_ASIDE: tuple[Point, ...] = ((54.0, -46.0, -13.0), (80.0, -54.0, -19.0), (98.0, -54.0, -22.0))
_LEVEL_AT_DEG = 22.0  # fingers flatter than this have the palm level behind them
_FLATTEST_PALM_DEG = 5.0
_LONGEST_REACH, _SHORTEST_REACH = 0.985, 0.42  # of a finger's length, before the palm comes after it
_PULLS = 5


@dataclass(frozen=True, slots=True)
class Grip:
    """A way to hold the hand.

    ``tips`` are the fingers in play with their tips' (forward, right) from the hand's place, in mm of an adult's hand
    or, with ``by_spread``, in units of the stance's spread. ``extension`` is how much of its length a finger spans from
    knuckle to tip. Idle fingers bend by ``idle`` and stay ``gap_mm`` off the surface. A ``resting`` hand has its heel
    on the surface and its palm where the stance's anchor says, not where its fingertips are.
    """

    tips: tuple[tuple[int, Place], ...]
    extension: float = 0.985
    palm_pitch_deg: float | None = None
    roll_deg: float = 0.0
    idle: Bends = CURLED
    gap_mm: float = 14.0
    by_spread: bool = False
    resting: bool = False

    @property
    def fingers(self) -> tuple[int, ...]:
        """The numbers of the fingers in play."""
        return tuple(finger for finger, _ in self.tips)


@dataclass(frozen=True, slots=True)
class Held:
    """A posed hand: where its palm is, and its solids without an arm."""

    palm: Palm
    solids: tuple[Solid, ...]


@dataclass(frozen=True, slots=True)
class Aim:
    """What a hand is to do: its heading, its fingers' angle to the surface, the balls' centres of its tips in play.

    ``anchor_mm`` and ``lift_mm`` place a resting hand's palm; ``floor_mm`` is how high the surface reaches around here.
    """

    heading_deg: float
    pitch_deg: float
    balls_mm: tuple[Point, ...]
    anchor_mm: Place
    lift_mm: float
    floor_mm: float = 0.0


def pose(build: Build, grip: Grip, aim: Aim) -> Held:
    """Return a hand whose fingertips in play are exactly where the aim wants them."""
    palm = _resting_palm(build, grip, aim) if grip.resting else _following_palm(build, grip, aim)
    solids: list[Solid] = []
    targets = dict(zip(grip.fingers, aim.balls_mm, strict=True))
    for finger in (INDEX, MIDDLE, RING, LITTLE):
        joints = _finger(build, grip, aim, palm, finger, targets.get(finger))
        solids += finger_solids(joints, build.radii_mm(finger), build.breadth)
    thumb = _thumb(build, grip, aim, palm, targets.get(THUMB))
    _, *radii = build.radii_mm(THUMB)
    solids += finger_solids(thumb, (radii[0], *radii), build.breadth)[1:]
    solids += palm_solids(palm, build, thumb[1])
    return Held(palm, tuple(solids))


def _finger(build: Build, grip: Grip, aim: Aim, palm: Palm, finger: int, tip: Point | None) -> list[Point]:
    base = palm.at(KNUCKLES_MM[finger], build.scale)
    if tip is not None:
        return reaching(base, tip, build.bones_mm(finger), palm.up, build.follow)
    joints = bent(base, palm, build.bones_mm(finger), grip.idle, _SPREADS_DEG[finger] * (-1.0 if build.left else 1.0))
    return _clear(joints, build, grip, aim, finger)


def _thumb(build: Build, grip: Grip, aim: Aim, palm: Palm, tip: Point | None) -> list[Point]:
    base = palm.at(KNUCKLES_MM[THUMB], build.scale)
    if tip is not None:
        out = plus(palm.up, palm.right, -1.0)
        return reaching(base, tip, build.bones_mm(THUMB), out, 0.6)
    way = _THUMB_TUCKED if grip.idle == CURLED else _THUMB_ASIDE
    return _clear([base, *(palm.at(joint, build.scale) for joint in way)], build, grip, aim, THUMB)


def _clear(joints: list[Point], build: Build, grip: Grip, aim: Aim, finger: int) -> list[Point]:
    """Return joints raised off the surface, so that what does not mean to touch does not."""
    lowest = [aim.floor_mm + grip.gap_mm + radius for radius in build.radii_mm(finger)]
    return [(x, y, max(z, low)) for (x, y, z), low in zip(joints, lowest, strict=True)]


def _following_palm(build: Build, grip: Grip, aim: Aim) -> Palm:
    """Return the palm that suits the fingertips, moved on until none of them is out of reach."""
    pitch_deg = grip.palm_pitch_deg
    if pitch_deg is None:
        pitch_deg = max(aim.pitch_deg - _LEVEL_AT_DEG, _FLATTEST_PALM_DEG)
    palm = palm_facing(aim.heading_deg, pitch_deg, grip.roll_deg, build.left)
    slope, (ahead_x, ahead_y) = radians(aim.pitch_deg), turned((1.0, 0.0), aim.heading_deg)
    to_knuckle = (-ahead_x * cos(slope), -ahead_y * cos(slope), sin(slope))
    leading = [pair for pair in zip(grip.fingers, aim.balls_mm, strict=True) if pair[0] != THUMB]
    wrists = []
    for finger, ball in leading:
        knuckle = plus(ball, to_knuckle, grip.extension * sum(build.bones_mm(finger)))
        wrists.append(minus(knuckle, times(palm.turn(KNUCKLES_MM[finger]), build.scale)))
    palm = _within_reach(palm.moved(mean(wrists)), build, grip, aim)
    sunk_mm = aim.floor_mm - lowest_of_palm_mm(palm, build)
    return palm.moved((0.0, 0.0, max(sunk_mm, 0.0)))


def _within_reach(palm: Palm, build: Build, grip: Grip, aim: Aim) -> Palm:
    for _ in range(_PULLS):
        for finger, ball in zip(grip.fingers, aim.balls_mm, strict=True):
            way = minus(ball, palm.at(KNUCKLES_MM[finger], build.scale))
            distance, whole = length(way), sum(build.bones_mm(finger))
            wanted = min(max(distance, _SHORTEST_REACH * whole), _LONGEST_REACH * whole)
            if wanted != distance:
                palm = palm.moved(times(unit(way), distance - wanted))
    return palm


def _resting_palm(build: Build, grip: Grip, aim: Aim) -> Palm:
    """Return a palm whose lowest part lies on the surface, its writing finger's place being the anchor."""
    palm = palm_facing(aim.heading_deg, grip.palm_pitch_deg or 0.0, grip.roll_deg, build.left)
    finger = INDEX
    slope, (ahead_x, ahead_y) = radians(aim.pitch_deg), turned((1.0, 0.0), aim.heading_deg)
    back = grip.extension * sum(build.bones_mm(finger)) * cos(slope)
    x_mm, y_mm, _ = times(palm.turn(KNUCKLES_MM[finger]), build.scale)
    palm = palm.moved((aim.anchor_mm[0] - ahead_x * back - x_mm, aim.anchor_mm[1] - ahead_y * back - y_mm, 0.0))
    return palm.moved((0.0, 0.0, aim.floor_mm + aim.lift_mm - lowest_of_palm_mm(palm, build)))


# The ways that scenes hold hands.
POINTING = Grip(((INDEX, (0.0, 0.0)),))
TWO_FINGERS = Grip(((INDEX, (-3.0, -12.0)), (MIDDLE, (3.0, 12.0))), extension=0.95)
PINCHING = Grip(((THUMB, (-0.44, -0.2375)), (INDEX, (0.44, 0.2375))), extension=0.9, roll_deg=18.0, by_spread=True)
OPEN = Grip(
    (
        (THUMB, (-64.0, -62.0)),
        (INDEX, (-7.0, -30.0)),
        (MIDDLE, (4.0, 0.0)),
        (RING, (-6.0, 28.0)),
        (LITTLE, (-30.0, 53.0)),
    ),
    extension=0.95,
)
FLAT = Grip(
    (
        (THUMB, (-86.0, -74.0)),
        (INDEX, (-6.0, -33.0)),
        (MIDDLE, (4.0, -3.0)),
        (RING, (-8.0, 27.0)),
        (LITTLE, (-38.0, 56.0)),
    ),
    extension=0.985,
    palm_pitch_deg=0.0,
    gap_mm=0.0,
)
WRITING = Grip(((INDEX, (0.0, 0.0)),), extension=0.9, roll_deg=42.0, palm_pitch_deg=-4.0, gap_mm=0.0, resting=True)
IN_THE_AIR = Grip(((MIDDLE, (0.0, 0.0)),), extension=0.9, idle=RELAXED)
