"""Things on their way to become part of the surface: looked at for as long as it takes to learn how they read."""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import COARSE_PX, Floats, Image16, Mask

_STILL_FRAMES = 15  # a thing is learned from so many pictures in which it keeps still
_STILL_SHARE, _STILL_RAW = 0.05, 3.0
_AGAIN_FRAMES = 4  # pictures that are alike, but not like those before: it is looked at anew
_WAVERING_RAW = 4.0  # what varies by more is an outline, of which the nearest counts
_GROWN_PX = 6  # beyond a thing's mask, where its outline wavers
_WATCHED_PX = 16  # beyond it: a hand that comes so near is not to be learned with it
_HAND = np.ones((5, 5), np.uint8)  # of what moves; outlines waver over less
_FILLED_PX = 15  # over places of a thing that cannot be read
_NEVER = 65535

Window: TypeAlias = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Change:
    """By how much the surface reads farther (raw) from now on, within a window of the picture."""

    window: Window
    by: Floats

    def plus(self, other: "Change") -> "Change":
        """Return both as one."""
        window = joint_window(self.window, other.window)
        by = np.zeros([side.stop - side.start for side in window], np.float32)
        for change in (self, other):
            by[within(change.window, window)] += change.by
        return Change(window, by)


class Joining:
    """A thing that is being looked at, to become part of the surface."""

    def __init__(self, window: Window, own: Mask, readable: Mask, unit_raw: float) -> None:
        """``own``: its mask within the window. ``readable``: for each raw value whether it is a reading."""
        self.window = window
        self.own = own.copy()
        self._around, self._watched = (_grown(self.own, px) for px in (_GROWN_PX, _WATCHED_PX))
        self._readable = readable
        self._unit_raw = unit_raw
        self._frames = self._alike = 0
        self._first = self._last = _Look(np.zeros(own.shape, np.int32), np.zeros(own.shape, np.bool_))
        self._sum, self._count = np.zeros(own.shape, np.float32), np.zeros(own.shape, np.uint8)
        self._nearest, self._farthest = np.full(own.shape, _NEVER, np.int32), np.zeros(own.shape, np.int32)

    def is_learned(self, raw: Image16) -> bool:
        """Take in one picture, and return whether it was the last one needed."""
        seen = raw[self.window].astype(np.int32)
        known = self._readable.take(seen, mode="clip")
        now, before = _Look(seen, known), self._last
        self._last = now
        if self._frames == 0:
            self._begin(now)
        elif self._differ(self._first, now):
            self._alike = 0 if self._differ(before, now) else self._alike + 1
            if self._alike < _AGAIN_FRAMES:
                return False
            self._begin(now)
        self._alike = 0
        self._frames += 1
        self._sum += seen * known
        self._count += known
        np.minimum(self._nearest, np.where(known, seen, _NEVER), out=self._nearest)
        np.maximum(self._farthest, np.where(known, seen, 0), out=self._farthest)
        return self._frames >= _STILL_FRAMES

    def rise(self, reference: Floats) -> Change:
        """Return what it makes of a surface that reads so (H, W) without it."""
        known = (self._count * 2 > self._frames) & self._around
        mean = self._sum / np.maximum(self._count, 1)
        wavers = self._farthest - self._nearest > _WAVERING_RAW * self._unit_raw
        reading = np.where(wavers, self._nearest, mean)
        by = np.where(known, reading - reference[self.window], 0.0).astype(np.float32)
        size = (_FILLED_PX, _FILLED_PX)
        weight = cv2.blur(known.astype(np.float32), size)
        around = cv2.blur(by, size) / np.maximum(weight, 1e-3)
        hole = ~known & self.own & (weight > 0.1)
        return Change(self.window, np.where(hole, around, by).astype(np.float32))

    def _begin(self, now: "_Look") -> None:
        self._frames = 0
        self._first = now
        self._sum[:] = 0.0
        self._count[:] = 0
        self._nearest[:], self._farthest[:] = _NEVER, 0

    def _differ(self, one: "_Look", other: "_Look") -> bool:
        """Return whether something moved from one picture to another: much of the thing, or what is a finger wide."""
        both = one.known & other.known & self._watched
        moved = (np.abs(one.seen - other.seen) > _STILL_RAW * self._unit_raw) & both
        over, own = (int(np.count_nonzero(where & self.own)) for where in (moved, both))
        return over > _STILL_SHARE * max(1, own) or bool(cv2.erode(moved.view(np.uint8), _HAND).any())


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A picture's window: what is seen (H, W, raw), and which of that are readings."""

    seen: NDArray[np.int32]
    known: Mask


def _grown(mask: Mask, px: int) -> Mask:
    """Return a mask (H, W) with the pixels around it that are so near."""
    size = 2 * px + 1
    return cv2.dilate(mask.view(np.uint8), np.ones((size, size), np.uint8)) > 0


def window_around(mask: Mask) -> Window | None:
    """Return the window around a mask (H, W), grown, its edges at multiples of ``COARSE_PX``; None for an empty one."""
    sides = []
    for axis in (0, 1):
        where = np.flatnonzero(mask.any(axis=1 - axis))
        if not where.size:
            return None
        first, last = max(0, int(where[0]) - _WATCHED_PX), int(where[-1]) + 1 + _WATCHED_PX
        limit = mask.shape[axis] // COARSE_PX * COARSE_PX
        sides.append(slice(first // COARSE_PX * COARSE_PX, min(-(-last // COARSE_PX) * COARSE_PX, limit)))
    return sides[0], sides[1]


def joint_window(one: Window, other: Window) -> Window:
    """Return the window around two."""
    rows, columns = (slice(min(a.start, b.start), max(a.stop, b.stop)) for a, b in zip(one, other, strict=True))
    return rows, columns


def within(inner: Window, outer: Window) -> Window:
    """Return a window as an index of one around it."""
    rows, columns = (slice(a.start - b.start, a.stop - b.start) for a, b in zip(inner, outer, strict=True))
    return rows, columns
