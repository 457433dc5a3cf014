"""Visitors: fingers that tap, hold, drag and hover for as long as people do, in plain sight.

What is believed of a fingertip follows from all that it did before. The hands of ``variety`` are there for a moment
each, and those of the lab's scenes seldom come down as if to touch and then hover low.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from math import ceil, cos, hypot, radians, sin
from typing import TypeAlias

import numpy as np

from touchd.lab.learn.variety import Shown, World, shown_world, some_camera, true_tips
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.mannequin import INDEX, LITTLE, MIDDLE, RING, THUMB, Build, Idle, fingertip_ways, mannequin
from touchd.table.scene import Area, Hand, Place, TableCamera
from touchd.table.sensor_kinect import KinectModel

_TASKS = 4
_HEIGHTS_MM = (750.0, 1000.0, 1250.0, 1500.0, 1500.0, 1500.0, 1800.0)
_TASK_NAMES = ("tap", "tap", "quick", "hold", "drag", "hover", "hover", "hover")
_DOWN, _UP = ((0.6, 0.15), (0.4,), (0.7, 0.4, 0.1)), ((0.2, 0.7), (0.5,), (0.1, 0.3, 0.7))
_HEADINGS_DEG = (0.0, 0.0, 0.0, 90.0, 180.0, -90.0)
_TILTS_DEG, _BEHIND_DEG = (-20.0, 20.0), (-6.0, 20.0)  # the latter: of cameras most of which are behind people
_REFERENCE_MM = 750.0
_TIP_MM, _STRAIGHT_MM = 7.0, 86.0  # a fingertip's radius, and how far the knuckle of a straight finger is from it
_EMPTY = 6  # frames between two visits

_Shape: TypeAlias = Callable[[Place, float], Hand]  # of where a fingertip is and how high


class Fingers(StrEnum):
    """What the visitors of a world point with, by the names of its lessons."""

    PLAIN = "visitors-plain"
    STRAIGHT = "visitors-straight"
    BENT = "visitors-bent"
    SEVERAL = "visitors-several"
    VARIED = "visitors-varied"  # each of them with one of these, and under cameras of all kinds


# Mannequins' fingers: how steep, and how far the knuckle is behind the tip, over how far it is in a straight finger.
_PITCHES_DEG = {Fingers.STRAIGHT: (20.0, 56.0), Fingers.BENT: (30.0, 75.0), Fingers.SEVERAL: (18.0, 60.0)}
_REACHES = {Fingers.STRAIGHT: (0.94, 0.99), Fingers.BENT: (0.72, 0.95), Fingers.SEVERAL: (0.75, 0.98)}
_ALL = (THUMB, INDEX, MIDDLE, RING, LITTLE)
_TOGETHER = ((INDEX, MIDDLE), (INDEX, MIDDLE), (INDEX, MIDDLE, RING), (THUMB, INDEX), (THUMB, INDEX), _ALL, _ALL)
_ONE_OF = tuple(fingers for fingers in Fingers if fingers is not Fingers.VARIED)
_FLAT_SHARE, _FLAT_MM = 0.5, (16.0, 24.0)  # of whole hands that lie flat, and how high the middle of the palm is then
_STREAMS = {
    Fingers.PLAIN: 2,
    Fingers.STRAIGHT: 3,
    Fingers.BENT: 4,
    Fingers.SEVERAL: 5,
    Fingers.VARIED: 6,
}  # of random numbers, so that seeds differ in all


@dataclass(frozen=True, slots=True)
class _Moment:
    """Where a fingertip is, and which of its hand's touches it belongs to; 0: none."""

    at_mm: Place
    clearance_mm: float
    touch: int


def visitors(seed: int, fingers: Fingers, visits: int = 7) -> World:
    """Return a world that people come to so many times; all of it follows from the seed."""
    rng = np.random.default_rng([seed, _STREAMS[fingers]])
    camera, sensor, area = some_camera(rng) if fingers is Fingers.VARIED else _usual_camera(rng, fingers)
    grown = max(1.0, camera.height_mm / _REFERENCE_MM)
    shown = [moment for number in range(visits) for moment in _visit(rng, area, grown, number, fingers)]
    return shown_world(seed, camera, sensor, area, shown)


def _usual_camera(rng: np.random.Generator, fingers: Fingers) -> tuple[TableCamera, KinectModel, Area]:
    height_mm = float(rng.choice(_HEIGHTS_MM))
    tilts_deg = _TILTS_DEG if fingers is Fingers.PLAIN else _BEHIND_DEG
    camera = TableCamera(height_mm, float(rng.uniform(*tilts_deg)), float(rng.uniform(-8.0, 8.0)))
    return camera, KinectModel(), Area((0.0, 0.0), (0.72 * height_mm, 0.5 * height_mm))


def _visit(rng: np.random.Generator, area: Area, grown: float, number: int, fingers: Fingers) -> Iterator[Shown]:
    """Yield what a visit shows in each frame; nobody is there for a while after it."""
    if fingers is Fingers.VARIED:
        fingers = _ONE_OF[int(rng.integers(len(_ONE_OF)))]
    heading_deg = float(rng.choice(_HEADINGS_DEG)) + float(rng.uniform(-35.0, 35.0))
    shape = _plain(rng, heading_deg) if fingers is Fingers.PLAIN else _mannequin(rng, heading_deg, fingers)
    for moment in _moments(rng, area, grown):
        hand = shape(moment.at_mm, moment.clearance_mm)
        yield [hand], true_tips(hand, 100 * (number + 1) + moment.touch, area)
    yield from ([([], ())] * _EMPTY)


def _plain(rng: np.random.Generator, heading_deg: float) -> _Shape:
    pose = HandPose(
        (0.0, 0.0),
        heading_deg=heading_deg,
        pitch_deg=float(rng.uniform(20.0, 58.0)),
        scale=float(rng.uniform(0.75, 1.25)),
        left=bool(rng.random() < 0.5),
    )
    return lambda at_mm, clearance_mm: pointing_hand(replace(pose, at_mm=at_mm, clearance_mm=clearance_mm))


def _mannequin(rng: np.random.Generator, heading_deg: float, fingers: Fingers) -> _Shape:
    pitches_deg, reaches = _PITCHES_DEG[fingers], _REACHES[fingers]
    pitch = radians(float(rng.uniform(*pitches_deg)))
    build = Build(
        scale=float(rng.uniform(0.75, 1.2)),
        breadth=float(rng.uniform(0.85, 1.2)),
        left=bool(rng.random() < 0.5),
        palm_mm=_TIP_MM + _STRAIGHT_MM * sin(pitch),
        reach=float(rng.uniform(*reaches)) * cos(pitch),
        bow_mm=float(rng.uniform(-1.0, 3.0)),
        palm_deg=float(rng.uniform(-3.0, 22.0)),
        idle=list(Idle)[int(rng.choice([0, 0, 1, 1, 2]))],
        elbow_deg=float(rng.uniform(-20.0, 20.0)),
        rise_deg=float(rng.uniform(5.0, 25.0)),
    )
    if fingers is not Fingers.SEVERAL:
        return lambda at_mm, clearance_mm: mannequin(build, {INDEX: at_mm}, clearance_mm, heading_deg)
    return _several(rng, build, heading_deg)


def _several(rng: np.random.Generator, build: Build, heading_deg: float) -> _Shape:
    """Return hands of which some or all fingers do the same together, around the middle of their tips."""
    which = _TOGETHER[int(rng.integers(len(_TOGETHER)))]
    if which == _ALL and rng.random() < _FLAT_SHARE:
        build = replace(build, palm_mm=float(rng.uniform(*_FLAT_MM)), reach=0.98, palm_deg=0.0)
    ways = fingertip_ways(build, which, float(rng.uniform(0.95, 1.4)))

    def hand(at_mm: Place, clearance_mm: float) -> Hand:
        tips_mm = {finger: _turned(at_mm, way, heading_deg) for finger, way in ways.items()}
        return mannequin(build, tips_mm, clearance_mm, heading_deg)

    return hand


def _turned(at_mm: Place, way: Place, heading_deg: float) -> Place:
    """Return the place that lies so far forward and to the right of another."""
    c, s = cos(radians(heading_deg)), sin(radians(heading_deg))
    return at_mm[0] + way[0] * s + way[1] * c, at_mm[1] - way[0] * c + way[1] * s


def _moments(rng: np.random.Generator, area: Area, grown: float) -> Iterator[_Moment]:
    """Yield what a hand does, frame by frame: one task after the other, each somewhere else."""
    touch, place = 0, _anywhere(rng, area)
    before = (place[0] + float(rng.normal(0.0, 60.0)), place[1] + float(rng.normal(0.0, 60.0)))
    for _ in range(_TASKS):
        task = _TASK_NAMES[int(rng.integers(len(_TASK_NAMES)))]
        high_mm = grown * float(rng.uniform(18.0, 40.0))
        for at in _way(before, place, float(rng.uniform(8.0, 28.0))):
            yield _Moment(at, high_mm, 0)
        before = place
        if task == "hover":
            for moment in _hovering(rng, place, grown, high_mm):
                before = moment.at_mm
                yield moment
        for _ in range(int(rng.integers(2, 4)) if task == "quick" else int(task != "hover")):
            touch += 1
            yield from (_Moment(before, share * high_mm, touch) for share in _DOWN[int(rng.integers(3))])
            for at in _touching(rng, task, before, _anywhere(rng, area)):
                before = at
                yield _Moment(at, 0.0, touch)
            yield from (_Moment(before, share * high_mm, touch) for share in _UP[int(rng.integers(3))])
        place = _anywhere(rng, area)


def _hovering(rng: np.random.Generator, place: Place, grown: float, high_mm: float) -> Iterator[_Moment]:
    low_mm, (dx, dy) = grown * float(rng.uniform(8.0, 22.0)), rng.normal(0.0, 0.8, 2).tolist()
    sinking = int(rng.integers(1, 4))
    for i in range(int(rng.integers(8, 26))):
        share = min(1.0, (i + 1) / sinking)
        yield _Moment((place[0] + dx * i, place[1] + dy * i), high_mm + (low_mm - high_mm) * share, 0)


def _touching(rng: np.random.Generator, task: str, place: Place, other: Place) -> Iterator[Place]:
    """Yield where a touch is in each of its frames."""
    if task == "drag":
        yield from _way(place, other, float(rng.uniform(1.5, 26.0)))
        return
    count = {"quick": rng.integers(1, 5), "tap": rng.integers(2, 9), "hold": rng.integers(10, 40)}[task]
    yield from [place] * int(count)


def _anywhere(rng: np.random.Generator, area: Area) -> Place:
    return area.at(float(rng.uniform(0.08, 0.92)), float(rng.uniform(0.08, 0.92)))


def _way(begin: Place, end: Place, step_mm: float) -> Iterator[Place]:
    far = hypot(end[0] - begin[0], end[1] - begin[1])
    count = min(max(2, ceil(far / step_mm)), 50)
    for i in range(1, count + 1):
        yield begin[0] + (end[0] - begin[0]) * i / count, begin[1] + (end[1] - begin[1]) * i / count
