"""Where fingertips may be: along the outlines of what stands above the surface.

Two signs tell of one. The outline turns back on itself (a convex end), which shows fingers that stick out. Or what
stands just inside of the outline is lowest there (a dip), which shows a fingertip on the surface beside higher ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import Floats, Mask

_SMOOTH_POINTS = 5
_BLUNTEST_COS = -0.25  # of the angle between an end's two sides, seen from its point
_DIP_RANK = -1.0  # below any end
_TANGENT_POINTS = 4
_DIP_POINTS = 7


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


def find_ends(outlines: Sequence[Outline], heights: Floats, walk: Walk) -> Ends:
    """Return the convex ends of all outlines and the dips of those of the lowest level, over heights (H, W) in mm."""
    kept = [outline for outline in outlines if len(outline.points) > 2 * min(walk.reaches)]
    if not kept:
        nowhere = np.zeros((0, 2), np.float32)
        return Ends(nowhere, nowhere, nowhere[:, 0], np.zeros(0, np.intp))
    pad = max(walk.reaches) + _SMOOTH_POINTS
    track = _Track.along(kept, pad)
    found = [_ends(track, reach) for reach in walk.reaches]
    found.append(_dips(track, heights, walk))
    at = np.concatenate([places for places, _, _, _ in found])
    back = np.stack([np.concatenate([x for _, x, _, _ in found]), np.concatenate([y for _, _, y, _ in found])], 1)
    back /= np.hypot(back[:, 0], back[:, 1])[:, None] + np.float32(1e-6)
    rank = np.concatenate([rank for _, _, _, rank in found])
    return Ends(np.stack([track.x[at], track.y[at]], 1), back, rank, track.level[at])


@dataclass(frozen=True, slots=True)
class _Track:
    """All outlines one after the other, each with its own beginning behind its end, so that slices walk around it."""

    x: Floats
    y: Floats
    own: Mask  # not a repetition
    length: NDArray[np.intp]  # of the outline that a point belongs to
    level: NDArray[np.intp]

    @classmethod
    def along(cls, outlines: Sequence[Outline], pad: int) -> "_Track":
        pieces = [cv2.copyMakeBorder(outline.points, pad, pad, 0, 0, cv2.BORDER_WRAP) for outline in outlines]
        sizes = [len(piece) for piece in pieces]
        smooth = cv2.blur(np.concatenate(pieces).astype(np.float32), (1, _SMOOTH_POINTS))
        own = np.zeros(len(smooth), np.bool_)
        begin = 0
        for size in sizes:
            own[begin + pad : begin + size - pad] = True
            begin += size
        return cls(
            x=np.ascontiguousarray(smooth[:, 0, 0]),
            y=np.ascontiguousarray(smooth[:, 0, 1]),
            own=own,
            length=np.repeat([size - 2 * pad for size in sizes], sizes),
            level=np.repeat([outline.level for outline in outlines], sizes),
        )


_Places = tuple[NDArray[np.intp], Floats, Floats, Floats]  # where on the track, back (x and y), rank


def _ends(track: _Track, reach: int) -> _Places:
    """Return where both ways along the outline lead back the same way, most so of all places nearby."""
    here = slice(reach, -reach)
    ax, ay = track.x[2 * reach :] - track.x[here], track.y[2 * reach :] - track.y[here]
    bx, by = track.x[: -2 * reach] - track.x[here], track.y[: -2 * reach] - track.y[here]
    cos = (ax * bx + ay * by) / np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by) + np.float32(1e-6))
    convex = (ax * by < ay * bx) & (track.length[here] > 2 * reach)
    score = np.where(convex, cos, np.float32(-1.0))
    best = cv2.dilate(score[None], np.ones((1, 2 * (reach // 2) + 1), np.uint8))[0]
    at = np.flatnonzero((score >= best) & (score > _BLUNTEST_COS) & track.own[here])
    return at + reach, ax[at] + bx[at], ay[at] + by[at], score[at]


def _dips(track: _Track, heights: Floats, walk: Walk) -> _Places:
    """Return where what stands just inside of the lowest outlines is lower than nearby."""
    step = _TANGENT_POINTS
    here = slice(step, -step)
    inward_x, inward_y = track.y[2 * step :] - track.y[: -2 * step], track.x[: -2 * step] - track.x[2 * step :]
    scale = np.float32(walk.inset) / (np.hypot(inward_x, inward_y) + np.float32(1e-6))
    inside_x, inside_y = track.x[here] + inward_x * scale, track.y[here] + inward_y * scale
    inside = cv2.remap(heights, inside_x, inside_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(1, -1)
    smooth = cv2.blur(inside, (_DIP_POINTS, 1))
    least = cv2.erode(smooth, np.ones((1, 2 * (min(walk.reaches) // 2) + 1), np.uint8))
    low = (smooth <= least) & (smooth < walk.lowest_mm)
    at = np.flatnonzero(low[0] & track.own[here] & (track.level[here] == 0))
    return at + step, inward_x[at], inward_y[at], np.full(len(at), _DIP_RANK, np.float32)
