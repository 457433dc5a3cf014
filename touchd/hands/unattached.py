"""Arms that end in the picture: nothing is seen that leads to them, as where the rest of them is too near to be read.

Nothing that is put down is so long and narrow, and so much higher at one end than at the other.
"""

import numpy as np

from touchd.hands.lookout import Lookout
from touchd.hands.standing import Place, Standing

_LONG_MM, _SLENDER = 180.0, 1.8  # at least, and so many times as long as wide
_HIGH_MM, _STEEP = 60.0, 1.4  # at least, at the higher end, and so many times as high as at the other
_UPRIGHT = 0.9  # times as high as long: what stands upright, such as a bottle, is seen so from aside
_END_SHARE = 0.12  # of its length counts as its end
_OUTLIERS = 0.02  # of its pixels, on either side


def upper_end(label: int, standing: Standing, lookout: Lookout) -> Place | None:
    """Return the end away from the hand, if an island is such an arm."""
    heights = standing.heights(label)
    if float(heights.max()) < _HIGH_MM or len(heights) < lookout.px(_LONG_MM):
        return None
    columns, rows = standing.places(label)
    u, v = columns - columns.mean(), rows - rows.mean()
    angle = 0.5 * np.arctan2(2.0 * np.dot(u, v), np.dot(u, u) - np.dot(v, v))
    along, across = u * np.cos(angle) + v * np.sin(angle), v * np.cos(angle) - u * np.sin(angle)
    (begin, end), (left, right) = (np.quantile(way, (_OUTLIERS, 1.0 - _OUTLIERS)) for way in (along, across))
    length = end - begin
    if length < lookout.px(_LONG_MM) or length < _SLENDER * (right - left):
        return None
    ends = along < begin + _END_SHARE * length, along > end - _END_SHARE * length
    lower, upper = sorted(ends, key=lambda own: float(np.median(heights[own])))
    low_mm, high_mm = float(np.median(heights[lower])), float(np.median(heights[upper]))
    if not max(_HIGH_MM, _STEEP * low_mm) < high_mm < _UPRIGHT * length * lookout.pixel_mm:
        return None
    return float(columns[upper].mean()), float(rows[upper].mean())
