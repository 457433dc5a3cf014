"""Things that lie under a hand or in it: wide and low, and flat or everywhere far below what stands over them.

In the picture they are one with the hand. Flat fingers are as low and, side by side, as wide; but they rise, and do so
without a step into their hand.
"""

import cv2
import numpy as np

from touchd.hands.lookout import Lookout
from touchd.hands.standing import Bytes, Place, Standing
from touchd.model import Mask

_LOW_MM = 28.0  # a hand rises higher somewhere
_WIDE_MM = 40.0  # no finger is so wide, not as a coarse sensor sees it
_STEP_MM = 30.0  # from one pixel to the next; fingers rise less
_SMOOTH_SHARE = 0.25  # at least, of the higher pixels beside it, go on from a finger
_FLAT_MM, _FLAT_STEPS = 1.0, 0.45  # what differs by less over its wide parts is flat
_FLAT_MM2 = 450.0  # if these, without a margin as wide as half a finger, are as large
_AROUND_MM = 12.0
_BORDER_PX = 2
_SIDE = np.ones((3, 3), np.uint8)


class Ledges:
    """Finds such things in pictures of one surface."""

    def __init__(self, lookout: Lookout, level_mm: float) -> None:
        """``level_mm``: what is higher stands above the surface."""
        self._level_mm = level_mm
        self._low_mm = _LOW_MM + lookout.step_mm
        wide, around = (max(3, round(lookout.px(mm))) for mm in (_WIDE_MM, 2.0 * _AROUND_MM))
        self._wide = np.ones((wide, wide), np.uint8)
        self._around = np.ones((around, around), np.uint8)
        self._flat_mm = _FLAT_MM + _FLAT_STEPS * lookout.step_mm
        self._flat_px = round(_FLAT_MM2 / lookout.pixel_mm**2)
        self._border = np.ones(lookout.shape, np.bool_)
        inner, reach = lookout.window, _BORDER_PX
        self._border[inner.top + reach : inner.bottom - reach, inner.left + reach : inner.right - reach] = False
        self._found: Mask | None = None

    def see(self, standing: Standing | None) -> None:
        """Take in one picture."""
        self._found = None
        if standing is None:
            return
        heights = standing.picture.heights_mm
        low = ((heights > self._level_mm) & (heights < self._low_mm)).view(np.uint8) & standing.above
        seeds = cv2.erode(low, self._wide, borderType=cv2.BORDER_CONSTANT, borderValue=0)
        if not cv2.countNonZero(seeds):
            return
        _, labels = cv2.connectedComponents(low, None, 4, cv2.CV_16U)
        for label in np.unique(labels[seeds > 0]).tolist():
            own = (labels == label).view(np.uint8)
            if not own[self._border].any() and (self._is_flat(own & seeds, standing) or self._is_step(own, standing)):
                more = cv2.dilate(own, self._around) > 0
                self._found = more if self._found is None else self._found | more

    def holds(self, place: Place) -> bool:
        """Return whether a place of the last picture is on such a thing, or close by."""
        if self._found is None:
            return False
        column, row = round(place[0]), round(place[1])
        rows, columns = self._found.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self._found[row, column])

    def _is_flat(self, wide: Bytes, standing: Standing) -> bool:
        """Return whether the wide parts of something (rows, columns) are flat as no hand is."""
        heights = standing.heights_mm[wide > 0]
        if heights.size < self._flat_px:
            return False
        low, high = np.quantile(heights, (0.1, 0.9)).tolist()
        return bool(high - low < self._flat_mm)

    def _is_step(self, own: Bytes, standing: Standing) -> bool:
        """Return whether a low part (rows, columns) rises nowhere without a step."""
        heights = standing.picture.heights_mm
        beside = heights[cv2.dilate(own, _SIDE) > own]
        higher = beside[beside >= self._low_mm]
        height_mm = float(np.median(heights[own > 0]))
        return not higher.size or float(np.mean(higher < height_mm + _STEP_MM)) < _SMOOTH_SHARE
