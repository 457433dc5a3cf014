"""Things that have become part of the surface: taken in as they are seen, and given back once they are taken away."""

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import COARSE_PX, Floats, Image16, Mask, Sensor, Slide
from touchd.surface.bared import Bared
from touchd.surface.joining import Change, Joining, joint_window, window_around, within
from touchd.surface.sliding import Sliding

# A thing is gone where it reads lower than half of its height for so long; what is flatter cannot be told.
_FLAT_RAW, _GONE_SHARE, _GONE_S, _PARTLY_GONE_S = 0.8, 0.6, 0.12, 0.3
_SEEN_SHARE = 0.3  # of it must be in sight to tell
_LEFT_OVER_SHARE = 0.85  # a thing of which less is left was pushed, or is another by now: none of it is the surface
_CHUNK, _AROUND = np.ones((3, 3), np.uint8), np.ones((5, 5), np.uint8)
_CELL = np.ones((COARSE_PX, COARSE_PX), np.uint8)

S = TypeVar("S", bound=np.generic)


class Layers:
    """All things that are, or are about to become, part of one surface."""

    def __init__(self, sensor: Sensor, unit_raw: float) -> None:
        """``unit_raw``: what noise may make of a reading."""
        self._readable = np.isfinite(sensor.to_mm)
        self._sensor, self._unit_raw = sensor, unit_raw
        self._shape = (sensor.size[1], sensor.size[0])
        self._joining: list[Joining] = []
        self._lying: list[_Lying] = []
        self.slides: tuple[Slide, ...] = ()
        self._bared = Bared(self._readable, unit_raw)
        self._measure()

    @property
    def mask(self) -> Mask:
        """Where (H, W) a thing is part of the surface."""
        found = np.zeros(self._shape, np.bool_)
        for thing in self._lying:
            found |= _mask_of(thing.rise, thing.own, self._shape)
        return found

    @property
    def by(self) -> Floats:
        """By how much (H, W, raw) the surface reads farther for what lies on it; nearer is less than 0."""
        total = np.zeros(self._shape, np.float32)
        for thing in self._lying:
            total[thing.rise.window] += thing.rise.by
        return total

    def join(self, mask: Mask) -> None:
        """Take in what is seen within a mask (H, W) in the next pictures in which it keeps still."""
        window = window_around(mask)
        if window is not None and mask[window].any():
            self._joining.append(Joining(window, mask[window], self._readable, self._unit_raw))

    def step(self, raw: Image16, reference: Floats, seconds: float) -> list[Change]:
        """Return how a picture changes the surface, whose ``reference`` (H, W) includes all things in it.

        ``seconds`` have passed since the last one.
        """
        before = [(thing.rise, thing.own) for thing in self._lying]
        changes = [thing.pushed(raw, reference) for thing in self._lying]
        self.slides = tuple(
            Slide(_mask_of(*was, self._shape), _mask_of(thing.rise, thing.own, self._shape))
            for was, thing, change in zip(before, self._lying, changes, strict=True)
            if change is not None
        )
        if self.slides:
            self._measure()
            return [change for change in changes if change is not None]
        changes = [thing.taken_away(raw, reference, seconds) for thing in self._lying]
        if self._lying and not any(changes):
            bare = self._bared.step(_sampled(raw), _sampled(reference), self._by, self._tallest, seconds)
            changes = [] if bare is None else [thing.laid_bare(bare) for thing in self._lying]
        if any(changes):
            self._lying = [thing for thing in self._lying if thing.rise.by.any()]
            self._measure()
        # What lies at the same place is learned one after the other.
        learned = next((thing for thing in self._joining if thing.is_learned(raw)), None) if self._joining else None
        if learned is not None:
            self._joining.remove(learned)
            changes.append(self._taken_in(learned, reference))
        return [change for change in changes if change is not None]

    def _taken_in(self, learned: Joining, reference: Floats) -> Change:
        """Return what a thing that was looked at makes of the surface, and remember it."""
        rise = learned.rise(reference)
        is_flat = bool(np.median(rise.by[learned.own]) >= -_FLAT_RAW * self._unit_raw)
        below = next((thing for thing in self._lying if thing.bears(learned)), None) if is_flat else None
        if below is not None:
            below.correct(rise)
        # Whether a flat one is taken away could not be told: it becomes the surface for good.
        elif not is_flat:
            self._lying.append(_Lying(rise, learned.own, self._sensor, _FLAT_RAW * self._unit_raw))
        self._measure()
        return rise

    def _measure(self) -> None:
        """Measure anew what lies there, at the pixels that are sampled and at most around each."""
        by = self.by
        self._by = _sampled(by)
        # A cell begins as many pixels before the one that is sampled.
        around = cv2.dilate(np.abs(by), _CELL, anchor=(COARSE_PX // 2, COARSE_PX // 2))
        self._tallest: Floats = _sampled(np.asarray(around, np.float32))


class _Lying:
    """A thing that is part of the surface."""

    def __init__(self, rise: Change, own: Mask, sensor: Sensor, flat_raw: float) -> None:
        """``rise``: what it changed of the surface. ``own``: its mask within that window, without what surrounds it."""
        self.rise = rise
        self.own = own
        self._readable = np.isfinite(sensor.to_mm)
        self._flat_raw = flat_raw
        self._at_first = self._standing(rise.by)
        self._gone_s = np.zeros(_sampled(own).shape, np.float32)
        self._sensor = sensor
        self._sliding: Sliding | None = None

    def bears(self, learned: Joining) -> bool:
        """Return whether most of what was looked at is on it."""
        both = joint_window(self.rise.window, learned.window)
        own, other = np.zeros((2, *(side.stop - side.start for side in both)), np.bool_)
        own[within(self.rise.window, both)] = self.own
        other[within(learned.window, both)] = learned.own
        on = int(np.count_nonzero(own & other))
        return 2 * on > int(np.count_nonzero(learned.own))

    def correct(self, rise: Change) -> None:
        """Take in how it reads otherwise than was thought: what was seen at its place is it."""
        whole = self.rise.plus(rise)
        own = np.zeros(whole.by.shape, np.bool_)
        own[within(self.rise.window, whole.window)] = self.own
        self.rise, self.own = whole, own
        self._gone_s = np.zeros(_sampled(own).shape, np.float32)
        self._sliding = None

    def pushed(self, raw: Image16, reference: Floats) -> Change | None:
        """Return the surface's change if a picture shows that it was pushed."""
        self._sliding = self._sliding or Sliding(self._sensor, self.rise, self.own, reference, self._flat_raw)
        found = self._sliding.step(raw, reference, self.rise)
        if found is None:
            return None
        before = self.rise
        self.rise, self.own = found
        self._gone_s = np.zeros(_sampled(self.own).shape, np.float32)
        return self.rise.plus(Change(before.window, -before.by))

    def taken_away(self, raw: Image16, reference: Floats, seconds: float) -> Change | None:
        """Return the surface's change if pictures up to this one show that it was taken away, or a part of it."""
        window = self.rise.window
        seen, by = _sampled(raw[window]), _sampled(self.rise.by)
        tall = np.less(by, -self._flat_raw)
        told: Mask = self._readable.take(seen, mode="clip") & tall
        lower = told & np.greater(seen, _sampled(reference[window]) - 0.5 * by)
        self._gone_s += np.float32(seconds)
        self._gone_s *= lower
        if not lower.any():
            return None
        in_sight = np.count_nonzero(told)
        gone = np.count_nonzero(self._gone_s > _GONE_S)
        if in_sight > _SEEN_SHARE * np.count_nonzero(tall) and gone > _GONE_SHARE * in_sight:
            return self._without(np.ones(self.own.shape, np.bool_))
        chunk = cv2.erode(np.greater(self._gone_s, _PARTLY_GONE_S).view(np.uint8), _CHUNK)
        if not chunk.any():
            return None
        cells = np.greater(cv2.dilate(chunk, _AROUND), 0) & (lower | ~told)
        return self._without(np.kron(cells, _CELL) > 0)

    def laid_bare(self, bare: Mask) -> Change | None:
        """Return the surface's change where it is seen below the thing, as sampled (rows, columns); None for none."""
        rows, columns = (slice(side.start // COARSE_PX, side.stop // COARSE_PX) for side in self.rise.window)
        where = np.kron(bare[rows, columns], _CELL) > 0
        return self._without(where) if self.rise.by[where].any() else None

    def _standing(self, by: Floats) -> int:
        """Return how many of the thing's own pixels it makes higher."""
        return int(np.count_nonzero(by[self.own] < -self._flat_raw))

    def _without(self, where: Mask) -> Change:
        before = self.rise
        left = np.where(where, np.float32(0.0), before.by)
        if self._standing(left) < _LEFT_OVER_SHARE * self._at_first:
            left = np.zeros_like(left)
        self.rise = Change(before.window, left)
        self._sliding = None
        self._gone_s[:] = 0.0
        return Change(before.window, left - before.by)


def _mask_of(rise: Change, own: Mask, shape: tuple[int, int]) -> Mask:
    """Return where (H, W) a thing is part of the surface."""
    found = np.zeros(shape, np.bool_)
    found[rise.window] = own & (rise.by != 0.0)
    return found


def _sampled(pixels: NDArray[S]) -> NDArray[S]:
    """Return the pixels of a window at which coarse pictures are sampled."""
    half = COARSE_PX // 2
    return pixels[half::COARSE_PX, half::COARSE_PX]
