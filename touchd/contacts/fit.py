"""Fitting the fingertip model to the heights around many places at once: a few weighted Gauss-Newton steps."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.contacts.heights import Bytes, Lay, as_floats
from touchd.contacts.patch import CLEARANCES_MM, PITCHES_RAD, RADII_MM, UNKNOWNS, PatchBank
from touchd.model import Floats, Mask

# What is known of any fingertip before looking: mean and standard deviation of pitch, clearance and radius; and how
# far a step may lead along, across (mm) and in turn (rad).
PRIOR_MEAN = np.array([0.65, 0.0, 6.2], np.float32)
_TRUST = np.array([5.0, 5.0, 0.4, 0.35, 14.0, 0.8], np.float32) ** -2
PRIOR_TRUST = _TRUST[3:]
# How far one step may go at all: the bank's slopes hold only nearby.
_STRIDE = np.array([6.0, 6.0, 0.4, 0.3, 15.0, 2.0], np.float32)
_LEAST = np.array([0.0, -4.0, 3.2], np.float32)
_MOST = np.array([1.35, 45.0, 9.5], np.float32)
_PINNED = np.float32(1e6)  # trust in a clearance that is known
# Neighbouring samples share their noise, so that they tell less than their number: 1 / 2.5².
_INDEPENDENT = np.float32(0.16)
# Residuals beyond so many standard deviations count less. What rises beside a finger belongs to others.
_DOUBTFUL, _DOUBTFUL_BESIDE = np.float32(5.0), np.float32(2.0)
_READABLE = 220  # of 255: a sample needs readings all around


@dataclass(slots=True)
class Tips:
    """Fingertips under way, N of them, float32.

    ``centres_px`` (N, 2): where in the picture the ball's centre is seen. ``angle`` (N,): of the way back along the
    finger, in the surface's frame (:class:`Lay`). ``shape`` (N, 3): pitch in rad, clearance and radius in mm.
    ``shown`` (N,) bool: whether the picture showed it; if not, a touch was only expected there. ``likely`` (N, 3) and
    ``trust`` (N, 3): the shape that it should have, and one over the variance of that.
    """

    centres_px: Floats
    angle: Floats
    shape: Floats
    shown: Mask
    likely: Floats
    trust: Floats

    def at(self, which: list[int]) -> "Tips":
        """Return some of them, to be moved on their own."""
        return Tips(
            self.centres_px[which],
            self.angle[which],
            self.shape[which],
            self.shown[which],
            self.likely[which],
            self.trust[which],
        )


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


class Fitter:
    """Fits tips to heights, with the templates of one surface."""

    def __init__(self, bank: PatchBank) -> None:
        self._bank = bank
        self._scales = _Grid(bank.scales_mm)
        self._pitches, self._clearances, self._radii = _Grid(PITCHES_RAD), _Grid(CLEARANCES_MM), _Grid(RADII_MM)

    def fit(
        self, tips: Tips, lay: Lay, heights: Floats, readings: Bytes, owned: Floats, rounds: int, pinned: bool
    ) -> Quality:
        """Move tips to where the heights (H, W) and readings (H, W) say; return how well they fit.

        ``owned`` (N, S): weights of the samples. With ``pinned`` the clearance stays at 0.
        """
        scale = self._scales.nearest(lay.pixel_mm)
        along, across = self.places(lay)
        core = self._bank.core[scale]
        started = tips.angle.copy()
        trust = np.empty((len(started), UNKNOWNS), np.float32)
        trust[:, :3], trust[:, 3:] = _TRUST[:3], tips.trust
        if pinned:
            trust[:, 4] = _PINNED
        known = residual = owned
        for _ in range(rounds):
            model, slopes, weight = self._templates(scale, tips.shape)
            axes = _axes(tips.angle, lay)
            u = tips.centres_px[:, :1] + axes[:, 0, :1] * along + axes[:, 0, 1:] * across
            v = tips.centres_px[:, 1:] + axes[:, 1, :1] * along + axes[:, 1, 1:] * across
            seen = as_floats(cv2.remap(heights, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
            read = cv2.remap(readings, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
            known = np.where(read > _READABLE, owned, np.float32(0.0))
            residual = (seen - model) * weight
            step = _step(slopes, residual, known, core, tips, started, trust)
            tips.centres_px += np.matmul(axes, step[:, :2, None])[..., 0]
            tips.angle += step[:, 2]
            tips.shape = np.minimum(np.maximum(tips.shape + step[:, 3:], _LEAST), _MOST)
        return _quality(residual, known, core)

    def places(self, lay: Lay) -> tuple[Floats, Floats]:
        """Return where the samples of each tip lie, along and across its finger in mm, (N, S) each."""
        scale = self._scales.nearest(lay.pixel_mm)
        return self._bank.along_mm[scale], self._bank.across_mm[scale]

    def reach_mm(self, pixel_mm: float, level_mm: float) -> float:
        """Return where along a typical touching finger its heights pass a level, from the ball's centre."""
        scale = self._scales.nearest(np.array([pixel_mm], np.float32))
        heights, _, _ = self._templates(scale, np.array([[0.6, 0.0, 6.4]], np.float32))
        middle = self._bank.across_mm[scale[0]] == 0.0
        return float(np.interp(level_mm, heights[0, middle], self._bank.along_mm[scale[0], middle]))

    def _templates(self, scale: NDArray[np.intp], shape: Floats) -> tuple[Floats, Floats, Floats]:
        """Return heights (N, S), weighed slopes (N, 6, S) and weights (N, S) for shapes: the nearest, moved there."""
        pitch, clearance, radius = (
            grid.nearest(shape[:, i]) for i, grid in enumerate((self._pitches, self._clearances, self._radii))
        )
        at = ((scale * len(RADII_MM) + radius) * len(PITCHES_RAD) + pitch) * len(CLEARANCES_MM) + clearance
        off = np.empty((len(at), 1, 3), np.float32)
        off[:, 0, 0] = shape[:, 0] - self._pitches.values[pitch]
        off[:, 0, 1] = shape[:, 1] - self._clearances.values[clearance]
        off[:, 0, 2] = shape[:, 2] - self._radii.values[radius]
        slopes, weight = self._bank.slopes[at], self._bank.weights[at]
        moved = np.matmul(off, slopes[:, 3:])[:, 0]
        return self._bank.heights_mm[at] + moved / weight, slopes, weight


class _Grid:
    """Values of which the nearest is looked up."""

    def __init__(self, values: Floats | tuple[float, ...]) -> None:
        self.values: Floats = np.asarray(values, np.float32)
        self._edges = (self.values[1:] + self.values[:-1]) / 2

    def nearest(self, wanted: Floats) -> NDArray[np.intp]:
        return np.asarray(np.searchsorted(self._edges, wanted), np.intp)


def _axes(angle: Floats, lay: Lay) -> Floats:
    """Return (N, 2, 2) how far a mm along and across the finger leads in the picture, as columns."""
    turn = np.empty((len(angle), 2, 2), np.float32)
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    axes: Floats = np.matmul(lay.px_per_mm, turn)
    return axes


def _step(
    slopes: Floats, residual: Floats, known: Floats, core: Mask, tips: Tips, started: Floats, trust: Floats
) -> Floats:
    """Return the step (N, 6) to the least sum of weighed squared residuals and of distances from what is known.

    Residuals r count as r²/(1 + (r/limit)²) does near its end, which outliers hardly move.
    """
    limit = np.where((residual < 0.0) | core, _DOUBTFUL, _DOUBTFUL_BESIDE)
    doubt = residual / limit
    weighed = slopes * (_INDEPENDENT * known / (1.0 + doubt * doubt))[:, None]
    hessian = np.matmul(weighed, slopes.transpose(0, 2, 1))
    gradient = np.matmul(weighed, residual[:, :, None])[..., 0]
    hessian[:, range(UNKNOWNS), range(UNKNOWNS)] += trust
    gradient[:, 2] += trust[:, 2] * (started - tips.angle)
    gradient[:, 3:] += trust[:, 3:] * (tips.likely - tips.shape)
    step = np.linalg.solve(hessian, gradient[..., None])[..., 0]
    bounded: Floats = np.minimum(np.maximum(step, -_STRIDE), _STRIDE)
    return bounded


def _quality(residual: Floats, known: Floats, core: Mask) -> Quality:
    size = np.abs(residual)
    count = np.einsum("ns->n", known)
    inner = known * core
    misfit = np.einsum("ns,ns->n", known, np.minimum(size, 3.0) ** 2) / np.maximum(count, 1e-3)
    inner_misfit = np.einsum("ns,ns->n", inner, np.minimum(size, 8.0) ** 2)
    inner_misfit /= np.maximum(np.einsum("ns->n", inner), 1e-3)
    return Quality(np.sqrt(misfit), np.sqrt(inner_misfit), count / np.float32(known.shape[1]))
