"""What ought to be said of a fingertip, by how it truly is."""

import numpy as np

from touchd.model import Floats, Mask

# Lower than this, grown by raw steps, a finger as good as touches, for nobody means to hover there. About as high as
# that either answer is right.
_LOW_MM, _LOW_STEPS = 2.6, 0.8
_LOWER, _HIGHER = 0.6, 1.5
_FARTHEST_MM = 15.0  # what is farther off is of something else


def verdicts(finger: Mask, touching: Mask, clearance_mm: Floats, step_mm: Floats) -> tuple[Mask, Mask]:
    """Return which of N fits (N,) are to be taken for touching, and of which either may be said.

    ``step_mm``: of a raw step of the sensor. ``clearance_mm`` is 0 where there is no finger.
    """
    low_mm = _LOW_MM + _LOW_STEPS * step_mm
    low = finger & (touching | (clearance_mm < low_mm))
    unclear = finger & ~touching & (clearance_mm > _LOWER * low_mm) & (clearance_mm < _HIGHER * low_mm)
    return low, unclear


def placed(touching: Mask, place_mm: Floats) -> Mask:
    """Return which of N fits (N,) are to be told how far they are from where they touch, ``place_mm`` (N, 2)."""
    near: Mask = np.hypot(place_mm[:, 0], place_mm[:, 1]) < _FARTHEST_MM
    return touching & near
