"""One thing that lies on the surface, and what a picture says of it."""

from dataclasses import dataclass
from math import sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.hands.lookout import Lookout
from touchd.hands.standing import Indices, Place, Standing
from touchd.model import CoarsePicture, Floats, Mask

_CORNER_MM = 5.0  # by so much at most the outline's polygon leaves the outline
_SIDE, _BESIDE = np.ones((3, 3), np.uint8), np.ones((5, 5), np.uint8)
_RING = np.ones((7, 7), np.uint8)
_SAMPLES, _SCATTER = 160, 7919  # a prime
_TYPICAL = 0.75
_UNLIKE = 0.6  # of its height: where it is off by more in the mean, it is not
_PLAINLY = 2.5  # standard errors by which another place must look better than its own


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Where a thing stands and how high. Pixels are those of the flat coarse picture.

    ``footprint`` (N,) with ``heights_mm`` (N,); ``ring`` (M,): the pixels around it. ``centre``: (column, row).
    ``some`` (K,) of its pixels, scattered over it, are looked at in every picture; ``edge`` (L,) are of those at its
    edge, which tell that it moves.
    """

    footprint: Indices
    heights_mm: Floats
    ring: Indices
    centre: Place
    some: Indices
    edge: Indices

    @property
    def height_mm(self) -> float:
        """How high it typically is: what a camera beside it sees of its sides is lower."""
        return float(np.quantile(self.heights_mm, _TYPICAL))


@dataclass(frozen=True, slots=True)
class Thing:
    """A thing that has lain still since ``still_ns``, near where its centre was then: ``anchor``.

    A hand over it or beside it does not change that.

    ``outline``: in area coordinates. ``odd_ns``: since when it does not look as it did, None if it does. ``asked_ns``:
    when the surface was asked to take it in, None if it is to be asked. ``taken``: whether it is part of the surface;
    ``slid``: whether it was pushed since, so that the surface is to look at it anew; ``freed``: whether the surface has
    just let it go, for it was taken away. ``covered``: whether something stands over it now. ``is_edge``: whether it is
    but the edge of a thing that the surface took in, which reads otherwise by now.
    """

    object_id: int
    shape: Shape
    outline: tuple[Place, ...]
    height_mm: float
    still_ns: int
    anchor: Place
    odd_ns: int | None = None
    asked_ns: int | None = None
    taken: bool = False
    freed: bool = False
    covered: bool = False
    is_edge: bool = False
    slid: bool = False


@dataclass(frozen=True, slots=True)
class Look:
    """How a thing looks in one picture, in shares of its footprint.

    ``seen``: nothing stands over it there; ``left``: of that, where it is not any more. ``touched``: whether something
    stands over it or beside it.
    """

    seen: float
    left: float
    touched: bool


def shape_of(mask: Mask, heights_mm: Floats) -> Shape:
    """Return the shape of what a mask (rows, columns) shows, over heights of the same size."""
    own = mask.view(np.uint8)
    footprint = np.flatnonzero(own)
    ring = np.flatnonzero(cv2.dilate(own, _RING) != own)
    rows, columns = np.divmod(footprint, mask.shape[1])
    centre = float(columns.mean()), float(rows.mean())
    # Regular steps would miss a push by as little as they skip.
    some = _scattered(len(footprint))
    inner = cv2.erode(own, _SIDE, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    edge = np.flatnonzero(inner.take(footprint) == 0)
    return Shape(footprint, heights_mm.take(footprint), ring, centre, some, edge[_scattered(len(edge))])


def _scattered(count: int) -> Indices:
    """Return which of so many are looked at, if not all."""
    return np.arange(min(_SAMPLES, count)) * _SCATTER % count


def mask_of(footprint: Indices, size: tuple[int, ...]) -> Mask:
    """Return a footprint as a mask (rows, columns)."""
    mask = np.zeros(size, np.bool_)
    mask.ravel()[footprint] = True
    return mask


def grown(mask: Mask, around: NDArray[np.uint8]) -> Mask:
    """Return a mask with the pixels around it, as many as a kernel has."""
    return cv2.dilate(mask.view(np.uint8), around) > 0


def outline_of(shape: Shape, lookout: Lookout) -> tuple[Place, ...]:
    """Return the corners, in area coordinates, of a polygon around a shape; it lies on the surface."""
    mask = mask_of(shape.footprint, lookout.shape).view(np.uint8)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    largest = max(outlines, key=cv2.contourArea)
    corners = cv2.approxPolyDP(largest, max(1.0, lookout.px(_CORNER_MM)), closed=True)
    height_mm = shape.height_mm
    return tuple(lookout.under((float(u), float(v)), height_mm) for u, v in np.reshape(corners, (-1, 2)).tolist())


def look_at(thing: Thing, picture: CoarsePicture, standing: Standing | None) -> Look:
    """Return how a thing looks in a picture; what is as high as it was is not part of what stands there."""
    shape = thing.shape
    at, expected = shape.footprint[shape.some], shape.heights_mm[shape.some]
    seen = picture.readings.take(at)
    touched = False
    if standing is not None:
        seen = seen & (standing.labels.take(at) == 0)
        touched = bool(standing.labels.take(shape.ring).any()) or int(np.count_nonzero(seen)) < len(at) // 2
    heights = picture.heights_mm.take(at)[seen]
    if not heights.size:
        return Look(0.0, 0.0, touched)
    left = float(np.count_nonzero(heights < np.float32(0.4) * expected[seen])) / len(heights)
    return Look(len(heights) / len(at), left, touched)


def moved(shape: Shape, picture: CoarsePicture, reach: int) -> tuple[int, int]:
    """Return by how many columns and rows a shape has moved, at most so many, as its heights show plainly."""
    rows, columns = picture.heights_mm.shape
    at, expected = shape.footprint[shape.edge], shape.heights_mm[shape.edge]
    v, u = np.divmod(at, columns)
    steps = np.arange(-reach, reach + 1)
    down, right = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    there_v, there_u = v[None] + down[:, None], u[None] + right[:, None]
    inside = (there_v >= 0) & (there_v < rows) & (there_u >= 0) & (there_u < columns)
    seen = picture.heights_mm.take(np.where(inside, there_v * columns + there_u, 0))
    off = np.minimum(np.abs(seen - expected), np.maximum(expected, np.float32(10.0)))
    wrong = np.where(inside, off, expected)
    best, stays = int((wrong.mean(axis=1) + np.float32(0.02) * np.hypot(down, right)).argmin()), len(wrong) // 2
    # What is lifted is nowhere; and noise makes one of many places look a little better than its own.
    if float(wrong[best].mean()) > _UNLIKE * float(expected.mean()):
        return 0, 0
    better = wrong[stays] - wrong[best]
    plain = float(better.mean()) > _PLAINLY * float(better.std()) / sqrt(len(better))
    return (int(right[best]), int(down[best])) if plain else (0, 0)


def slid(shape: Shape, before: Mask, now: Mask) -> Shape:
    """Return a shape that went along with a mask (rows, columns), which is grown by a pixel, from before to now."""
    size = now.shape
    (row, column), (now_row, now_column) = (np.argwhere(mask).mean(axis=0) for mask in (before, now))
    v, u = np.divmod(shape.footprint, size[1])
    v, u = (np.rint(at + by).astype(np.intp) for at, by in ((v, now_row - row), (u, now_column - column)))
    inside = (v >= 0) & (v < size[0]) & (u >= 0) & (u < size[1])
    heights = np.zeros(size, np.float32)
    heights[v[inside], u[inside]] = shape.heights_mm[inside]
    grown_by_one = now & (cv2.dilate(heights, _BESIDE) > 0.0)
    own = cv2.erode(grown_by_one.view(np.uint8), _SIDE) > 0
    if not own.any():
        return shape
    return shape_of(own, np.where(heights > 0.0, heights, np.float32(shape.height_mm)))


def is_part(shape: Shape, surface: Mask) -> bool:
    """Return whether most of a thing is in a mask (rows, columns)."""
    return 2 * int(np.count_nonzero(surface.take(shape.footprint))) > len(shape.footprint)
