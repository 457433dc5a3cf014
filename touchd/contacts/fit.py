"""Fitting the fingertip model to the heights around many places at once: a few weighted Gauss-Newton steps."""

from bisect import bisect
from dataclasses import dataclass
from itertools import pairwise
from math import cos, sin

import cv2
import numpy as np

from touchd.contacts.heights import Bytes, Lay, as_floats
from touchd.contacts.patch import CLEARANCES_MM, PITCHES_RAD, RADII_MM, UNKNOWNS, PatchBank
from touchd.model import Floats, Mask

# The columns of what is fitted: the ball's centre in the picture (px), the way back along the finger (rad, in the
# surface's frame), pitch (rad), clearance and radius (mm).
ANGLE, PITCH, CLEARANCE, RADIUS = 2, 3, 4, 5
# What is known of any fingertip before looking: mean and standard deviation of pitch, clearance and radius; and how
# far a step may lead along, across (mm) and in turn (rad).
PRIOR_MEAN = np.array([0.65, 0.0, 6.2], np.float32)
PRIOR_TRUST = np.array([5.0, 5.0, 0.4, 0.35, 14.0, 0.8], np.float32) ** -2
# How far one step may go at all: the bank's slopes hold only nearby.
_STRIDE = np.array([6.0, 6.0, 0.4, 0.3, 15.0, 2.0], np.float32)
_LEAST = np.array([-np.inf, -np.inf, -np.inf, 0.0, -4.0, 3.2], np.float32)
_MOST = np.array([np.inf, np.inf, np.inf, 1.35, 45.0, 9.5], np.float32)
LIVE_TRUST = np.float32(6.0**-2)  # in a clearance of 0 where a touch was before: it is likely to go on
_LIFTED_MM = np.float32(8.0)  # the prior on the clearance fades with what is seen to be higher
_PINNED = np.float32(1e6)  # trust in a clearance that is known
# Neighbouring samples share their noise, so that they tell less than their number: 1 / 2.5².
_INDEPENDENT = np.float32(0.16)
# Residuals beyond so many standard deviations count less. What rises beside a finger belongs to others.
_DOUBTFUL, _DOUBTFUL_BESIDE = np.float32(5.0), np.float32(2.0)
_READABLE = 220  # of 255: a sample needs readings all around
_DIAGONAL = np.arange(UNKNOWNS)


@dataclass(slots=True)
class Tips:
    """Fingertips under way, N of them, float32.

    ``state`` (N, 6): where in the picture the ball's centre is seen (u, v in px), the angle of the way back along the
    finger in the surface's frame (:class:`Lay`), pitch in rad, clearance and radius in mm. ``shown`` (N,) bool: whether
    the picture showed it; if not, a touch was only expected there. ``likely`` (N, 6): what the state should be, and
    ``trust`` (N, 6): one over the variance of that; the first two of them bound how far a step leads.
    """

    state: Floats
    shown: Mask
    likely: Floats
    trust: Floats

    def at(self, which: list[int]) -> "Tips":
        """Return some of them, to be moved on their own."""
        return Tips(self.state[which], self.shown[which], self.likely[which], self.trust[which])


@dataclass(frozen=True, slots=True)
class Bed:
    """What the fit of N tips needs to know of where they are.

    ``lay``: how the surface lies there; ``first`` the index of the first template for the size of its pixels;
    ``places_mm`` (N, 2, S): where the samples lie along and across; ``core`` (N, S): which are on the finger's middle.
    """

    lay: Lay
    first: list[int]
    places_mm: Floats
    core: Mask

    def at(self, which: list[int]) -> "Bed":
        """Return it for some of the tips."""
        return Bed(self.lay.at(which), [self.first[i] for i in which], self.places_mm[which], self.core[which])


@dataclass(frozen=True, slots=True)
class Quality:
    """How well the model describes what was seen, (N,) float32 each.

    ``misfit``: rms residual in expected standard deviations, single ones cut at 3. ``core``: the same along the
    finger's middle, cut at 8. ``seen``: share of the patch that has readings and belongs to no neighbour.
    """

    misfit: Floats
    core: Floats
    seen: Floats

    def at(self, which: list[int]) -> "Quality":
        """Return some of them."""
        return Quality(self.misfit[which], self.core[which], self.seen[which])


@dataclass(frozen=True, slots=True)
class Picture:
    """What a fit looks at: heights (H, W) in mm, float32, and 255 where they are readings, 0 elsewhere."""

    heights_mm: Floats
    readings: Bytes


class Fitter:
    """Fits tips to heights, with the templates of one surface."""

    def __init__(self, bank: PatchBank) -> None:
        self._bank = bank
        self._scales, self._radii, self._pitches, self._clearances = (
            _between(values) for values in (bank.scales_mm.tolist(), RADII_MM, PITCHES_RAD, CLEARANCES_MM)
        )

    def bed(self, lay: Lay) -> Bed:
        """Return what fits need to know of places."""
        scale = [bisect(self._scales, mm) for mm in lay.pixel_mm.tolist()]
        of_scale = len(RADII_MM) * len(PITCHES_RAD) * len(CLEARANCES_MM)
        return Bed(lay, [of_scale * k for k in scale], self._bank.places_mm[scale], self._bank.core[scale])

    def fit(self, tips: Tips, bed: Bed, picture: Picture, owned: Floats, rounds: int) -> Quality:
        """Move tips to where the picture says; return how well they fit. ``owned`` (N, S): weights of the samples."""
        known = residual = owned
        for turn in range(rounds):
            at = self._nearest(bed.first, tips.state.tolist())
            rows = self._bank.templates[at]
            axes = _axes(tips.state[:, ANGLE].tolist(), bed.lay)
            places = np.matmul(axes, bed.places_mm)
            places += tips.state[:, :2, None]
            u, v = places[:, 0], places[:, 1]
            if turn == 0:
                read = cv2.remap(picture.readings, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
                known = owned * np.greater(read, _READABLE)
            seen = as_floats(cv2.remap(picture.heights_mm, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
            off = tips.state[:, None, PITCH:] - self._bank.middles[at][:, None]
            residual = seen * rows[:, 1] - rows[:, 0] - np.matmul(off, rows[:, 5:])[:, 0]
            rows[:, 1] = residual
            _move(tips, axes, _step(tips, rows[:, 1:], _counted(residual, known, bed.core)))
        return _quality(residual, known, bed.core)

    def reach_mm(self, pixel_mm: float, level_mm: float) -> float:
        """Return where along a typical touching finger its heights pass a level, from the ball's centre."""
        scale = bisect(self._scales, pixel_mm)
        at = self._nearest([scale * len(RADII_MM) * len(PITCHES_RAD) * len(CLEARANCES_MM)], [[0, 0, 0, 0.6, 0.0, 6.4]])
        rows = self._bank.templates[at][0]
        off = np.array([0.6, 0.0, 6.4], np.float32) - self._bank.middles[at][0]
        heights = (rows[0] + off @ rows[5:]) / rows[1]
        along, across = self._bank.places_mm[scale]
        return float(np.interp(level_mm, heights[across == 0.0], along[across == 0.0]))

    def _nearest(self, first: list[int], states: list[list[float]]) -> list[int]:
        """Return the index of the template that is nearest to each state."""
        pitches, clearances, radii = self._pitches, self._clearances, self._radii
        return [
            begin
            + (bisect(radii, radius) * len(PITCHES_RAD) + bisect(pitches, pitch)) * len(CLEARANCES_MM)
            + bisect(clearances, clearance)
            for begin, (_, _, _, pitch, clearance, radius) in zip(first, states, strict=True)
        ]


def pinned(tips: Tips) -> Tips:
    """Return tips at rest on the surface, of which the clearance is known to be 0."""
    state, likely, trust = tips.state.copy(), tips.likely.copy(), tips.trust.copy()
    state[:, CLEARANCE] = likely[:, CLEARANCE] = 0.0
    trust[:, CLEARANCE] = _PINNED
    return Tips(state, tips.shown, likely, trust)


def _between(values: tuple[float, ...] | list[float]) -> list[float]:
    """Return the limits between values of which the nearest is looked up."""
    return [(a + b) / 2 for a, b in pairwise(values)]


def _axes(angles: list[float], lay: Lay) -> Floats:
    """Return (N, 2, 2) how far a mm along and across the finger leads in the picture, as columns."""
    turned = [((cos(angle), -sin(angle)), (sin(angle), cos(angle))) for angle in angles]
    axes: Floats = np.matmul(lay.px_per_mm, np.array(turned, np.float32))
    return axes


def _counted(residual: Floats, known: Floats, core: Mask) -> Floats:
    """Return how much each sample (N, S) counts.

    Residuals r count as r²/(1 + (r/limit)²) does near its end, which outliers hardly move.
    """
    limit = np.where((residual < 0.0) | core, _DOUBTFUL, _DOUBTFUL_BESIDE)
    doubt = residual / limit
    counted: Floats = _INDEPENDENT * known / (1.0 + doubt * doubt)
    return counted


def _step(tips: Tips, rows: Floats, counted: Floats) -> Floats:
    """Return the step (N, 6) to the least sum of weighed squared residuals and of distances from what is known.

    ``rows`` (N, 7, S): the residuals, and the weighed slopes of the unknowns.
    """
    products = np.matmul(rows * counted[:, None], rows.transpose(0, 2, 1))
    hessian, gradient = products[:, 1:, 1:], products[:, 1:, 0]
    trust = tips.trust.copy()
    trust[:, CLEARANCE] /= 1.0 + np.square(tips.state[:, CLEARANCE] / _LIFTED_MM)
    hessian[:, _DIAGONAL, _DIAGONAL] += trust
    pull = trust * (tips.likely - tips.state)
    pull[:, :2] = 0.0
    step = np.linalg.solve(hessian, (gradient + pull)[..., None])[..., 0]
    bounded: Floats = np.minimum(np.maximum(step, -_STRIDE), _STRIDE)
    return bounded


def _move(tips: Tips, axes: Floats, step: Floats) -> None:
    step[:, :2] = (axes @ step[:, :2, None])[..., 0]
    tips.state += step
    np.maximum(tips.state, _LEAST, out=tips.state)
    np.minimum(tips.state, _MOST, out=tips.state)


def _quality(residual: Floats, known: Floats, core: Mask) -> Quality:
    size = np.abs(residual)
    count = known.sum(axis=1)
    inner = known * core
    misfit = np.einsum("ns,ns->n", known, np.minimum(size, 3.0) ** 2) / np.maximum(count, 1e-3)
    inner_misfit = np.einsum("ns,ns->n", inner, np.minimum(size, 8.0) ** 2) / np.maximum(inner.sum(axis=1), 1e-3)
    return Quality(np.sqrt(misfit), np.sqrt(inner_misfit), count / np.float32(known.shape[1]))
