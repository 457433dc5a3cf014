"""Hands put together from where their fingertips are: any fingers down, of any build, bowed as the way to them wants.

They know less of anatomy than ``anatomy`` and ``postures`` and so hold for more hands: breadth, length of the fingers
and height of the palm go each their own way, and what does not point is curled, level or stretched out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from math import cos, radians, sin, sqrt, tan

import numpy as np

from touchd.geometry import Doubles
from touchd.table.scene import Capsule, Fingertip, Hand, Place, Point

THUMB, INDEX, MIDDLE, RING, LITTLE = range(5)
# From the palm's middle to the knuckles, forward and towards the thumb; the fingers' halves, from the knuckle on; and
# their radii at the tip. All in mm of an adult's hand.
_KNUCKLES_MM = ((10.0, 34.0), (42.0, 27.0), (46.0, 8.0), (42.0, -11.0), (32.0, -28.0))
_HALVES_MM = ((28.0, 30.0), (42.0, 46.0), (46.0, 50.0), (42.0, 48.0), (33.0, 38.0))
_RADII_MM = (8.6, 7.2, 7.4, 7.0, 6.2)
_THUMB_BELOW_MM = 6.0
_PALM_SIDES_MM, _PALM_ENDS_MM = (-22.0, -8.0, 8.0, 22.0), (34.0, -42.0)
_WRIST_MM = -62.0
_UPPER_ARM_DEG = 28.0
_KEEPS_OFF_MM = 12.0  # above the surface, what does not mean to touch


class Idle(Enum):
    """How fingers are held that do not point."""

    CURLED = "curled"
    LEVEL = "level"
    STRETCHED = "stretched"


@dataclass(frozen=True, slots=True)
class Build:
    """What a hand is like, and how it is held while it works.

    ``scale`` of all of it, ``breadth`` of the fingers besides. ``palm_mm``: how high the middle of the palm is over
    the fingertips. ``reach``: how far the knuckles are behind the fingertips, over the fingers' length. ``bow_mm``: how
    far the last joint stands out. The forearm turns by ``elbow_deg`` sideways and rises by ``rise_deg``.
    """

    scale: float
    breadth: float
    left: bool
    palm_mm: float
    reach: float
    bow_mm: float
    palm_deg: float
    idle: Idle
    elbow_deg: float
    rise_deg: float


def fingertip_ways(build: Build, fingers: tuple[int, ...], spread: float) -> dict[int, Place]:
    """Return where these fingers' tips are, forward and to the right of their middle, when the hand is at ease."""
    places = {finger: _at_ease(build, finger) for finger in fingers}
    ahead, middle = np.mean(list(places.values()), axis=0).tolist()
    side = _thumb_side(build) * spread
    return {finger: (forward - ahead, side * (inward - middle)) for finger, (forward, inward) in places.items()}


def mannequin(build: Build, tips_mm: Mapping[int, Place], clearance_mm: float, heading_deg: float) -> Hand:
    """Return the hand whose fingertips are there, with its arm; ``heading_deg`` as in ``HandPose``."""
    frame = _Frame.towards(heading_deg, build)
    x, y = np.mean(list(tips_mm.values()), axis=0).tolist()
    forward, inward = np.mean([_at_ease(build, finger) for finger in tips_mm], axis=0).tolist()
    palm = frame.point((x, y, 0.0), -forward, -inward, build.scale * build.palm_mm + clearance_mm)
    solids = [*_palm(frame, palm)]
    tips = []
    for finger in range(5):
        ahead, aside = _KNUCKLES_MM[finger]
        below = _THUMB_BELOW_MM if finger == THUMB else 0.0
        root = frame.point(palm, build.scale * ahead, build.scale * aside, -build.scale * below)
        if finger in tips_mm:
            solids += _reaching(frame, finger, root, tips_mm[finger], clearance_mm)
            tips.append(Fingertip(tips_mm[finger], clearance_mm))
        else:
            solids += _idle(frame, finger, root)
    return Hand((*solids, *_arm(frame, palm)), tuple(tips))


def _at_ease(build: Build, finger: int) -> Place:
    """Return where a fingertip is, forward and towards the thumb's side of the palm's middle."""
    forward, inward = _KNUCKLES_MM[finger]
    length = build.reach * sum(_HALVES_MM[finger])
    # A thumb points half sideways.
    ahead, aside = (0.55 * length, 0.75 * length) if finger == THUMB else (length, 0.0)
    return build.scale * (forward + ahead), build.scale * (inward + aside)


def _thumb_side(build: Build) -> float:
    """Return 1 where the thumb is to the right of the palm, -1 where it is to the left."""
    return 1.0 if build.left else -1.0


@dataclass(frozen=True, slots=True)
class _Frame:
    """A build, and which way it points: forward, and towards its thumb."""

    build: Build
    forward: tuple[float, float]
    inward: tuple[float, float]

    @classmethod
    def towards(cls, heading_deg: float, build: Build) -> "_Frame":
        c, s = cos(radians(heading_deg)), sin(radians(heading_deg))
        side = _thumb_side(build)
        return cls(build, (s, -c), (side * c, side * s))

    def point(self, base: Point, forward: float, inward: float, up: float) -> Point:
        return (
            base[0] + forward * self.forward[0] + inward * self.inward[0],
            base[1] + forward * self.forward[1] + inward * self.inward[1],
            base[2] + up,
        )

    def limb(self, a: Point, b: Point, radius_a: float, radius_b: float) -> Capsule:
        return Capsule(a, b, self.build.scale * radius_a, self.build.scale * radius_b)


def _palm(frame: _Frame, palm: Point) -> Iterator[Capsule]:
    front, back = (frame.build.scale * mm for mm in _PALM_ENDS_MM)
    slope = tan(radians(frame.build.palm_deg))
    for side in _PALM_SIDES_MM:
        inward = frame.build.scale * side
        knuckle = frame.point(palm, front, inward, 0.0)
        yield frame.limb(knuckle, frame.point(palm, back, 0.7 * inward, (front - back) * slope), 11.5, 13.0)


def _reaching(frame: _Frame, finger: int, root: Point, tip_mm: Place, clearance_mm: float) -> list[Capsule]:
    """Return a finger from its knuckle to where its tip is, bowed upwards as far as it is longer than the way."""
    build = frame.build
    radius = _RADII_MM[finger] * build.breadth
    tip = np.array((*tip_mm, clearance_mm + radius * build.scale))
    first, last = (build.scale * half for half in _HALVES_MM[finger])
    middle = _bowed(np.array(root), tip, first, last)
    joint = tip + 0.55 * (middle - tip) + np.array((0.0, 0.0, build.bow_mm * build.scale))
    chain = [_as_point(tip), _as_point(joint), _as_point(middle), root]
    radii = [radius * more for more in (1.0, 1.08, 1.16, 1.3)]
    return [frame.limb(chain[i], chain[i + 1], radii[i], radii[i + 1]) for i in range(3)]


def _bowed(root: Doubles, tip: Doubles, first: float, last: float) -> Doubles:
    """Return where the middle joint is of a finger with halves of these lengths, bent upwards."""
    way = tip - root
    far = float(np.linalg.norm(way))
    if far >= first + last:
        straight: Doubles = root + way * (first / (first + last))
        return straight
    along = (first**2 - last**2 + far**2) / (2.0 * far)
    up = np.array((0.0, 0.0, 1.0)) - way * (way[2] / far**2)
    bent: Doubles = root + way * (along / far) + up * (sqrt(max(first**2 - along**2, 0.0)) / float(np.linalg.norm(up)))
    return bent


def _idle(frame: _Frame, finger: int, root: Point) -> list[Capsule]:
    build = frame.build
    scale, radius = build.scale, _RADII_MM[finger] * build.breadth
    if finger == THUMB:
        return [frame.limb(root, _off(frame, root, 28.0, 6.0, -8.0, radius), 1.2 * radius, radius)]
    if build.idle is Idle.STRETCHED:
        first, last = _HALVES_MM[finger]
        middle = _off(frame, root, first, 0.0, 4.0, radius)
        end = _off(frame, middle, 0.9 * last, 0.0, -4.0, radius)
        return [frame.limb(root, middle, 1.3 * radius, 1.15 * radius), frame.limb(middle, end, 1.15 * radius, radius)]
    down = -6.0 if build.idle is Idle.LEVEL else -20.0
    middle = _off(frame, root, 28.0, 0.0, down, radius)
    end = _off(frame, middle, -18.0 / scale, 0.0, -14.0, radius)
    return [frame.limb(root, middle, 1.3 * radius, 1.2 * radius), frame.limb(middle, end, 1.2 * radius, radius)]


def _off(frame: _Frame, joint: Point, forward: float, inward: float, up: float, radius: float) -> Point:
    """Return a joint that far from another, scaled, but never so low that it might be taken for touching."""
    scale = frame.build.scale
    x, y, z = frame.point(joint, scale * forward, scale * inward, scale * up)
    return x, y, max(z, radius * scale + _KEEPS_OFF_MM)


def _arm(frame: _Frame, palm: Point) -> Iterator[Capsule]:
    build = frame.build
    elbow, rise, upper = (radians(deg) for deg in (build.elbow_deg, build.rise_deg, _UPPER_ARM_DEG))
    front, back, end = (build.scale * mm for mm in (*_PALM_ENDS_MM, _WRIST_MM))
    slope = tan(radians(build.palm_deg))
    wrist = frame.point(palm, end, 0.0, (front - end) * slope + 5.0)
    yield frame.limb(frame.point(palm, 0.5 * back, 0.0, (front - 0.5 * back) * slope), wrist, 19.0, 21.0)
    place, radius = wrist, 23.0
    for length, angle, thick in ((250.0, rise, 38.0), (300.0, upper, 48.0), (800.0, upper, 90.0)):
        mm = build.scale * length
        away = mm * cos(angle)
        further = frame.point(place, -away * cos(elbow), away * sin(elbow), mm * sin(angle))
        yield frame.limb(place, further, radius, thick)
        place, radius = further, thick


def _as_point(place: Doubles) -> Point:
    x, y, z = place.tolist()
    return x, y, z
