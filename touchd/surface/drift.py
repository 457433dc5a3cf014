"""Smooth changes of how a surface reads: a polynomial of second order over the picture, fitted to what reads off."""

from math import sqrt

import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats, Mask
from touchd.surface.sight import MIDDLES

TERMS, _LINEAR = 6, 3
# What reads off by so much more than a smooth change does is something else; in units of noise.
OUTLIER = 2.0
# So many blocks' worth of belief that nothing changes, which keeps a fit calm where nothing can be seen.
_CALM_BLOCKS = np.array([0.01, 0.01, 0.01, 0.03, 0.03, 0.03])
_ROUNDS, _SETTLING_ROUNDS = 10, 4
_CLOSE = 0.3  # nearer than this to the fit all count the same
_STEP = 2.0**-10  # the least change of a coefficient that is passed on, so that last digits of sums do not matter


class Fields:
    """Smooth fields over pictures of one size, as their coefficients (6,) in units of noise."""

    def __init__(self, shape: tuple[int, int]) -> None:
        """``shape``: rows and columns of the picture."""
        height, width = shape
        self._x = (np.arange(width) - 0.5 * width) / (0.5 * width)
        self._y = (np.arange(height) - 0.5 * height) / (0.5 * width)
        self._across = np.stack([np.ones(width), self._x, self._x**2]).astype(np.float32)
        x, y = self._x[None, MIDDLES[1]], self._y[MIDDLES[0], None]
        ones = np.ones((y.size, x.size))
        terms = np.stack([ones, x * ones, y * ones, x * x * ones, x * y, y * y * ones])
        self._terms = terms.reshape(TERMS, -1).astype(np.float32)
        self._shape = ones.shape
        self._calm = np.diag(_CALM_BLOCKS * max(1, ones.size))

    def at_blocks(self, field: Doubles) -> Floats:
        """Return a field at the middles of the blocks (rows, columns)."""
        found: Floats = (field.astype(np.float32) @ self._terms).reshape(self._shape)
        return found

    def in_rows(self, field: Doubles, rows: slice) -> Floats:
        """Return a field at every pixel of some rows of the picture (n, W)."""
        y = self._y[rows]
        down = np.stack(
            [field[0] + field[2] * y + field[5] * y * y, field[1] + field[4] * y, np.full(len(y), field[3])]
        )
        return down.T.astype(np.float32) @ self._across

    def small(self, off: Floats, where: Mask) -> tuple[Doubles, float]:
        """Return the field of small changes, where nothing else is in sight, and its size (rms) there.

        Takes what is ``off`` (rows, columns) in blocks; what reads off by more than ``OUTLIER`` does not count.
        """
        weights = _soft(off, where)
        field = self._solve(off, weights, TERMS)
        return field, self.size(field, weights)

    def any_size(self, off: Floats, where: Mask) -> Doubles:
        """Return the field that explains most of the blocks, however large it is."""
        field: Doubles = np.zeros(TERMS)
        weights = where.astype(np.float32)
        # Least absolute deviations first, which has one minimum; then the best fit around it.
        for _ in range(_ROUNDS):
            field = self._solve(off, weights, _LINEAR)
            weights = where.astype(np.float32) / np.maximum(np.abs(off - self.at_blocks(field)), _CLOSE)
        for _ in range(_SETTLING_ROUNDS):
            rest = off - self.at_blocks(field)
            field = field + self._solve(rest, _soft(rest, where), TERMS)
        return field

    def size(self, field: Doubles, weights: Floats | Mask) -> float:
        """Return the root of a field's mean square over the weights (rows, columns); 0 where they are all 0."""
        found, shares = self.at_blocks(field).ravel(), weights.ravel().astype(np.float32, copy=False)
        total = float(shares.sum())
        return sqrt(float(np.dot(shares * found, found)) / total) if total > 0.0 else 0.0

    def _solve(self, off: Floats, weights: Floats, terms: int) -> Doubles:
        basis = self._terms[:terms]
        weighted = basis * weights.ravel()
        normal = (weighted @ basis.T).astype(np.float64)
        normal += self._calm[:terms, :terms]
        field = np.zeros(TERMS)
        field[:terms] = np.linalg.solve(normal, weighted @ off.ravel())
        return field


def rounded(field: Doubles) -> Doubles:
    """Return a field as it is passed on."""
    found: Doubles = np.rint(field / _STEP) * _STEP
    return found


def _soft(off: Floats, where: Mask) -> Floats:
    """Return weights that fall from 1 to 0 at what is an outlier."""
    weights = off * np.float32(1.0 / OUTLIER)
    np.multiply(weights, weights, out=weights)
    np.subtract(1.0, weights, out=weights)
    np.maximum(weights, 0.0, out=weights)
    np.multiply(weights, weights, out=weights)
    weights *= where
    return weights
