"""The shapes of arms with their hands in the coarse picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

import numpy as np

from touchd.geometry import Doubles
from touchd.hands.standing import Indices, Place
from touchd.model import Floats

_AHEAD = 2.0  # times the way from a hand's middle to its end, a hand may be that is partly hidden
_STANDS_MM = 5.0  # pixels on the edge of a hand show less of it
_ELBOW, _ELBOW_WIDTH = 0.5, 0.15  # of the way from door to tip


@dataclass(frozen=True, slots=True)
class Limb:
    """An arm and its hand. Places are in px of the coarse picture.

    ``door``: where it comes in over the border, or came in; ``elbow``: half way, but not on the straight line;
    ``tip``: its far end; ``middle``, ``height_mm``: of the hand there.
    """

    door: Place
    elbow: Place
    middle: Place
    tip: Place
    height_mm: float

    @property
    def reach(self) -> float:
        """How far the tip is from the door, in px."""
        return dist(self.door, self.tip)

    def away(self, columns: Floats, rows: Floats) -> Floats:
        """Return how far places (N,) each lie from the arm's middle line, in px; it goes on ahead of the tip."""
        (tip_u, tip_v), (u, v) = self.tip, self.middle
        beyond = tip_u + _AHEAD * (tip_u - u), tip_v + _AHEAD * (tip_v - v)
        return self._from_line(columns, rows, beyond)

    def beside(self, place: Place) -> float:
        """Return how far one place lies from the arm as far as it was seen, in px."""
        return float(self._from_line(np.array([place[0]], np.float32), np.array([place[1]], np.float32), self.tip)[0])

    def _from_line(self, columns: Floats, rows: Floats, end: Place) -> Floats:
        ways = [
            _off_segment(columns, rows, *ends)
            for ends in ((self.door, self.elbow), (self.elbow, self.middle), (self.middle, end))
        ]
        return np.minimum(np.minimum(ways[0], ways[1]), ways[2])

    def off(self, place: Place) -> float:
        """Return how far one place lies from the arm's middle line, in px."""
        return float(self.away(np.array([place[0]], np.float32), np.array([place[1]], np.float32))[0])


@dataclass(frozen=True, slots=True)
class Pixels:
    """Pixels (N,) that belong to arms: their columns and rows, and ``whose`` they are, counted from 0."""

    columns: Floats
    rows: Floats
    whose: Indices

    def of(self, one: int) -> "Pixels":
        """Return the pixels of one arm, as if there were no others."""
        at = (self.whose == one).nonzero()[0]
        return Pixels(self.columns[at], self.rows[at], np.zeros(len(at), np.intp))


def limbs_of(pixels: Pixels, heights_mm: Floats, doors: Sequence[Place], hand_px: float) -> tuple[list[Limb], Indices]:
    """Return the limbs that pixels are, seen from their doors, and which pixels (M,) are the hands'.

    Each door must have a pixel. ``heights_mm`` (rows, columns) are the whole picture's, ``hand_px`` is a hand's length.
    """
    columns, rows, whose, count = pixels.columns, pixels.rows, pixels.whose, len(doors)
    door = np.array(doors, np.float32).reshape(-1, 2)
    way = np.hypot(columns - door[whose, 0], rows - door[whose, 1])
    farthest = np.zeros(count, np.float32)
    np.maximum.at(farthest, whose, way)
    tip = np.zeros(count, np.intp)
    reach = farthest[whose]
    ends = (way >= reach).nonzero()[0]
    tip[whose[ends]] = ends
    tip_u, tip_v = columns[tip], rows[tip]
    at_hand = (np.hypot(columns - tip_u[whose], rows - tip_v[whose]) < hand_px).nonzero()[0]
    at_elbow = (np.abs(way - _ELBOW * reach) <= _ELBOW_WIDTH * reach + 1.0).nonzero()[0]
    middle_u, middle_v = _means(at_hand, whose, count, (columns, rows))
    heights = heights_mm[rows.astype(np.intp), columns.astype(np.intp)]
    (height,) = _means(at_hand[heights[at_hand] > _STANDS_MM], whose, count, (heights,))
    elbow_u, elbow_v = _means(at_elbow, whose, count, (columns, rows))
    limbs = [
        Limb(
            doors[i],
            (elbow_u[i], elbow_v[i]),
            (middle_u[i], middle_v[i]),
            (float(tip_u[i]), float(tip_v[i])),
            height[i],
        )
        for i in range(count)
    ]
    return limbs, at_hand


def _means(chosen: Indices, whose: Indices, count: int, of: Sequence[Floats]) -> list[list[float]]:
    """Return the means of several values (N,) of the chosen pixels, for each limb."""
    group = whose[chosen]
    numbers: Doubles = np.maximum(np.bincount(group, minlength=count), 1).astype(np.float64)
    return [(np.bincount(group, values[chosen], minlength=count) / numbers).tolist() for values in of]


def _off_segment(columns: Floats, rows: Floats, a: Place, b: Place) -> Floats:
    """Return the distances (N,) of places from a segment."""
    du, dv = b[0] - a[0], b[1] - a[1]
    square = np.float32(max(du * du + dv * dv, 1e-6))
    u, v = columns - np.float32(a[0]), rows - np.float32(a[1])
    share = np.clip((u * np.float32(du) + v * np.float32(dv)) / square, np.float32(0.0), np.float32(1.0))
    return np.asarray(np.hypot(u - share * np.float32(du), v - share * np.float32(dv)), np.float32)
