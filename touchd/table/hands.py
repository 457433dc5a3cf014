"""Posed hands as capsules: pointing with the index finger, pinching with it and the thumb, or all five tips down.

Lengths are those of an adult's hand (breadth about 85 mm, index finger 92 mm from knuckle to tip), to be
scaled; a pressed fingertip is 13 mm thick. Joints are given as (forward, right, up) in mm from the touch
point, forward being where the fingers point, right as in a right hand with its palm down; a left hand is its
mirror image.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, radians, sin

from touchd.table.scene import Capsule, Fingertip, Hand, Place, Point

TIP_RADIUS_MM = 6.5
_ABOVE_TABLE_MM = 14.0  # what does not mean to touch stays this far above, so that the truth is plain
_INDEX_BONES_MM = (24.0, 25.0, 43.0)  # from the tip to the knuckle
_INDEX_RADII_MM = (TIP_RADIUS_MM, 7.2, 8.5, 10.0)
_INDEX_BEND_DEG = (8.0, 0.0, -8.0)  # of each bone against the finger's pitch: a pressing finger arches
_FLATTEST_DEG = 8.0
_KNUCKLES_MM = (
    (4.0, 20.0, 1.0),
    (0.0, 38.0, -3.0),
    (-10.0, 54.0, -8.0),
)  # middle, ring, little from the index's
_PALM_MM = 76.0
_ELBOW_MM = (-255.0, 18.0, 95.0)  # from the wrist
_SHOULDER_MM = (-900.0, 60.0, 230.0)


@dataclass(frozen=True, slots=True)
class HandPose:
    """Where a hand is and how it is held.

    ``at_mm`` is the touch point: of the index finger, of the middle finger when all five are down, or the middle
    between index finger and thumb when they pinch. ``heading_deg`` says where the fingers point: 0 up the picture,
    90 to the right. ``pitch_deg`` is a pointing finger's angle to the table, ``spread_mm`` the distance between
    the tips of a pinching hand.
    """

    at_mm: Place
    clearance_mm: float = 0.0
    heading_deg: float = 0.0
    pitch_deg: float = 35.0
    scale: float = 1.0
    left: bool = False
    spread_mm: float = 60.0

    def place(self, joint_mm: Point) -> Point:
        """Return a joint (forward, right, up) from the touch point in table coordinates."""
        heading = radians(self.heading_deg)
        forward = joint_mm[0] * self.scale
        right = joint_mm[1] * self.scale * (-1.0 if self.left else 1.0)
        return (
            self.at_mm[0] + forward * sin(heading) + right * cos(heading),
            self.at_mm[1] - forward * cos(heading) + right * sin(heading),
            joint_mm[2] * self.scale + self.clearance_mm,
        )

    def limb(self, joints_mm: Sequence[Point], radii_mm: Sequence[float]) -> list[Capsule]:
        """Return the capsules between successive joints, each with its radius."""
        points = [self.place(joint) for joint in joints_mm]
        radii = [radius * self.scale for radius in radii_mm]
        spans = zip(pairwise(points), pairwise(radii), strict=True)
        return [Capsule(*ends, *sizes) for ends, sizes in spans]


def pointing_hand(pose: HandPose) -> Hand:
    """Return a hand whose index finger points at the table, the others curled, with a long arm."""
    index = _index_joints(pose.pitch_deg)
    knuckle = index[-1]
    rise = radians(max(pose.pitch_deg - 22.0, _FLATTEST_DEG))
    back, up = -_PALM_MM * cos(rise), _PALM_MM * sin(rise)
    wrists = [_add(knuckle, (back, right, up)) for right in (12.0, 26.0, 40.0)]
    knuckles = [_above(_add(knuckle, offset), 11.0) for offset in _KNUCKLES_MM]
    solids = pose.limb(index, _INDEX_RADII_MM)
    for start, end in zip(wrists, (knuckle, _add(knuckle, (2.0, 29.0, -1.0)), knuckles[2]), strict=True):
        solids += pose.limb((start, end), (15.0, 11.0))
    solids += [bone for joint in knuckles for bone in _curled(pose, joint)]
    thumb = [_above(_add(knuckle, offset), 13.0) for offset in ((-62.0, 2.0, -6.0), (-30.0, -17.0, -14.0))]
    thumb.append(_above(_add(knuckle, (2.0, -9.0, -20.0)), 8.0))
    solids += pose.limb(thumb, (13.0, 10.5, 8.0))
    solids += _arm(pose, wrists[1])
    return Hand(tuple(solids), (Fingertip(pose.at_mm, pose.clearance_mm),))


# Tip, middle joint and knuckle of the thumb, index, middle, ring and little finger.
_OPEN_MM = (
    ((-70.0, -60.0), (-96.0, -48.0, 34.0), (-128.0, -20.0, 46.0)),
    ((-8.0, -28.0), (-44.0, -27.0, 46.0), (-80.0, -22.0, 56.0)),
    ((0.0, 0.0), (-40.0, -1.0, 48.0), (-82.0, -2.0, 58.0)),
    ((-8.0, 27.0), (-46.0, 23.0, 46.0), (-84.0, 18.0, 55.0)),
    ((-28.0, 50.0), (-58.0, 43.0, 40.0), (-86.0, 36.0, 50.0)),
)
_OPEN_WRIST_MM = (-156.0, 8.0, 58.0)


def open_hand(pose: HandPose) -> Hand:
    """Return a hand with all five fingertips down; the pose's pitch plays no part."""
    solids: list[Capsule] = []
    tips: list[Fingertip] = []
    for tip, middle, knuckle in _OPEN_MM:
        ball = (*tip, TIP_RADIUS_MM)
        solids += pose.limb((ball, middle, knuckle), (TIP_RADIUS_MM, 8.0, 10.0))
        solids += pose.limb((knuckle, _OPEN_WRIST_MM), (11.0, 16.0))
        x_mm, y_mm, _ = pose.place(ball)
        tips.append(Fingertip((x_mm, y_mm), pose.clearance_mm))
    solids += _arm(pose, _OPEN_WRIST_MM)
    return Hand(tuple(solids), tuple(tips))


_PINCH_WAY = (0.88, 0.475)  # where the index finger's tip lies from the thumb's, forward and right
_PINCH_KNUCKLES_MM = ((-41.0, 22.0, 56.0), (-44.0, 42.0, 58.0), (-48.0, 62.0, 55.0), (-56.0, 79.0, 50.0))
_PINCH_FOLLOWS = 0.35  # the share of the index finger's way that its knuckle goes along
_PINCH_THUMB_MM = (-92.0, 24.0, 46.0)
_PINCH_WRIST_MM = (-120.0, 52.0, 58.0)
_PINCH_REST_MM = 60.0  # the spread at which the index finger's knuckle is where it says


def pinching_hand(pose: HandPose) -> Hand:
    """Return a hand with index finger and thumb down, the others curled; the pose's pitch plays no part."""
    forward, right = (0.5 * pose.spread_mm * way for way in _PINCH_WAY)
    more = 0.5 * (pose.spread_mm - _PINCH_REST_MM) * _PINCH_FOLLOWS
    index = (forward, right, TIP_RADIUS_MM)
    thumb = (-forward, -right, TIP_RADIUS_MM)
    first, *others = _PINCH_KNUCKLES_MM
    knuckle = _add(first, (more * _PINCH_WAY[0], more * _PINCH_WAY[1], 0.0))
    solids = pose.limb((index, _arched(index, knuckle, 47.0), knuckle), (TIP_RADIUS_MM, 8.0, 10.0))
    solids += pose.limb((thumb, _arched(thumb, _PINCH_THUMB_MM, 33.0), _PINCH_THUMB_MM), (TIP_RADIUS_MM, 9.5, 12.0))
    solids += pose.limb((_PINCH_THUMB_MM, _PINCH_WRIST_MM), (13.0, 16.0))
    for joint in (knuckle, *others):
        solids += pose.limb((joint, _PINCH_WRIST_MM), (11.0, 16.0))
    solids += [bone for joint in others for bone in _curled(pose, joint)]
    solids += _arm(pose, _PINCH_WRIST_MM)
    tips = [pose.place(tip) for tip in (index, thumb)]
    return Hand(tuple(solids), tuple(Fingertip((x_mm, y_mm), pose.clearance_mm) for x_mm, y_mm, _ in tips))


def _arched(tip: Point, base: Point, height_mm: float) -> Point:
    """Return a finger's middle joint, at a height over the table."""
    return (0.5 * (tip[0] + base[0]), 0.5 * (tip[1] + base[1]), height_mm)


def _curled(pose: HandPose, knuckle: Point) -> list[Capsule]:
    """Return a finger that is bent back under its knuckle."""
    bent = _above(_add(knuckle, (21.0, 0.0, -26.0)), 8.5)
    return pose.limb((knuckle, bent, _above(_add(bent, (-26.0, -1.0, -10.0)), 7.0)), (10.0, 8.5, 7.0))


def _index_joints(pitch_deg: float) -> list[Point]:
    joint: Point = (0.0, 0.0, TIP_RADIUS_MM)
    joints = [joint]
    for bone, bend in zip(_INDEX_BONES_MM, _INDEX_BEND_DEG, strict=True):
        rise = radians(max(pitch_deg + bend, _FLATTEST_DEG))
        joint = _add(joint, (-bone * cos(rise), 0.0, bone * sin(rise)))
        joints.append(joint)
    return joints


def _arm(pose: HandPose, wrist: Point) -> list[Capsule]:
    return pose.limb((wrist, _add(wrist, _ELBOW_MM), _add(wrist, _SHOULDER_MM)), (22.0, 38.0, 50.0))


def _add(joint: Point, offset: Point) -> Point:
    return (joint[0] + offset[0], joint[1] + offset[1], joint[2] + offset[2])


def _above(joint: Point, radius_mm: float) -> Point:
    return (joint[0], joint[1], max(joint[2], radius_mm + _ABOVE_TABLE_MM))
