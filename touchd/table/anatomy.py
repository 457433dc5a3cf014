"""Hands with bones: where the joints of five fingers are, given where the palm is and what the fingers do.

Fingers are numbered 0 thumb, 1 index, 2 middle, 3 ring, 4 little. Palm coordinates are (forward, right, up) in mm
from the wrist's middle, as in a right hand with its palm down; a left hand is its mirror image. Lengths are those of
an adult's hand of 189 mm, to be scaled; a finger's last bone ends at the centre of the fingertip's ball.
"""

from cmath import exp, phase
from dataclasses import dataclass
from math import cos, radians, sin

from touchd.table.scene import Capsule, Point
from touchd.table.vectors import length as length_of
from touchd.table.vectors import minus, plus, square_to, times, turned, unit

THUMB, INDEX, MIDDLE, RING, LITTLE = range(5)
# Where the first joint of each finger sits in the palm, and the lengths of its three bones.
KNUCKLES_MM: tuple[Point, ...] = (
    (22.0, -26.0, -9.0),
    (88.0, -24.0, 4.0),
    (92.0, -3.0, 6.0),
    (86.0, 17.0, 3.0),
    (76.0, 34.0, -3.0),
)
_BONES_MM = ((43.0, 33.0, 22.0), (43.0, 25.0, 19.0), (47.0, 29.0, 19.0), (44.0, 27.0, 19.0), (35.0, 20.0, 17.0))
_TIP_SHARES = (1.12, 1.0, 1.03, 0.98, 0.87)  # of the index finger's thickness
_KNUCKLE_RADII_MM = (14.0, 10.8, 11.2, 10.6, 9.4)
_HEEL_MM: Point = (14.0, 27.0, -10.0)
_HEEL_RADIUS_MM = 14.0
_WRIST_RADIUS_MM = 15.0
_WRISTS_MM = ((4.0, -13.0, 0.0), (2.0, -4.0, 2.0), (2.0, 7.0, 1.0), (4.0, 16.0, -2.0))
_LARGEST_BEND = 1.9  # radians, of a middle joint
_ROUNDS = 24


@dataclass(frozen=True, slots=True)
class Build:
    """Someone's hand.

    ``tip_mm`` is how thick the index fingertip is, ``breadth`` how much broader than thick fingertips are, ``taper``
    the last joint's thickness over the tip's, ``follow`` how far the last joint bends with the middle one: below 0
    where pressing bends it back.
    """

    scale: float = 1.0
    tip_mm: float = 13.0
    breadth: float = 1.15
    taper: float = 1.15
    follow: float = 0.2
    left: bool = False

    def tip_radius_mm(self, finger: int) -> float:
        """Return the radius of a fingertip's ball."""
        return 0.5 * self.tip_mm * _TIP_SHARES[finger]

    def bones_mm(self, finger: int) -> tuple[float, float, float]:
        """Return the lengths of a finger's bones from the palm to the tip."""
        first, second, third = _BONES_MM[finger]
        return (first * self.scale, second * self.scale, third * self.scale)

    def radii_mm(self, finger: int) -> tuple[float, float, float, float]:
        """Return the radii at a finger's joints from the palm to the tip."""
        tip = self.tip_radius_mm(finger)
        last = tip * self.taper
        knuckle = max(_KNUCKLE_RADII_MM[finger] * self.scale, 1.05 * last)
        return (knuckle, 0.5 * (knuckle + last), last, tip)


@dataclass(frozen=True, slots=True)
class Palm:
    """Where a palm is: its wrist and its own forward, right and up in table coordinates (unit vectors)."""

    wrist_mm: Point
    forward: Point
    right: Point
    up: Point

    def turn(self, offset: Point) -> Point:
        """Return a palm's (forward, right, up) as a vector in table coordinates."""
        return plus(plus(times(self.forward, offset[0]), self.right, offset[1]), self.up, offset[2])

    def at(self, place_mm: Point, scale: float) -> Point:
        """Return a place of the palm in table coordinates."""
        return plus(self.wrist_mm, self.turn(place_mm), scale)

    def moved(self, by_mm: Point) -> "Palm":
        """Return the palm elsewhere."""
        return Palm(plus(self.wrist_mm, by_mm), self.forward, self.right, self.up)


def palm_facing(heading_deg: float, pitch_deg: float, roll_deg: float, left: bool) -> Palm:
    """Return a palm at the origin.

    ``pitch_deg`` raises the wrist over the knuckles; ``roll_deg`` raises the thumb's side over the little finger's.
    """
    pitch, roll = radians(pitch_deg), radians(roll_deg)
    level, side = turned((1.0, 0.0), heading_deg), turned((0.0, -1.0 if left else 1.0), heading_deg)
    forward: Point = (level[0] * cos(pitch), level[1] * cos(pitch), -sin(pitch))
    up: Point = (level[0] * sin(pitch), level[1] * sin(pitch), cos(pitch))
    right: Point = (side[0], side[1], 0.0)
    rolled = plus(times(right, cos(roll)), up, -sin(roll))
    return Palm((0.0, 0.0, 0.0), forward, rolled, plus(times(up, cos(roll)), right, sin(roll)))


def reaching(base: Point, tip: Point, bones: tuple[float, float, float], bulge: Point, follow: float) -> list[Point]:
    """Return a finger's joints from its knuckle to a tip that is given.

    The finger bends in the plane of its two ends and ``bulge``, towards which its joints stand out. The middle joint's
    bend follows from the distance (found by halving), the last one's is its ``follow``th part. Where the tip is out of
    reach the bones grow or shrink, so that the tip is always where it is said to be.
    """
    way = minus(tip, base)
    distance = length_of(way)
    low, high = 0.0, _LARGEST_BEND
    for _ in range(_ROUNDS):
        bend = 0.5 * (low + high)
        if abs(_chain(bones, bend, follow)[-1]) > distance:
            low = bend
        else:
            high = bend
    chain = _chain(bones, high, follow)
    stretch = distance / abs(chain[-1])
    straighten = exp(-1j * phase(chain[-1])) * stretch
    along = unit(way)
    out = square_to(bulge, along)
    inner = [plus(plus(base, along, (z * straighten).real), out, (z * straighten).imag) for z in chain[:-1]]
    return [base, *inner, tip]


def bent(
    base: Point, palm: Palm, bones: tuple[float, float, float], bends_deg: tuple[float, float, float], spread_deg: float
) -> list[Point]:
    """Return a finger's joints from the bends of its joints; ``spread_deg`` turns it to the right in the palm."""
    side = radians(spread_deg)
    ahead = plus(times(palm.forward, cos(side)), palm.right, sin(side))
    joints, bend = [base], 0.0
    for bone, more_deg in zip(bones, bends_deg, strict=True):
        bend += radians(more_deg)
        step = plus(times(ahead, cos(bend)), palm.up, -sin(bend))
        joints.append(plus(joints[-1], step, bone))
    return joints


def finger_solids(joints: list[Point], radii: tuple[float, ...], breadth: float) -> list[Capsule]:
    """Return a finger's capsules; the last bone is twofold, which makes the fingertip broader than thick."""
    (base, middle, last, tip), (r0, r1, r2, r3) = joints, radii
    bone = unit(minus(tip, last))
    flat = square_to((0.0, 0.0, 1.0), bone)
    sideways = (
        bone[1] * flat[2] - bone[2] * flat[1],
        bone[2] * flat[0] - bone[0] * flat[2],
        bone[0] * flat[1] - bone[1] * flat[0],
    )
    off = r3 * (breadth - 1.0)
    halves = [Capsule(plus(last, sideways, s), plus(tip, sideways, s), r2 - off, r3) for s in (-off, off)]
    return [Capsule(base, middle, r0, r1), Capsule(middle, last, r1, r2), *halves]


def palm_solids(palm: Palm, build: Build, thumb_joint: Point) -> list[Capsule]:
    """Return the capsules of a palm: four bones, the thumb's ball and the heel."""
    scale = build.scale
    wrist = _WRIST_RADIUS_MM * scale
    solids = []
    for finger, start in zip((INDEX, MIDDLE, RING, LITTLE), _WRISTS_MM, strict=True):
        ends = palm.at(start, scale), palm.at(KNUCKLES_MM[finger], scale)
        solids.append(Capsule(*ends, wrist, _KNUCKLE_RADII_MM[finger] * scale))
    root = palm.at(KNUCKLES_MM[THUMB], scale)
    solids.append(Capsule(root, palm.at((58.0, -12.0, -3.0), scale), 14.0 * scale, 11.0 * scale))
    solids.append(Capsule(root, thumb_joint, 14.0 * scale, 12.0 * scale))
    heel = palm.at(_HEEL_MM, scale), palm.at((68.0, 33.0, -8.0), scale)
    solids.append(Capsule(*heel, _HEEL_RADIUS_MM * scale, 11.0 * scale))
    return solids


def lowest_of_palm_mm(palm: Palm, build: Build) -> float:
    """Return how high the lowest part of a palm's heel and edge lies."""
    heel = palm.at(_HEEL_MM, build.scale)[2] - _HEEL_RADIUS_MM * build.scale
    edge = palm.at((68.0, 33.0, -8.0), build.scale)[2] - 11.0 * build.scale
    return min(heel, edge)


def _chain(bones: tuple[float, float, float], bend: float, follow: float) -> list[complex]:
    """Return where the joints after the first lie in the finger's plane, the first bone along the real axis."""
    first = complex(bones[0])
    second = first + bones[1] * exp(-1j * bend)
    return [first, second, second + bones[2] * exp(-1j * bend * (1.0 + follow))]
