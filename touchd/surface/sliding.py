"""Things that are part of the surface and are pushed: where they have slid to, and how they have turned.

Its edge tells: where it was the surface below shows, and where it came to it stands. Moves of the edge are tried until
one explains the picture.
"""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import COARSE_PX, Floats, Image16, Mask, Sensor
from touchd.surface.joining import Change, Window

Indices: TypeAlias = NDArray[np.intp]

# The edge is looked at in so many places, of which few are higher than so many times this quantile of its heights: what
# is tall shows other sides of itself as it moves.
_SAMPLES, _TALL_SAMPLES, _LOW_RANK, _LOW = 240, 60, 0.4, 2.0
_FEWEST, _SCATTER = 30, 7919  # a prime
_WAVERS, _BAND = np.ones((3, 3), np.uint8), np.ones((9, 9), np.uint8)  # an outline wavers; what is within is looked at
# So much more of the edge than usually reads as the surface below; what is usual at first, and is forgotten of that.
_BARE_SHARE, _BARE_AT_FIRST, _FORGETS = 0.06, 0.1, 0.02
_REACH_PX = 6  # from one picture to the next
_TURNS_DEG = (-2.0, -1.0, 1.0, 2.0)
_FAR, _PX_PER_DEG = 0.002, 2.0  # of two moves that explain as much, the smaller one
# Standard errors, and what share of its height, by which another place must look better; errors for a turn to do so.
_PLAINLY, _SHARE, _PLAINLY_TURNED = 4.0, 0.04, 2.5
_UNLIKE = 0.5  # of its height: where it is off by more in the mean, it is not
_STAYS = np.zeros((1, 3), np.float32)
_HOLES = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class Pose:
    """How far a thing has slid, in px that the surface has in the picture, and turned about its middle."""

    right_px: float = 0.0
    down_px: float = 0.0
    turn_deg: float = 0.0

    def moved(self, right_px: float, down_px: float, turn_deg: float) -> "Pose":
        """Return it after one more move."""
        return Pose(self.right_px + right_px, self.down_px + down_px, self.turn_deg + turn_deg)


class _Points(NamedTuple):
    """Pixels of a thing (N,): where they would be seen if they lay on the surface, from the lens's axis, in px.

    ``nearer``: how many times nearer to the camera than the surface they are. So much more they move in the picture.
    """

    u: Floats
    v: Floats
    nearer: Floats


class Sliding:
    """Watches one thing."""

    def __init__(self, sensor: Sensor, rise: Change, own: Mask, reference: Floats, flat_raw: float) -> None:
        """``rise``: what the thing changes of the surface, which reads ``reference`` (H, W) with it.

        ``own``: its mask within the rise's window. What is no higher than ``flat_raw`` cannot be told.
        """
        self._readable = np.isfinite(sensor.to_mm)
        self._to_mm = np.nan_to_num(sensor.to_mm, nan=1.0)
        self._axis = sensor.intrinsics.cx, sensor.intrinsics.cy
        edge = _edge_of(rise.by, flat_raw)
        # The nearest last: they hide what is behind them.
        whole = np.nonzero((rise.by != 0.0) | own)
        order = np.argsort(-rise.by[whole], kind="stable")
        whole = whole[0][order], whole[1][order]
        self._edge, self._edge_by = self._points(edge, rise, reference), rise.by[edge]
        self._whole, self._whole_by, self._whole_own = self._points(whole, rise, reference), rise.by[whole], own[whole]
        self._middle = (float(self._edge.u.mean()), float(self._edge.v.mean())) if len(edge[0]) else (0.0, 0.0)
        self._pose = Pose()
        self._here: Indices | None = None  # where its edge is by now, in the flat picture
        self._usual: float | None = None  # what share of that reads as the surface below

    def step(self, raw: Image16, reference: Floats, now: Change) -> tuple[Change, Mask] | None:
        """Return what the thing changes of the surface, and its mask there, where a picture (H, W) shows it pushed.

        None where it was not. ``reference`` (H, W): how the surface reads with all that lies on it; ``now``: by how
        much it does so for this thing.
        """
        if len(self._edge_by) < _FEWEST or not self._is_bared(raw, reference):
            return None
        below = reference.copy()
        below[now.window] -= now.by
        pose = self._pushed(raw, below)
        if pose is None:
            return None
        self._pose, self._here = pose, None
        return self._drawn(raw.shape)

    def _points(self, pixels: tuple[Indices, Indices], rise: Change, reference: Floats) -> _Points:
        """Return pixels of the rise's window, given by rows and columns."""
        rows, columns = (at + side.start for at, side in zip(pixels, rise.window, strict=True))
        with_it = reference[rows, columns]
        mm, below_mm = (
            self._to_mm.take(raw.astype(np.int32), mode="clip") for raw in (with_it, with_it - rise.by[pixels])
        )
        nearer = (below_mm / mm).astype(np.float32)
        u, v = (columns - np.float32(self._axis[0])) / nearer, (rows - np.float32(self._axis[1])) / nearer
        return _Points(u.astype(np.float32), v.astype(np.float32), nearer)

    def _is_bared(self, raw: Image16, reference: Floats) -> bool:
        """Return whether more of its edge reads as the surface below than usually."""
        if self._here is None:
            self._here = self._seen_at(self._edge, _STAYS, raw.shape)[0]
        seen = raw.take(self._here)
        read = self._readable.take(seen, mode="clip")
        bare = read & np.greater(seen - reference.take(self._here), np.float32(-0.5) * self._edge_by)
        share = int(np.count_nonzero(bare)) / max(1, int(np.count_nonzero(read)))
        usual = min(share, _BARE_AT_FIRST) if self._usual is None else self._usual
        self._usual = usual + _FORGETS * (share - usual)
        return share > usual + _BARE_SHARE

    def _pushed(self, raw: Image16, below: Floats) -> Pose | None:
        """Return where it is by now, if the picture shows it plainly at another place; ``below``: without it."""
        steps = np.arange(-_REACH_PX, _REACH_PX + 1, dtype=np.float32)
        down, right = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
        slides = np.stack([right, down, np.zeros_like(right)], axis=1)
        off = self._off(slides, raw, below)
        stays, slid = off[len(off) // 2], _best(slides, off)
        turns = np.array([(u, v, turn) for turn in _TURNS_DEG for u in (-1, 0, 1) for v in (-1, 0, 1)], np.float32)
        turns[:, :2] += slides[slid, :2]
        off_turned = self._off(turns, raw, below)
        turned = _best(turns, off_turned)
        move, left = slides[slid], off[slid]
        if _is_plain(left - off_turned[turned], _PLAINLY_TURNED, 0.0):
            move, left = turns[turned], off_turned[turned]
        if not _is_plain(stays - left, _PLAINLY, _SHARE) or float(left.mean()) > _UNLIKE:
            return None
        right_px, down_px, turn_deg = move.tolist()
        return self._pose.moved(right_px, down_px, turn_deg)

    def _off(self, moves: Floats, raw: Image16, below: Floats) -> Floats:
        """Return by how much of its height (K, N), 1 at most, the edge reads otherwise than after each of the moves."""
        at = self._seen_at(self._edge, moves, raw.shape)
        seen = raw.take(at)
        off = np.minimum(np.abs((seen - below.take(at)) / self._edge_by - np.float32(1.0)), np.float32(1.0))
        return np.where(self._readable.take(seen, mode="clip"), off, np.float32(0.5))

    def _seen_at(self, points: _Points, moves: Floats, shape: tuple[int, ...]) -> Indices:
        """Return where in the flat picture (K, N) points are seen after each of the moves (K, 3) from its pose."""
        rows, columns = self._places(points, moves)
        height, width = shape
        return (np.clip(rows, 0, height - 1) * width + np.clip(columns, 0, width - 1)).astype(np.intp)

    def _places(self, points: _Points, moves: Floats) -> tuple[Floats, Floats]:
        """Return rows and columns (K, N) of points after each of the moves (K, 3: right, down, turn) from its pose."""
        turn = np.radians(self._pose.turn_deg + moves[:, 2:])
        c, s = np.cos(turn), np.sin(turn)
        u, v = points.u - np.float32(self._middle[0]), points.v - np.float32(self._middle[1])
        x = c * u - s * v + np.float32(self._middle[0] + self._pose.right_px) + moves[:, :1]
        y = s * u + c * v + np.float32(self._middle[1] + self._pose.down_px) + moves[:, 1:2]
        return np.rint(y * points.nearer + self._axis[1]), np.rint(x * points.nearer + self._axis[0])

    def _drawn(self, shape: tuple[int, ...]) -> tuple[Change, Mask]:
        """Return the thing where it is by now."""
        rows, columns = (at[0].astype(np.intp) for at in self._places(self._whole, _STAYS))
        window = _window(rows, columns, shape)
        rows, columns = rows - window[0].start, columns - window[1].start
        size = window[0].stop - window[0].start, window[1].stop - window[1].start
        kept = (rows >= 0) & (rows < size[0]) & (columns >= 0) & (columns < size[1])
        by, own = np.zeros(size, np.float32), np.zeros(size, np.uint8)
        by[rows[kept], columns[kept]] = self._whole_by[kept]
        own[rows[kept], columns[kept]] = self._whole_own[kept]
        # What turns or comes nearer leaves pixels between its own.
        filled = np.asarray(cv2.morphologyEx(by, cv2.MORPH_OPEN, _HOLES), np.float32)
        return Change(window, filled), cv2.morphologyEx(own, cv2.MORPH_CLOSE, _HOLES) > 0


def _edge_of(by: Floats, flat_raw: float) -> tuple[Indices, Indices]:
    """Return rows and columns of some pixels just within a thing's edge."""
    tall = np.less(by, -flat_raw).view(np.uint8)
    within, deep = (cv2.erode(tall, size, borderType=cv2.BORDER_CONSTANT, borderValue=0) for size in (_WAVERS, _BAND))
    rows, columns = np.nonzero(np.greater(within, deep))
    heights = -by[rows, columns]
    if heights.size:
        is_low = heights <= _LOW * np.quantile(heights, _LOW_RANK)
        some = np.concatenate([_scattered(is_low, _SAMPLES), _scattered(~is_low, _TALL_SAMPLES)])
        rows, columns = rows[some], columns[some]
    return rows, columns


def _scattered(which: Mask, most: int) -> Indices:
    """Return some of those in a mask (N,), at most so many."""
    every = np.flatnonzero(which)
    return every[np.arange(min(most, len(every))) * _SCATTER % max(1, len(every))]


def _best(moves: Floats, off: Floats) -> int:
    """Return which of moves (K, 3) leaves least off (K, N)."""
    far = np.hypot(moves[:, 0], moves[:, 1]) + np.float32(_PX_PER_DEG) * np.abs(moves[:, 2])
    return int((off.mean(axis=1) + np.float32(_FAR) * far).argmin())


def _is_plain(better: Floats, errors: float, share: float) -> bool:
    """Return whether what is better at each point (N,) is so by so many standard errors in the mean, and by a share."""
    mean, error = float(better.mean()), float(better.std()) / sqrt(len(better))
    return mean > max(errors * error, share)


def _window(rows: Indices, columns: Indices, shape: tuple[int, ...]) -> Window:
    """Return the window around pixels, as far as it is in the picture, its edges at multiples of ``COARSE_PX``."""
    sides = []
    for places, size in zip((rows, columns), shape, strict=True):
        limit = size // COARSE_PX
        first, last = int(places.min()), int(places.max()) + 1
        begin = min(max(first // COARSE_PX, 0), limit)
        sides.append(slice(begin * COARSE_PX, min(max(-(-last // COARSE_PX), begin), limit) * COARSE_PX))
    return sides[0], sides[1]
