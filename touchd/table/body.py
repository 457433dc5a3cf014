"""The rest of people: arms with sleeves, a head with shoulders, legs."""

from dataclasses import dataclass
from math import sqrt

from touchd.table.anatomy import Build
from touchd.table.postures import Held
from touchd.table.scene import Capsule, Hand, Place, Point, Sphere
from touchd.table.vectors import UP, away, between, length, minus, plus, square_to, times, unit

_FOREARM_MM, _UPPER_MM = 245.0, 300.0
_WRIST_RADIUS_MM = 23.0
_ELBOW_CLEAR_MM = 58.0
_ARM_SHARE = 0.86  # of the arm's length: how far people keep their shoulder from their wrist
_LEAN_MM = 420.0  # from a shoulder back to the hips of someone who leans over the table
_SLEEVE_MM = 9.0  # that cloth adds


@dataclass(frozen=True, slots=True)
class Sleeve:
    """A sleeve: where it begins on the way from wrist to elbow (0..1), and whether it swallows the sensor's light."""

    begins: float
    dark: bool = False


def with_arm(
    held: Held,
    build: Build,
    pivot_mm: Place,
    shoulder_mm: float,
    sleeve: Sleeve | None,
    elbow_mm: float | None = None,
) -> Hand:
    """Return a hand with the arm that leads to it from the direction of a far place outside the table.

    ``shoulder_mm`` is how high over the table the shoulder is; it stays an arm's length behind the wrist, as people
    lean and step. ``elbow_mm``: how high the elbow's underside is over the table; None: as hangs from the shoulder.
    """
    scale = build.scale
    x_mm, y_mm, z_mm = plus(held.palm.wrist_mm, held.palm.forward, -6.0 * scale)
    wrist: Point = (x_mm, y_mm, max(z_mm, _WRIST_RADIUS_MM * scale))
    fore, upper = _FOREARM_MM * scale, _UPPER_MM * scale
    out = ((pivot_mm[0] - wrist[0]), (pivot_mm[1] - wrist[1]))
    distance = max(away(pivot_mm, (wrist[0], wrist[1])), 1.0)
    rise = shoulder_mm - wrist[2]
    level = sqrt(max((_ARM_SHARE * (fore + upper)) ** 2 - rise * rise, (0.4 * (fore + upper)) ** 2))
    shoulder = (wrist[0] + out[0] / distance * level, wrist[1] + out[1] / distance * level, shoulder_mm)
    elbow = _elbow(wrist, shoulder, fore, upper, held.palm.right)
    if elbow_mm is not None:
        elbow = (elbow[0], elbow[1], elbow_mm + 40.0 * scale + (_SLEEVE_MM * scale if sleeve else 0.0))
    arm = Capsule(elbow, shoulder, 40.0 * scale, 52.0 * scale)
    hip = plus(shoulder, (out[0] / distance, out[1] / distance, 0.0), _LEAN_MM)
    trunk = Capsule(shoulder, hip, 75.0 * scale, 115.0 * scale)
    if sleeve is None:
        return Hand((*held.solids, Capsule(wrist, elbow, _WRIST_RADIUS_MM * scale, 36.0 * scale), arm, trunk), ())
    cuff = plus(times(wrist, 1.0 - sleeve.begins), elbow, sleeve.begins)
    skin = Capsule(wrist, cuff, _WRIST_RADIUS_MM * scale, between(23.0, 36.0, sleeve.begins) * scale)
    thick = _SLEEVE_MM * scale
    cloth = (
        Capsule(cuff, elbow, between(23.0, 37.0, sleeve.begins) * scale + thick, 37.0 * scale + thick),
        Capsule(elbow, shoulder, 40.0 * scale + thick, 54.0 * scale + thick),
    )
    if sleeve.dark:
        return Hand((*held.solids, skin), (), dark=(*cloth, trunk))
    return Hand((*held.solids, skin, *cloth, trunk), ())


def head(at_mm: Point, facing: Place, scale: float, dark_hair: bool) -> Hand:
    """Return a head whose middle is somewhere over the table, with neck, shoulders and the hair on top.

    ``facing`` is the direction in which the person looks: the body is behind.
    """
    ahead = unit((facing[0], facing[1], 0.0))
    side: Point = (-ahead[1], ahead[0], 0.0)
    chin = plus(plus(at_mm, ahead, 52.0 * scale), UP, -52.0 * scale)
    nape = plus(plus(at_mm, ahead, -95.0 * scale), UP, -75.0 * scale)
    trunk = plus(plus(nape, ahead, -90.0 * scale), UP, -60.0 * scale)
    bust = [
        Capsule(at_mm, chin, 78.0 * scale, 52.0 * scale),
        Capsule(at_mm, nape, 60.0 * scale, 58.0 * scale),
        Capsule(plus(trunk, side, -150.0 * scale), plus(trunk, side, 150.0 * scale), 62.0 * scale, 62.0 * scale),
        Capsule(trunk, plus(trunk, ahead, -420.0 * scale), 95.0 * scale, 115.0 * scale),
    ]
    hair = Sphere(plus(plus(at_mm, ahead, -14.0 * scale), UP, 14.0 * scale), 84.0 * scale)
    return Hand(tuple(bust), (), dark=(hair,)) if dark_hair else Hand((*bust, hair), ())


def leg(at_mm: Place, floor_mm: float, top_mm: float, scale: float) -> Hand:
    """Return a leg that stands beside the table: foot, shank and thigh, up to a height over (or under) the table."""
    x_mm, y_mm = at_mm
    knee: Point = (x_mm, y_mm, floor_mm + 480.0 * scale)
    ankle: Point = (x_mm, y_mm, floor_mm + 70.0 * scale)
    toes: Point = (x_mm + 20.0, y_mm - 150.0 * scale, floor_mm + 35.0)
    solids = [Capsule(ankle, toes, 45.0 * scale, 35.0 * scale), Capsule(ankle, knee, 45.0 * scale, 62.0 * scale)]
    if top_mm > knee[2]:
        solids.append(Capsule(knee, (x_mm, y_mm, top_mm), 68.0 * scale, 88.0 * scale))
    return Hand(tuple(solids), ())


def _elbow(wrist: Point, shoulder: Point, fore: float, upper: float, outwards: Point) -> Point:
    """Return where the elbow of an arm is: beside the line from wrist to shoulder, below it, and off the table."""
    way = minus(shoulder, wrist)
    distance = min(length(way), 0.999 * (fore + upper))
    along = (fore * fore - upper * upper + distance * distance) / (2.0 * distance)
    off = sqrt(max(fore * fore - along * along, 0.0))
    direction = unit(way)
    bulge = square_to(plus(times(outwards, 0.8), UP, -0.8), direction)
    x_mm, y_mm, z_mm = plus(plus(wrist, direction, along), bulge, off)
    return (x_mm, y_mm, max(z_mm, _ELBOW_CLEAR_MM))
