"""A block-matching sensor without its noise: true depth in, shift out, with fat outlines, shadows and lost rims."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import log1p, sqrt
from statistics import NormalDist

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import Floats, Mask, frozen_array
from touchd.table.backdrop import Backdrop
from touchd.table.boxes import Box, apart, banded
from touchd.table.correlator import Correlator, Window, shadow
from touchd.table.render import DepthPicture

RAW_PER_PX = 8.0  # a raw step is an eighth of a pixel of disparity
_OUTLINE_STEP_RAW = 12.0  # outlines lower than this lose no readings
_SHADOW_MM = 250.0  # what is nearer to the camera than this throws no longer shadow; arms do not come here
_BAND_ROWS = 48
_NEIGHBOURS = np.ones((3, 3), np.uint8)
# Chance of no reading 1, 2, ... px inside an outline's near side.
_LOST_INSIDE = (0.23, 0.065, 0.034, 0.02, 0.012)
# Those chances as limits on a normal number; in the order in which rims are found, from 5 px inside to 1.
_LIMITS = np.array([-np.inf, *(NormalDist().inv_cdf(chance) for chance in reversed(_LOST_INSIDE))], np.float32)
_LASTING, _PASSING = np.float32(0.84), np.float32(0.543)  # shares of luck; their squares add up to 1


@dataclass(frozen=True, slots=True)
class ShiftLaw:
    """The law of triangulation: raw = at_infinity - per_inverse_mm / Z."""

    at_infinity: float
    per_inverse_mm: float

    def raw(self, depth_mm: Floats) -> Floats:
        """Return the fractional raw value of depths in mm."""
        raw: Floats = np.float32(self.at_infinity) - np.float32(self.per_inverse_mm) / depth_mm
        return raw

    def depth_mm(self, raw: Floats) -> Floats:
        """Return the depth in mm of fractional raw values."""
        depth: Floats = np.float32(self.per_inverse_mm) / (np.float32(self.at_infinity) - raw)
        return depth


@dataclass(frozen=True, slots=True)
class Found:
    """What is found in a box of the picture: shift (h, w), where there is none, and the pixels that often lose theirs.

    ``rims`` are flat indices into the box, ``limits`` how low a normally distributed number must be there for the
    reading to get lost.
    """

    box: Box
    raw: Floats
    lost: Mask
    rims: NDArray[np.intp]
    limits: Floats

    def lost_now(self, luck: Floats, luck_now: Floats) -> Mask:
        """Return where a frame has no reading.

        ``luck`` and ``luck_now`` (H, W) are noise of unit variance, the unit's own and the frame's: readings get lost
        in patches, and mostly in the same ones in the next frame.
        """
        lost = self.lost.copy()
        if not self.rims.size:  # as on a flat table, where flattening the whole picture would take a millisecond
            return lost
        window = self.box.window
        drawn = luck[window].ravel()[self.rims] * _LASTING
        drawn += luck_now[window].ravel()[self.rims] * _PASSING
        lost.ravel()[self.rims[drawn < self.limits]] = True
        return lost


class BlockMatcher:
    """Finds the shift of everything over one empty surface.

    Windows are judged by their rise over the table's plane, which is smooth; a book or the floor beside the table are
    rises like a hand's.
    """

    def __init__(self, law: ShiftLaw, empty: Backdrop, window: Window, dots: Floats) -> None:
        """``dots`` (H, W): how much each pixel's texture counts, 1 in the mean."""
        self._law = law
        self._empty = empty
        self._window_px = window.size_px
        self._halo_px = window.size_px // 2 + len(_LOST_INSIDE) + 1
        self._correlator = Correlator(window)
        self._dots = dots
        height, width = dots.shape
        self._size = (width, height)
        self._u = np.broadcast_to(np.arange(width, dtype=np.float32), dots.shape)
        self._plane_raw = frozen_array(law.raw(empty.plane_mm))
        self._empty_raw = self._plane_raw if empty.flat else frozen_array(law.raw(empty.depth_mm))

    def empty(self) -> Found:
        """Return what is found of the empty surface, all over the picture."""
        box = Box(0, 0, *self._size)
        if self._empty.flat:
            nothing = np.zeros(0, np.intp)
            return Found(box, self._plane_raw, np.zeros(self._dots.shape, np.bool_), nothing, np.zeros(0, np.float32))
        return self._match(self._empty.depth_mm, None, box)

    def changes(self, picture: DepthPicture) -> Iterator[Found]:
        """Yield what is found around all that is not the empty surface, in boxes that do not meet."""
        for box in self._busy(picture):
            yield self._match(picture.depth_mm, picture.dark, box)

    def _busy(self, picture: DepthPicture) -> list[Box]:
        """Return boxes that do not meet, around all hands, their shadows and their grown outlines."""
        if not picture.seen:
            return []
        around = self._window_px // 2 + 1
        boxes = [seen.box for seen in picture.seen]
        edges = np.array([(box.left, box.top, box.right - 1, box.bottom - 1) for box in boxes])
        behind = self._empty_raw[edges[:, [1, 1, 3, 3]], edges[:, [0, 2, 0, 2]]].max(1)
        nearest_mm = np.array([max(seen.nearest_mm, _SHADOW_MM) for seen in picture.seen], np.float32)
        reaches = ((behind - self._law.raw(nearest_mm)) / RAW_PER_PX).astype(int) + 1
        left = np.maximum(reaches, 0).tolist()
        grown = [box.grown(reach, around, self._size) for box, reach in zip(boxes, left, strict=True)]
        whole, bands = apart(grown), banded(grown, _BAND_ROWS)
        cost = sum(box.grown(0, self._halo_px, self._size).area for box in bands)
        return bands if cost < sum(box.area for box in whole) else whole

    def _match(self, depth_mm: Floats, dark: Mask | None, box: Box) -> Found:
        around = box.grown(0, self._halo_px, self._size)
        window, inner = around.window, around.shrunk_to(box)
        true_raw = self._law.raw(depth_mm[window])
        columns = true_raw * np.float32(1.0 / RAW_PER_PX)
        columns += self._u[window]
        plane_raw = self._plane_raw[window]
        rise_raw = plane_raw - true_raw
        lit = ~shadow(columns, int((rise_raw.max() - min(float(rise_raw.min()), 0.0)) / RAW_PER_PX) + 1)
        if dark is not None:
            lit &= ~dark[window]
        matched = self._correlator.match(rise_raw, self._dots[window] * lit)
        rims, limits = _rims(matched.rise_raw, inner)
        return Found(box, plane_raw[inner] - matched.rise_raw[inner], matched.lost[inner], rims, limits)


def dot_weights(contrast: float, shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Return log-normal weights of mean 1 and the given standard deviation."""
    spread = sqrt(log1p(contrast * contrast))
    weights: Floats = np.exp(spread * rng.standard_normal(shape, np.float32) - 0.5 * spread * spread)
    return weights


def _rims(rise_raw: Floats, inner: tuple[slice, slice]) -> tuple[NDArray[np.intp], Floats]:
    """Return the pixels just inside the near side of high outlines, and their limits as in :class:`Found`.

    They are flat indices into the ``inner`` part of the rise.
    """
    reach = len(_LOST_INSIDE)
    outline = (rise_raw - cv2.erode(rise_raw, _NEIGHBOURS) > _OUTLINE_STEP_RAW).astype(np.uint8)
    close = outline.copy()
    for _ in range(reach - 1):
        cv2.dilate(outline, _NEIGHBOURS, dst=outline)
        close += outline
    above = cv2.dilate(rise_raw, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) - rise_raw
    near = np.flatnonzero(((close > 0) & (above < _OUTLINE_STEP_RAW))[inner])
    return near, _LIMITS[close[inner].ravel()[near]]
