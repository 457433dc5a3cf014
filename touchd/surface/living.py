"""A surface that lives: it drifts, is knocked, and things become part of it; and nothing else is ever learned."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import cv2
import numpy as np

from touchd.geometry import Doubles, Plane, SurfaceMap, depth_mm, fit_plane, mm_per_raw
from touchd.model import (
    CoarsePicture,
    Floats,
    FollowedArea,
    Frame,
    Image16,
    Mask,
    Slide,
    Surface,
    SurfaceRows,
    frozen_array,
)
from touchd.surface.drift import TERMS, Fields, rounded
from touchd.surface.joining import Change
from touchd.surface.layers import Layers
from touchd.surface.sight import BLOCK_PX, MIDDLES, Blocks, filled_reference
from touchd.surface.sunken import Sunken
from touchd.surface.watch import Outlook, Watch

_DRIFT_S = 0.25  # smooth changes are followed within this time
# Each row of blocks is visited once in so long, but no more of them in one picture. A pixel's reading is the mean over
# so many visits, of what is off by no more than this.
_SWEEP_S, _MOST_ROWS = 1.0, 8
_KNOWN_WELL, _WITHIN = 64, 2.0
# After a move, what was known of a pixel is worth so many visits, and it is known again after so many; until then, or
# for so long, so many rows at least are visited in every picture.
_KNOWN_BEFORE, _KNOWN_AGAIN = 3, 12
_LEARN_AGAIN_NS, _ROWS_AFTER_A_MOVE = 3_000_000_000, 4
_NO_MOVE = 0.2  # a jolt after which all reads as before, but for this; in units of noise
# What has changed since pictures came last, by so much at most, may be the camera's warmth.
_UNSEEN_DRIFT, _JUST_BEGUN_NS, _PAUSE_S = 4.0, 2_000_000_000, 5.0
_WORTH_TELLING = 0.05  # a change of the surface's reading, in units of noise
# Before touches are seen a glance must do: at every fourth block of every fourth row, how many are off by more.
_GLANCE = (slice(BLOCK_PX // 2, None, 4 * BLOCK_PX), slice(BLOCK_PX // 2, None, 4 * BLOCK_PX))
_OFF, _STARTLING = 0.8, 0.2
_ALL = 255  # true, in a mask of OpenCV's
_SMALLEST_PX, _LEAST_KNOWN = 4 * BLOCK_PX, 0.05


def can_live(surface: Surface) -> bool:
    """Return whether pictures of a surface are large enough to follow it, and show enough of it."""
    return min(surface.valid.shape) >= _SMALLEST_PX and bool(np.mean(surface.valid) > _LEAST_KNOWN)


@dataclass(frozen=True, slots=True)
class Vitals:
    """How a surface has fared since it was learned.

    ``drift_mm``: how far (rms) it reads from where it did when it was learned, or learned again after a move.
    ``moves``: how often it was moved.
    """

    drift_mm: float
    moves: int


class LivingSurface:
    """Follows one surface, picture by picture. Pure: the same pictures give the same surface.

    All that it tells is how the empty surface reads by now, in some rows at a time.
    """

    def __init__(self, surface: Surface, surface_map: SurfaceMap) -> None:
        self._surface = surface
        self._learned = filled_reference(surface, surface_map)
        # How the surface reads without the smooth field over it, which is added to each row when it is its turn.
        self._level = self._learned.copy()
        self._reference = self._learned.copy()
        self._blocks = Blocks(surface, surface_map)
        self._fields = Fields(surface.valid.shape)
        self._field: Doubles = np.zeros(TERMS)
        self._watch = Watch(self._fields, self._blocks.region)
        self._layers = Layers(surface.sensor, self._blocks.unit_raw)
        self._sunken = Sunken(surface, surface_map)
        self._lying = self._layers.mask
        self._within = (-_WITHIN * self._blocks.unit_raw, _WITHIN * self._blocks.unit_raw)
        self._free = np.zeros(self._blocks.shape, np.bool_)
        self._middles = self._level[MIDDLES].copy()
        self._glance, self._off_share = self._middles[::4, ::4], 1.0
        self._visits = np.full(self._blocks.shape, _KNOWN_WELL, np.float32)
        self._turns = count()
        self._outlook = Outlook()
        self._last_ns: int | None = None
        self._looked_ns: int | None = None
        self._visited_ns = self._began_ns = 0
        self._looks = self._hurried = False
        self._moves = 0
        self._learn_until_ns: int | None = None  # after a move
        self._rays = surface_map.rays[MIDDLES].astype(np.float64)
        self._before_move: Floats | None = None  # what the blocks' middles read then

    @property
    def surface(self) -> Surface:
        """The surface that it began with, or was learned again as after the last move."""
        return self._surface

    @property
    def reference(self) -> Floats:
        """What the surface reads by now (H, W), in the sensor's unit; where it gave no reading, what is around it."""
        return frozen_array(self._reference)

    @property
    def why(self) -> str | None:
        """Why no touch can be seen by now; None if all is well."""
        return self._outlook.why

    @property
    def lost(self) -> bool:
        """Whether it was moved so that it cannot be found again: it must be learned from the beginning."""
        return self._outlook.lost

    @property
    def learning_again(self) -> bool:
        """Whether it is being learned again since it was moved."""
        return self._learn_until_ns is not None

    @property
    def moves(self) -> int:
        """How often it was moved while it was watched."""
        return self._moves

    @property
    def doubtful(self) -> bool:
        """Whether the last picture looks as if the surface was moved, which the next ones must confirm."""
        return self._outlook.doubtful

    @property
    def part_of_surface(self) -> Mask:
        """Where (H, W) a thing has become part of the surface."""
        return frozen_array(self._lying)

    @property
    def slides(self) -> tuple[Slide, ...]:
        """What was pushed in the last picture, of the things that are part of the surface."""
        return self._layers.slides

    def vitals(self) -> Vitals:
        """Return how it has fared."""
        off = self._middles + self._fields.at_blocks(self._field) * self._blocks.unit_raw - self._learned[MIDDLES]
        known = self._blocks.region & ~self._lying[MIDDLES]
        raw = np.rint(self._learned[MIDDLES]).astype(int)
        off_mm = (off * mm_per_raw(self._surface.sensor)[raw])[known]
        drift_mm = float(np.sqrt(np.nanmean(off_mm**2))) if off_mm.size else 0.0
        return Vitals(drift_mm, self._moves)

    def turned(self) -> tuple[Plane, Plane] | None:
        """Return the planes of the surface before and after it was moved; None if it was not, or is not flat.

        From the move on until :meth:`as_learned_again`.
        """
        if self._before_move is None:
            return None
        before, after = (self._plane(read) for read in (self._before_move, self._level_at_middles()))
        return None if before is None or after is None else (before, after)

    def _plane(self, read: Floats) -> Plane | None:
        known = self._blocks.region & ~self._lying[MIDDLES]
        depth = depth_mm(self._surface.sensor, read[known])
        points = self._rays[known] * depth[:, None]
        return fit_plane(points[np.isfinite(depth)])

    def join(self, mask: Mask) -> None:
        """Take in what is seen within a mask (H, W) from now on, averaged over the next pictures in which it is still.

        What was there before is remembered, and is the surface again within a second of its being seen again.
        """
        self._layers.join(mask)

    def hurries(self, frame: Frame) -> bool:
        """Return whether a picture must be looked at before touches are seen in it: it may change what they are."""
        if self._last_ns is None or self._outlook.is_news:
            return True
        paused = frame.t_ns - self._last_ns > _PAUSE_S * 1e9
        self._hurried = self._is_startled(frame.raw) or paused or self._watch.is_jolt(frame.accel_g)
        return self._hurried

    def step(self, frame: Frame, coarse: CoarsePicture) -> list[SurfaceRows]:
        """Look at one picture, and return how the surface reads by now in those rows where it reads differently."""
        seconds = 0.0 if self._last_ns is None else (frame.t_ns - self._last_ns) / 1e9
        if self._last_ns is None or seconds > _PAUSE_S:
            self._began_ns = frame.t_ns
        self._last_ns = frame.t_ns
        changes = self._layers.step(frame.raw, self._reference, seconds) if self._outlook.why is None else []
        rows = [self._changed(change) for change in changes]
        # In turns, as each takes its time; but nothing is put off while there is news.
        self._looks = not self._looks or self._hurried or self._outlook.is_news
        self._hurried = False
        if self._looks:
            self._look(frame, coarse)
        if self._outlook.jump is not None:
            return [self._moved(self._outlook.jump, frame.t_ns)]
        if self._outlook.why is None and (not self._looks or self.learning_again):
            rows += self._visit_some(frame)
            self._learn_until_ns = self._learn_until_ns if self._is_learning_at(frame.t_ns) else None
        return rows

    def whole(self) -> SurfaceRows:
        """Return how all of the surface reads by now."""
        everywhere = slice(0, len(self._level))
        return self._tell(everywhere, self._reading(everywhere))

    def as_learned_again(self, followed: FollowedArea | None) -> Surface:
        """Return the surface as it is by now, without the things on it, and take it for what was learned.

        ``followed``: where the area is since it was moved; None leaves it where it was.
        """
        reference = self._reading(slice(0, len(self._level))) - self._layers.by
        shift = np.rint(reference - self._learned)
        self._learned, self._before_move = reference, None
        self._surface = replace(
            self._surface,
            reference=frozen_array(reference),
            dmax=frozen_array(np.clip(self._surface.dmax + shift, 0, 65535).astype(np.uint16)),
            followed=followed or self._surface.followed,
        )
        return self._surface

    def _level_at_middles(self) -> Floats:
        field = rounded(self._field) * self._blocks.unit_raw
        return self._middles + self._fields.at_blocks(field)

    def _is_startled(self, raw: Image16) -> bool:
        """Return whether much more of the surface reads off than in the picture before, at a glance."""
        off = np.abs(raw[_GLANCE] - self._glance) > _OFF * self._blocks.unit_raw
        before, self._off_share = self._off_share, np.count_nonzero(off) / max(1, off.size)
        return bool(self._off_share > before + _STARTLING)

    def _look(self, frame: Frame, coarse: CoarsePicture) -> None:
        """See how the surface as a whole is, and follow its drift."""
        level = self._level_at_middles()
        sight = self._blocks.look(frame.raw, level, coarse)
        self._outlook = outlook = self._watch.step(sight, frame.t_ns, frame.accel_g)
        seconds, self._looked_ns = (frame.t_ns - (self._looked_ns or frame.t_ns)) / 1e9, frame.t_ns
        self._free = sight.free
        self._glance = level[::4, ::4]
        gone = self._sunken.step(coarse, seconds) if outlook.why is None else None
        if gone is not None:
            self._layers.join(gone)
        if outlook.drift is not None:
            self._field = self._field + min(1.0, seconds / _DRIFT_S) * outlook.drift

    def _is_learning_at(self, t_ns: int) -> bool:
        until_ns = self._learn_until_ns
        return (
            until_ns is not None and t_ns < until_ns and bool((self._visits < _KNOWN_AGAIN)[self._blocks.region].any())
        )

    def _moved(self, jump: Doubles, t_ns: int) -> SurfaceRows:
        size = self._fields.size(jump, self._blocks.region)
        if size > _NO_MOVE and self._before_move is None:
            self._before_move = self._level_at_middles()
        self._field = self._field + jump
        if size > _NO_MOVE:
            self._visits[:] = _KNOWN_BEFORE
            self._learn_until_ns = t_ns + _LEARN_AGAIN_NS
            self._moves += size > _UNSEEN_DRIFT or t_ns - self._began_ns > _JUST_BEGUN_NS
        return self.whole()

    def _changed(self, change: Change) -> SurfaceRows:
        self._lying = self._layers.mask
        self._level[change.window] += change.by
        self._middles = self._level[MIDDLES].copy()
        return self._tell(change.window[0], self._reading(change.window[0]))

    def _visit_some(self, frame: Frame) -> Iterator[SurfaceRows]:
        """Learn the pixels of a few rows of blocks, and tell how they read where that is worth telling."""
        raw, rows = frame.raw, len(self._visits)
        seconds, self._visited_ns = (frame.t_ns - self._visited_ns) / 1e9, frame.t_ns
        least = _ROWS_AFTER_A_MOVE if self.learning_again else 1
        for _ in range(min(rows, _MOST_ROWS, max(least, round(seconds / _SWEEP_S * rows)))):
            row = next(self._turns) % rows
            pixels = slice(row * BLOCK_PX, len(raw) if row == rows - 1 else (row + 1) * BLOCK_PX)
            reading = self._reading(pixels)
            if cv2.norm(reading, self._reference[pixels], cv2.NORM_INF) > _WORTH_TELLING * self._blocks.unit_raw:
                yield self._tell(pixels, reading)
            if self._free[row].any():
                self._learn(row, pixels, raw, reading)

    def _learn(self, row: int, pixels: slice, raw: Image16, reading: Floats) -> None:
        """Learn the pixels of a row of blocks where nothing but the surface is."""
        free = self._free[row]
        self._visits[row] = np.minimum(self._visits[row] + free, _KNOWN_WELL)
        off = np.subtract(raw[pixels], reading)
        # What is off by more is something else, or no reading.
        off *= cv2.inRange(off, *self._within)
        off *= _across(free / np.maximum(self._visits[row], 1.0), raw.shape[1])
        if self._lying[pixels].any():
            off[self._lying[pixels]] = 0.0
        self._level[pixels] += off
        self._middles[row] = self._level[pixels.start + BLOCK_PX // 2, MIDDLES[1]]

    def _reading(self, rows: slice) -> Floats:
        """Return how some rows of the surface read by now (n, W)."""
        field = self._fields.in_rows(rounded(self._field) * self._blocks.unit_raw, rows)
        field += self._level[rows]
        return field

    def _tell(self, rows: slice, reading: Floats) -> SurfaceRows:
        self._reference[rows] = reading
        return SurfaceRows(rows, frozen_array(reading))


def _across(blocks: Floats, width: int) -> Floats:
    """Return a factor for each pixel of a row (W,), given those of its blocks; the last one reaches to the end.

    For products with a mask of OpenCV's.
    """
    pixels = np.empty(width, np.float32)
    wide = len(blocks) * BLOCK_PX
    pixels[:wide] = np.repeat((blocks / _ALL).astype(np.float32), BLOCK_PX)[:width]
    pixels[wide:] = blocks[-1] / _ALL
    return pixels
