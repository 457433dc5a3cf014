"""A fingertip's company: how it moved since the last picture, and what stands beside it.

Five fingers of a hand that hover look in turn as if one of them touched; together they plainly do not. What is taken
from each is what is said of it, where it is as seen from the one asked about, and which way it points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from touchd.contacts.steady import Seen
from touchd.model import Floats

_BESIDE_MM = 150.0  # a hand's breadth; what is farther is no company
_NEAREST = 3  # of those beside it are told one by one
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


def company(now: Sequence[Standing], before: Sequence[Standing | None]) -> tuple[Floats, Floats]:
    """Return inputs (N, F) of the recurrent network, and how much each of N fingertips hears of the others (N, N).

    ``before``: the same fingertips in the last pictures.
    """
    own = np.array([_looks(one.seen) + _moved(one, last) for one, last in zip(now, before, strict=True)], np.float32)
    beside, hearing = _beside(now)
    impressions = np.stack([one.seen.opinion.impression for one in now])
    return np.concatenate([own, beside, impressions], axis=1), hearing


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


def _beside(now: Sequence[Standing]) -> tuple[Floats, Floats]:
    """Return what is told of those beside each of N fingertips (N, B), and how much it hears of them (N, N)."""
    count = len(now)
    told = np.zeros((count, _NEAREST, 7), np.float32)
    together = np.array([_ABSENT] * count, np.float32)
    if count < 2:
        return np.concatenate([told.reshape(count, -1), together], axis=1), np.zeros((count, count), np.float32)
    x, y, c, s, odds, finger, clearance = np.array(
        [
            (
                *one.under_mm,
                *one.towards,
                one.seen.odds / 3.0,
                one.seen.finger_odds / 3.0,
                one.seen.clearance_mm / 10.0,
            )
            for one in now
        ],
        np.float32,
    ).T
    way_x, way_y = x - x[:, None], y - y[:, None]
    away = np.hypot(way_x, way_y)
    np.fill_diagonal(away, np.inf)
    near = away < _BESIDE_MM
    along, across = (way_x.T * c + way_y.T * s).T / 40.0, (way_y.T * c - way_x.T * s).T / 40.0
    order = np.argsort(away, axis=1, kind="stable")[:, :_NEAREST]
    which = np.arange(count)[:, None], order
    cosine = (c * c[:, None] + s * s[:, None])[which]
    facts = [near[which], along[which], across[which], odds[order], finger[order], clearance[order], cosine]
    told[:, : order.shape[1]] = np.stack(facts, axis=2) * near[which][:, :, None]
    fingers = near & (finger > 0.0)
    some = fingers.any(axis=1)
    total = fingers.sum(axis=1)
    together[some, 0] = total[some] / np.float32(3.0)
    together[some, 1] = np.where(fingers, odds, -np.inf).max(axis=1)[some]
    together[some, 2] = np.where(fingers, clearance, np.inf).min(axis=1)[some]
    together[some, 3] = (fingers @ odds)[some] / total[some]
    hearing = near / np.maximum(near.sum(axis=1, keepdims=True), 1).astype(np.float32)
    return np.concatenate([told.reshape(count, -1), together], axis=1), hearing.astype(np.float32)
