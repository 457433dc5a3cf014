"""What stands above the surface: where in the picture, its outlines, and whether a hand belongs to it."""

import cv2
import numpy as np

from touchd.contacts.candidates import Outline
from touchd.contacts.heights import Box, Heights
from touchd.model import Floats, Image16, Mask

_THING_MM, _THING_STEPS = 5.0, 0.5
_TOO_HIGH_MM, _TOO_HIGH_STEPS = 70.0, 2.0  # for a fingertip near the surface; a forearm often is, all of it
_HAND_MM = 28.0  # a hand rises this high somewhere
_BORDER_MM = 15.0  # and at least this high where it is cut off by the border of what is looked at
_EVERY_ROWS = 4  # of so many is one looked at: reading the picture costs more than all that is done with it
_SOLID = np.ones((1, 5), np.uint8)  # in such a row; what noise alone never fills
_AROUND_PX = 14


class Things:
    """Finds what stands above one surface."""

    def __init__(self, heights: Heights, levels_mm: tuple[float, ...], step_mm: float) -> None:
        """``levels_mm``: heights at which outlines are drawn, the lowest first."""
        self.box = _bounds(heights.usable)
        self._levels_mm = levels_mm
        self._border_mm = _BORDER_MM + step_mm
        self._rows = slice(self.box.top, self.box.bottom, _EVERY_ROWS)
        self._columns = slice(self.box.left, self.box.right)
        lowest_mm, highest_mm = _THING_MM + _THING_STEPS * step_mm, _TOO_HIGH_MM + _TOO_HIGH_STEPS * step_mm
        self._heights = heights
        self._lowest, self._highest = (heights.raw_below(mm)[self._rows] for mm in (lowest_mm, highest_mm))
        bounds = heights.between(self._lowest, self._highest, self._rows)
        self._low, self._high = (np.ascontiguousarray(bound[:, self._columns]) for bound in bounds)
        self._above, self._solid = (np.empty(self._low.shape, np.uint8) for _ in range(2))

    def follow(self, rows: slice) -> None:
        """Look above the surface as ``heights`` have it by now in some rows of the picture."""
        first = max(0, -(-(rows.start - self.box.top) // _EVERY_ROWS))
        last = min(len(self._low), -(-(rows.stop - self.box.top) // _EVERY_ROWS))
        if first >= last:
            return
        looked_at = slice(first, last)
        stop = min(self.box.top + last * _EVERY_ROWS, self.box.bottom)
        bounds = self._heights.between(
            self._lowest[looked_at],
            self._highest[looked_at],
            slice(self.box.top + first * _EVERY_ROWS, stop, _EVERY_ROWS),
        )
        self._low[looked_at], self._high[looked_at] = (bound[:, self._columns] for bound in bounds)

    def busy(self, raw: Image16) -> Box | None:
        """Return a box around all that may hold a fingertip in a picture: what stands above the surface, not too high.

        None where nothing does.
        """
        if not self._above.size:
            return None
        above = cv2.inRange(raw[self._rows, self._columns], self._low, self._high, dst=self._above)
        solid = cv2.erode(above, _SOLID, dst=self._solid, borderType=cv2.BORDER_CONSTANT, borderValue=0)
        left, top, width, height = cv2.boundingRect(solid)
        if width == 0:
            return None
        # A solid place stands for its row, and what was not looked at beside it.
        above_px, below_px = _EVERY_ROWS * (top - 1), _EVERY_ROWS * (top + height)
        return Box(
            max(self.box.left + left - _AROUND_PX, self.box.left),
            max(self.box.top + above_px - _AROUND_PX, self.box.top),
            min(self.box.left + left + width + _AROUND_PX, self.box.right),
            min(self.box.top + below_px + _AROUND_PX, self.box.bottom),
        )

    def outlines(self, heights: Floats, smooth: Floats, box: Box) -> list[Outline]:
        """Return the outlines of hands at all levels, in px of a box, whose heights (H, W) are given twice."""
        found = []
        for level, level_mm in enumerate(self._levels_mm):
            mask = np.greater(smooth, level_mm).view(np.uint8)
            outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            found += [
                Outline(np.asarray(points, np.int32), level)
                for points in outlines
                if self._is_hand(cv2.boundingRect(points), heights, box)
            ]
        return found

    def _is_hand(self, bounds: tuple[int, int, int, int] | cv2.typing.Rect, heights: Floats, box: Box) -> bool:
        """Return whether a thing rises like a hand; one that is cut off at the border may hide where it does."""
        left, top, width, height = bounds
        cut_off = (
            left + box.left <= self.box.left + 1
            or top + box.top <= self.box.top + 1
            or left + width + box.left >= self.box.right - 1
            or top + height + box.top >= self.box.bottom - 1
        )
        needed_mm = self._border_mm if cut_off else _HAND_MM
        return bool(heights[top : top + height, left : left + width].max() >= needed_mm)


def _bounds(usable: Mask) -> Box:
    """Return the box around all usable pixels."""
    rows, columns = np.flatnonzero(usable.any(axis=1)), np.flatnonzero(usable.any(axis=0))
    if not rows.size:
        return Box(0, 0, 0, 0)
    return Box(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
