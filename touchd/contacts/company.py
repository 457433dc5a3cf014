"""A fingertip's company: how it moved since the last picture, and what stands beside it.

Five fingers of a hand that hover look in turn as if one of them touched; together they plainly do not. What is taken
from each is what is said of it, where it is as seen from the one asked about, and which way it points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import NamedTuple

import numpy as np

from touchd.contacts.steady import Seen
from touchd.model import Floats

_BESIDE_MM = 150.0  # a hand's breadth; what is farther is no company
_NEAREST, _TOLD = 3, 7  # so many of those beside it are told one by one, of each so much
_ABSENT = (0.0, -1.0, 3.0, 0.0)  # what is told of all beside it, where there is nobody


@dataclass(frozen=True, slots=True)
class Standing:
    """A fingertip and where it is in mm of the area: if it rests, and if it is as high as it seems.

    ``towards`` (2,): the way it points. ``unseen``: for how many pictures it was not seen since.
    """

    seen: Seen
    rest_mm: tuple[float, float]
    under_mm: tuple[float, float]
    towards: tuple[float, float]
    unseen: int = 0

    def from_rest_mm(self, along_mm: float, across_mm: float) -> tuple[float, float]:
        """Return a place given by how far it is from the one at rest, along the way that it points and across."""
        (x_mm, y_mm), (c, s) = self.rest_mm, self.towards
        return x_mm + along_mm * c - across_mm * s, y_mm + along_mm * s + across_mm * c


class _Beside(NamedTuple):
    """What stands beside a fingertip: how far off it is, squared, which of all, the way there in mm, and itself."""

    squared: float
    which: int
    way_x: float
    way_y: float
    other: Standing


def company(now: Sequence[Standing], before: Sequence[Standing | None]) -> tuple[Floats, Floats]:
    """Return inputs (N, F) of the recurrent network, and how much each of N fingertips hears of the others (N, N).

    ``before``: the same fingertips in the last pictures.
    """
    own, hearing = [], np.zeros((len(now), len(now)), np.float32)
    for row, (one, last) in enumerate(zip(now, before, strict=True)):
        beside = _beside(one, now)
        own.append((*_looks(one.seen), *_moved(one, last), *_one_by_one(one, beside), *_together(beside)))
        for other in beside:
            hearing[row, other.which] = 1.0 / len(beside)
    impressions = np.stack([one.seen.opinion.impression for one in now])
    return np.concatenate([np.array(own, np.float32), impressions], axis=1), hearing


def _looks(seen: Seen) -> tuple[float, ...]:
    opinion, lay = seen.opinion, seen.lay
    return (
        seen.odds / 3.0,
        seen.finger_odds / 3.0,
        seen.clearance_mm / 10.0,
        seen.clearance_mm / (2.6 + 0.8 * lay.step_mm),
        opinion.odds / 3.0,
        opinion.finger_odds / 3.0,
        opinion.clearance_mm / 10.0,
        log(seen.pictures) / 2.0,
        float(seen.shown),
        seen.radius_mm - 6.5,
        log(lay.step_mm / 3.0),
        log(lay.pixel_mm / 2.0),
    )


def _moved(one: Standing, last: Standing | None) -> tuple[float, ...]:
    if last is None:
        return (0.0,) * 6
    c, s = one.towards
    x, y = one.rest_mm[0] - last.rest_mm[0], one.rest_mm[1] - last.rest_mm[1]
    under_x, under_y = one.under_mm[0] - last.under_mm[0], one.under_mm[1] - last.under_mm[1]
    return (
        1.0,
        float(last.unseen),
        (x * c + y * s) / 10.0,
        (y * c - x * s) / 10.0,
        (under_x * c + under_y * s) / 10.0,
        (one.seen.clearance_mm - last.seen.clearance_mm) / 10.0,
    )


def _beside(one: Standing, now: Sequence[Standing]) -> list[_Beside]:
    """Return what stands beside a fingertip, the nearest first. There are so few that numpy would take longer."""
    (x_mm, y_mm), limit, beside = one.under_mm, _BESIDE_MM * _BESIDE_MM, []
    for which, other in enumerate(now):
        way_x, way_y = other.under_mm[0] - x_mm, other.under_mm[1] - y_mm
        squared = way_x * way_x + way_y * way_y
        if squared < limit and other is not one:
            beside.append(_Beside(squared, which, way_x, way_y, other))
    beside.sort()
    return beside


def _one_by_one(one: Standing, beside: Sequence[_Beside]) -> list[float]:
    """Return what is told of each of the nearest, as seen from a fingertip."""
    told: list[float] = []
    c, s = one.towards
    for _, _, way_x, way_y, other in beside[:_NEAREST]:
        told += (
            1.0,
            (way_x * c + way_y * s) / 40.0,
            (way_y * c - way_x * s) / 40.0,
            other.seen.odds / 3.0,
            other.seen.finger_odds / 3.0,
            other.seen.clearance_mm / 10.0,
            c * other.towards[0] + s * other.towards[1],
        )
    return told + [0.0] * (_NEAREST * _TOLD - len(told))


def _together(beside: Sequence[_Beside]) -> tuple[float, ...]:
    """Return what is told of all fingertips beside one."""
    fingers = [near.other.seen for near in beside if near.other.seen.finger_odds > 0.0]
    if not fingers:
        return _ABSENT
    odds, count = [finger.odds / 3.0 for finger in fingers], len(fingers)
    return count / 3.0, max(odds), min(finger.clearance_mm for finger in fingers) / 10.0, sum(odds) / count
