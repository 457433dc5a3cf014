"""Where fingertips may be: along the outlines of what stands above the surface.

Two signs tell of one. The outline turns back on itself (a convex end), which shows fingers that stick out. Or what
stands just inside of the outline is lowest there (a dip), which shows a fingertip on the surface beside higher ones.

Outlines have so few points that the number of calls costs, not what is done in them. So all outlines are walked along
at once, and a point of the picture is one complex number, x + iy.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from operator import attrgetter

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import Floats, Image16, Mask

Complexes = NDArray[np.complex64]

_SMOOTH_POINTS = 5
_BLUNTEST_COS = -0.8  # of the angle between an end's two sides, seen from its point
_DIP_RANK = -1.0  # below any end
_TANGENT_POINTS = 4
_DIP_POINTS = 7
_LEFT_TURN = np.complex64(-1j)  # a quarter, as seen in a picture, whose y leads down
_TINY = np.float32(1e-6)  # keeps what has no length from a division by zero


@dataclass(frozen=True, slots=True)
class Outline:
    """The closed outline of one thing (N, 1, 2) in px, drawn at one of the levels, counted from the lowest."""

    points: NDArray[np.int32]
    level: int


@dataclass(frozen=True, slots=True)
class Walk:
    """How outlines are looked at, in px: over which reaches along them for ends, how far inside for dips.

    ``lowest_mm``: what stands higher than this just inside of an outline is no dip.
    """

    reaches: tuple[int, ...]
    inset: float
    lowest_mm: float


@dataclass(frozen=True, slots=True)
class Ends:
    """Places on outlines where a fingertip may end, N of them.

    ``points`` (N, 2) in px, ``back`` (N, 2) unit vectors in the picture into what they are the end of, ``rank`` (N,)
    the better the higher, ``level`` (N,) that of the outline.
    """

    points: Floats
    back: Floats
    rank: Floats
    level: NDArray[np.intp]


def find_ends(outlines: Sequence[Outline], heights: Floats | Image16, walk: Walk) -> Ends:
    """Return the convex ends of all outlines and the dips of those of the lowest level, over heights (H, W) in mm.

    Heights in another unit will do if the walk's ``lowest_mm`` is in the same.
    """
    kept = [outline for outline in outlines if len(outline.points) > 2 * min(walk.reaches)]
    if not kept:
        nowhere = np.zeros((0, 2), np.float32)
        return Ends(nowhere, nowhere, nowhere[:, 0], np.zeros(0, np.intp))
    # Enough for the longest reach, and for what is compared beyond it.
    track = _Track.along(kept, max(walk.reaches) * 3 // 2 + _SMOOTH_POINTS // 2)
    ends, ends_back, ends_rank = _ends(track, walk.reaches)
    dips, dips_back = _dips(track, heights, walk)
    at = np.concatenate((ends, dips))
    back = np.concatenate((ends_back, dips_back))
    back /= np.abs(back) + _TINY
    rank = np.empty(len(at), np.float32)
    rank[: len(ends)], rank[len(ends) :] = ends_rank, _DIP_RANK
    return Ends(_as_pairs(track.points.take(at)), _as_pairs(back), rank, track.level.take(at))


@dataclass(frozen=True, slots=True)
class _Track:
    """All outlines one after the other, the lowest level first, N points in all.

    ``pad`` points of each outline are repeated before its beginning and behind its end, so that slices walk around it.
    ``level`` (N,) is that of the outline; ``pieces`` are where on the track each one begins and ends, repetitions
    included.
    """

    points: Complexes
    level: NDArray[np.intp]
    pieces: list[tuple[int, int]]
    pad: int

    @classmethod
    def along(cls, outlines: Sequence[Outline], pad: int) -> "_Track":
        ordered = sorted(outlines, key=attrgetter("level"))
        parts = [part for outline in ordered for part in _closed(outline.points, pad)]
        row = np.concatenate(parts, dtype=np.float32).reshape(1, -1, 2)
        points = cv2.blur(row, (_SMOOTH_POINTS, 1)).view(np.complex64).ravel()
        level = np.empty(len(points), np.intp)
        pieces: list[tuple[int, int]] = []
        begin = 0
        for outline in ordered:
            end = begin + len(outline.points) + 2 * pad
            level[begin:end] = outline.level
            pieces.append((begin, end))
            begin = end
        return cls(points, level, pieces, pad)

    def own(self, marks: Mask, first: int) -> NDArray[np.intp]:
        """Return which (K,) are set of the marks (..., M) of points from the ``first`` on, but for repetitions.

        The marks of repetitions are cleared in place, those of several rows counted through.
        """
        end_of_own = 0
        for begin, end in self.pieces:
            marks[..., end_of_own : max(begin + self.pad - first, 0)] = False
            end_of_own = max(end - self.pad - first, 0)
        marks[..., end_of_own:] = False
        return marks.ravel().nonzero()[0]


def _closed(points: NDArray[np.int32], pad: int) -> list[NDArray[np.int32]]:
    """Return the parts of an outline with so many of its points repeated at both ends."""
    if len(points) < pad:
        return [points.take(np.arange(-pad, len(points) + pad), axis=0, mode="wrap")]
    return [points[-pad:], points, points[:pad]]


def _ends(track: _Track, reaches: tuple[int, ...]) -> tuple[NDArray[np.intp], Complexes, Floats]:
    """Return where both ways along the outline lead back the same way, most so of all places nearby.

    Returns places on the track, the way back and the rank, all (K,).
    """
    margin = max(reaches)
    here = track.points[margin:-margin]
    count = len(here)
    ahead, behind = np.empty((2, len(reaches), count), np.complex64)
    for row, reach in enumerate(reaches):
        np.subtract(track.points[margin + reach :][:count], here, out=ahead[row])
        np.subtract(track.points[margin - reach :][:count], here, out=behind[row])
    score = _sharpness(ahead, behind)
    best = np.empty_like(score)
    for row, reach in enumerate(reaches):
        for begin, end in track.pieces:
            if end - begin - 2 * track.pad <= 2 * reach:
                score[row, max(begin - margin, 0) : max(end - margin, 0)] = -1.0
        cv2.dilate(score[row : row + 1], _nearby(reach), dst=best[row : row + 1])
    peaks = score >= best
    peaks &= score > _BLUNTEST_COS
    found = track.own(peaks, margin)
    return found % count + margin, ahead.take(found) + behind.take(found), score.take(found)


def _sharpness(ahead: Complexes, behind: Complexes) -> Floats:
    """Return the cosine of the angle between two ways from a point, −1 where the outline is not convex there.

    The product with a conjugate has the cosine in its real part, the sine in its imaginary part, and both lengths as
    its own.
    """
    turn = ahead * behind.conj()
    cos: Floats = turn.real / (np.abs(turn) + _TINY)
    np.putmask(cos, turn.imag <= 0.0, -1.0)
    return cos


def _dips(track: _Track, heights: Floats | Image16, walk: Walk) -> tuple[NDArray[np.intp], Complexes]:
    """Return where what stands just inside of the lowest outlines is lower than nearby: on the track, and inwards."""
    step = _TANGENT_POINTS
    lowest = track.points[: int(track.level.searchsorted(1))]
    inward = (lowest[2 * step :] - lowest[: -2 * step]) * _LEFT_TURN
    inset = inward * (np.float32(walk.inset) / (np.abs(inward) + _TINY))
    places = _as_pairs(lowest[step:-step] + inset)[None]
    inside = cv2.remap(heights, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]
    smooth = cv2.boxFilter(inside, cv2.CV_32F, (_DIP_POINTS, 1))
    low = smooth <= cv2.erode(smooth, _nearby(min(walk.reaches)))
    low &= smooth < walk.lowest_mm
    found = track.own(low, step)
    return found + step, inward.take(found)


@cache
def _nearby(reach: int) -> NDArray[np.uint8]:
    """Return the row of points that a point is compared with: half a reach to both sides."""
    return np.ones((1, 2 * (reach // 2) + 1), np.uint8)


def _as_pairs(points: Complexes) -> Floats:
    """Return complex numbers (N,) as x and y (N, 2)."""
    return points.view(np.float32).reshape(-1, 2)
