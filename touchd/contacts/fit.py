"""Fitting the fingertip model to the heights around many places at once: a few weighted Gauss-Newton steps."""

from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from math import atan2, cos, sin, sqrt

import cv2
import numpy as np

from touchd.contacts.heights import Box, Bytes, as_floats
from touchd.contacts.patch import CLEARANCES_MM, RADII_MM, UNKNOWNS, PatchBank
from touchd.contacts.tips import CLEARANCE_TRUST, Tip
from touchd.model import Floats, Mask

# How far a step may lead along and across (mm) and in turn (rad): one over the variance, and at most; the bank's
# slopes hold only nearby.
_ALONG_TRUST, _TURN_TRUST = 5.0**-2, 0.4**-2
_LONGEST = 6.0, 6.0, 0.4, 0.3, 15.0, 2.0  # along, across, in turn, pitch (rad), clearance and radius
_LEAST, _MOST = (0.0, -4.0, 3.2), (1.4, 45.0, 9.5)  # pitch, clearance and radius
_LIFTED_MM = 8.0  # the prior on the clearance fades with what is seen to be higher
# Neighbouring samples share their noise, so that they tell less than their number: 1 / 2.5².
_INDEPENDENT = np.float32(0.16)
# Residuals beyond so many standard deviations count less. What rises beside a finger belongs to others.
_DOUBTFUL, _DOUBTFUL_BESIDE = 5.0, 2.0
_MISFIT_CUT, _CORE_CUT = np.float32(3.0), np.float32(8.0)
_READABLE = 220  # of 255: a sample needs readings all around
_OF_PITCH, _OF_RADIUS = len(RADII_MM) * len(CLEARANCES_MM), len(CLEARANCES_MM)
_SIDE, _CLEARANCE = UNKNOWNS + 1, 4  # the clearance is the fifth of the unknowns


@dataclass(frozen=True, slots=True)
class Quality:
    """How well the model describes what was seen, N numbers each.

    ``misfit``: rms residual in expected standard deviations, single ones cut at 3. ``core``: the same along the
    finger's middle, cut at 8. ``seen``: share of the patch that has readings and belongs to no neighbour.
    """

    misfit: list[float]
    core: list[float]
    seen: list[float]

    def at(self, which: list[int]) -> "Quality":
        """Return some of them."""
        return Quality(*([numbers[i] for i in which] for numbers in (self.misfit, self.core, self.seen)))


@dataclass(frozen=True, slots=True)
class Picture:
    """What a fit looks at: heights (H, W) in mm, float32, and 255 where they are readings, 0 elsewhere, in a box."""

    heights_mm: Floats
    readings: Bytes
    box: Box


@dataclass(frozen=True, slots=True)
class Bed:
    """What the fit of N tips needs to know of where they are, by the size that pixels have there.

    ``first``: each one's first template; ``places`` (N, 3, S): where samples lie along and across, and 1; ``core``
    (N, S) bool: which are on the finger's middle; ``above`` (N, S): one over the square of the residual from which on
    a sample above the model counts less.
    """

    first: list[int]
    places: Floats
    core: Mask
    above: Floats

    def at(self, which: list[int]) -> "Bed":
        """Return it for some of the tips."""
        return Bed([self.first[i] for i in which], self.places[which], self.core[which], self.above[which])


class Fitter:
    """Fits tips to heights, with the templates of one surface."""

    def __init__(self, bank: PatchBank) -> None:
        self._bank = bank
        self._scales, self._radii, self._clearances, self._leans = (
            _between(values) for values in (bank.scales_mm.tolist(), RADII_MM, CLEARANCES_MM, bank.leans)
        )
        self._pitches = [_between(pitches) for pitches in bank.pitches_rad]
        self._of_lean = [0, *accumulate(len(pitches) * _OF_PITCH for pitches in bank.pitches_rad)]
        self._middles: list[list[float]] = bank.middles.tolist()
        ones = np.ones((len(bank.scales_mm), 1, bank.places_mm.shape[2]), np.float32)
        self._places = np.concatenate([bank.places_mm, ones], axis=1)
        self._above = np.where(bank.core, _DOUBTFUL, _DOUBTFUL_BESIDE).astype(np.float32) ** -2

    def bed(self, tips: Sequence[Tip]) -> Bed:
        """Return what fits need to know of where tips are."""
        scale = [bisect(self._scales, tip.guess.lay.pixel_mm) for tip in tips]
        first = [self._of_lean[-1] * k for k in scale]
        return Bed(first, self._places[scale], self._bank.core[scale], self._above[scale])

    def fit(self, tips: Sequence[Tip], bed: Bed, picture: Picture, owned: Floats, rounds: int) -> "Fitted":
        """Move tips to where the picture says; return how they fit. ``owned`` (N, S): weights of the samples."""
        fitted = Fitted(owned, owned, bed.core, [], [])
        known = owned
        for turn in range(rounds):
            at, off, axes, priors = zip(
                *(self._looked_up(tip, first, picture.box) for tip, first in zip(tips, bed.first, strict=True)),
                strict=True,
            )
            rows = np.multiply(self._bank.templates.take(at, axis=0), self._bank.units)
            places = np.matmul(np.array(axes, np.float32), bed.places)
            u, v = places[:, 0], places[:, 1]
            if turn == 0:
                read = cv2.remap(picture.readings, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
                known = owned * np.greater(read, _READABLE)
            seen = as_floats(cv2.remap(picture.heights_mm, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
            residual = seen * rows[:, 1] + np.matmul(np.array(off, np.float32)[:, None], rows)[:, 0]
            rows[:, 1] = residual
            products = _products(rows[:, 1:], _counted(residual, known, bed.above))
            steps = best_steps(products, priors)
            for tip, axis, step in zip(tips, axes, steps, strict=True):
                _move(tip, axis, [best for best, _ in step])
            fitted = Fitted(residual, known, bed.core, axes, steps)
        return fitted

    def reach_mm(self, pixel_mm: float, level_mm: float) -> float:
        """Return where along a typical touching finger its heights pass a level, from the ball's centre."""
        scale = bisect(self._scales, pixel_mm)
        upright = len(self._leans) // 2  # the lean of a camera straight above
        at = self._of_lean[-1] * scale + self._of_lean[upright] + self._shape(upright, 0.6, 6.4, 0.0)
        rows = self._bank.templates[at] * self._bank.units
        heights = (rows[0] + (np.array([0.6, 0.0, 6.4], np.float32) - self._bank.middles[at]) @ rows[5:]) / rows[1]
        along, across = self._bank.places_mm[scale]
        return float(np.interp(level_mm, heights[across == 0.0], along[across == 0.0]))

    def _looked_up(self, tip: Tip, first: int, box: Box) -> "LookUp":
        """Return what one round of the fit needs to know of a tip.

        The template is the nearest one to the tip's shape at the pitch with which a finger rises in the picture as this
        one does if the lean is the template's, so that templates of two leans agree half way between them.
        """
        lay, c, s = tip.guess.lay, cos(tip.angle), sin(tip.angle)
        lean, rise = lay.x_by_z * c + lay.y_by_z * s, sin(tip.pitch_rad)
        which = bisect(self._leans, lean)
        pitch_rad = atan2(rise, cos(tip.pitch_rad) + (lean - self._bank.leans[which]) * rise)
        at = first + self._of_lean[which] + self._shape(which, pitch_rad, tip.radius_mm, tip.clearance_mm)
        pitch, clearance, radius = self._middles[at]
        off = pitch - pitch_rad, clearance - tip.clearance_mm, radius - tip.radius_mm
        axes = (
            (lay.u_by_x * c + lay.u_by_y * s, lay.u_by_y * c - lay.u_by_x * s, tip.u - box.left),
            (lay.v_by_x * c + lay.v_by_y * s, lay.v_by_y * c - lay.v_by_x * s, tip.v - box.top),
        )
        return at, (-1.0, 0.0, 0.0, 0.0, 0.0, *off), axes, _prior(tip)

    def _shape(self, lean: int, pitch_rad: float, radius_mm: float, clearance_mm: float) -> int:
        """Return which of a lean's templates is nearest to a shape."""
        pitch, radius = bisect(self._pitches[lean], pitch_rad), bisect(self._radii, radius_mm)
        return _OF_PITCH * pitch + _OF_RADIUS * radius + bisect(self._clearances, clearance_mm)


@dataclass(frozen=True, slots=True)
class Fitted:
    """How N tips fit: residuals (N, S) in expected standard deviations, which samples count, and the core.

    ``axes``: how far in the picture a mm along and across led last. ``steps``: of each unknown the last step, and how
    much it changes with the clearance: its covariance with it.
    """

    residual: Floats
    known: Floats
    core: Mask
    axes: "Sequence[Axes]"
    steps: list[list[list[float]]]

    def at_rest(self, tips: Sequence[Tip]) -> list[Tip]:
        """Return copies of the tips as they fit best if they rest on the surface.

        To know one of several unknowns exactly moves each other one by their covariance over the known one's variance.
        """
        resting = [tip.copy() for tip in tips]
        for tip, axis, step in zip(resting, self.axes, self.steps, strict=True):
            variance = step[_CLEARANCE][1]
            # It is 0 where rounding left nothing to solve; such a tip stays where it is.
            down = -tip.clearance_mm / variance if variance > 0.0 else 0.0
            _move(tip, axis, [covariance * down for _, covariance in step])
        return resting

    def clearance_variance(self, which: int) -> float:
        """Return the variance (mm²) of a tip's clearance."""
        return self.steps[which][_CLEARANCE][1]

    def quality(self) -> Quality:
        """Return how well the model describes what was seen."""
        squared, inner = self.residual * self.residual, self.known * self.core
        sums = np.array(
            [
                _sums(self.known),
                _sums(self.known * np.minimum(squared, _MISFIT_CUT**2)),
                _sums(inner),
                _sums(inner * np.minimum(squared, _CORE_CUT**2)),
            ]
        ).T.tolist()
        return Quality(
            misfit=[sqrt(misfit / max(count, 1e-3)) for count, misfit, _, _ in sums],
            core=[sqrt(core / max(inside, 1e-3)) for _, _, inside, core in sums],
            seen=[count / squared.shape[1] for count, _, _, _ in sums],
        )


# How far a mm along and across the finger leads in the picture, as columns, and where in the box it is.
Axes = tuple[tuple[float, float, float], tuple[float, float, float]]
Prior = tuple[tuple[float, ...], tuple[float, ...]]
# Which template, what to multiply its rows by for the heights of a shape near it, times -1; axes, and what is likely.
LookUp = tuple[int, tuple[float, ...], Axes, Prior]


def _sums(samples: Floats) -> Floats:
    return np.asarray(np.add.reduce(samples, axis=1), np.float32)


def _counted(residual: Floats, known: Floats, above: Floats) -> Floats:
    """Return how much each sample (N, S) counts.

    Residuals r count as r²/(1 + (r/limit)²) does near its end, which outliers hardly move.
    """
    doubt = residual * residual
    doubt *= np.where(residual < 0.0, np.float32(_DOUBTFUL**-2), above)
    doubt += np.float32(1.0)
    counted: Floats = known / doubt
    return counted


def _products(rows: Floats, counted: Floats) -> Floats:
    """Return the sums over samples (N, 7, 7) of the products of residuals and weighed slopes, rows (N, 7, S)."""
    weighed = rows * (_INDEPENDENT * counted)[:, None]
    products: Floats = np.matmul(weighed, rows.transpose(0, 2, 1))
    return products


def _prior(tip: Tip) -> Prior:
    """Return for each unknown how much it is trusted to be what is likely, and that times how far off it is."""
    clearance_trust = CLEARANCE_TRUST / (1.0 + (tip.clearance_mm / _LIFTED_MM) ** 2)
    return (
        (_ALONG_TRUST, _ALONG_TRUST, _TURN_TRUST, tip.pitch_trust, clearance_trust, tip.radius_trust),
        (
            0.0,
            0.0,
            _TURN_TRUST * (tip.guess.angle - tip.angle),
            tip.pitch_trust * (tip.likely_pitch_rad - tip.pitch_rad),
            -clearance_trust * tip.clearance_mm,
            tip.radius_trust * (tip.likely_radius_mm - tip.radius_mm),
        ),
    )


def best_steps(products: Floats, priors: Sequence[Prior]) -> list[list[list[float]]]:
    """Return for N tips and each unknown the best step, and its covariance with the clearance; 0 where none is best.

    The best step leads to the least sum of weighed squared residuals and of distances from what is likely. ``products``
    (N, 7, 7): sums over samples of the products of residuals and weighed slopes, which are changed.
    """
    trust, pull = np.array(priors, np.float32).transpose(1, 0, 2)
    products.reshape(-1, _SIDE * _SIDE)[:, _SIDE + 1 :: _SIDE + 1] += trust
    wanted = np.zeros((len(priors), UNKNOWNS, 2), np.float32)
    np.add(products[:, 1:, 0], pull, out=wanted[..., 0])
    wanted[:, _CLEARANCE, 1] = 1.0
    try:
        steps: list[list[list[float]]] = np.linalg.solve(products[:, 1:, 1:], wanted).tolist()
    except np.linalg.LinAlgError:  # rounding left nothing to solve of one of them; the next picture is another
        steps = np.zeros_like(wanted).tolist()
    return steps


def _move(tip: Tip, axes: Axes, step: list[float]) -> None:
    along, across, turn, pitch, clearance, radius = map(_within, step, _LONGEST)
    (u_along, u_across, _), (v_along, v_across, _) = axes
    tip.u += u_along * along + u_across * across
    tip.v += v_along * along + v_across * across
    tip.angle += turn
    shape = tip.pitch_rad + pitch, tip.clearance_mm + clearance, tip.radius_mm + radius
    tip.pitch_rad, tip.clearance_mm, tip.radius_mm = map(_between_two, shape, _LEAST, _MOST)


def _within(value: float, most: float) -> float:
    # Calls of min and max would take thrice as long.
    return value if -most < value < most else most if value > 0.0 else -most


def _between_two(value: float, least: float, most: float) -> float:
    return value if least < value < most else most if value > least else least


def _between(values: tuple[float, ...] | list[float]) -> list[float]:
    """Return the limits between values of which the nearest is looked up."""
    return [(a + b) / 2 for a, b in pairwise(values)]
