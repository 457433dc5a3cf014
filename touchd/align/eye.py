"""How far ahead of their touch people aim: from the same points, touched from two sides of the area.

Whoever aims e mm ahead of the touch puts each finger e mm short of the point. From two sides the fingers come from
different directions, so that the two touches of one point lie apart, and that says how much e is.
"""

from dataclasses import dataclass

import numpy as np

from touchd.align.alignment import AlignmentError
from touchd.contacts.aim import EyeOffsets
from touchd.geometry import Doubles

# From opposite sides only the sum of both offsets shows, and from others their difference shows badly: it is held to be
# nothing, with so much weight beside each point's.
_ALIKE = 0.5
_SAME_SIDE_COSINE = 0.5  # fingers that point within 60 degrees of one another come from one side
_MOST_MM, _MOST_APART_MM = 30.0, 15.0


@dataclass(frozen=True, slots=True)
class Round:
    """One round of touches, in mm in camera space: where each point was touched, and where its finger pointed."""

    places_mm: Doubles  # (N, 3)
    towards: Doubles  # (N, 3), of length 1


@dataclass(frozen=True, slots=True)
class Aim:
    """What two rounds say: the points that were meant, and how far ahead of its touches each round aimed."""

    meant_mm: Doubles  # (N, 3)
    ahead_mm: tuple[float, float]


def solve_aim(first: Round, second: Round) -> Aim:
    """Return what was meant in two rounds over the same points.

    Raises AlignmentError where both came from one side, or touched other points.
    """
    count = len(first.places_mm)
    if float(_mean(first.towards) @ _mean(second.towards)) > _SAME_SIDE_COSINE:
        raise AlignmentError(
            "both rounds were touched from the same side of the table; align again, and go round it after the first"
        )
    # Per point: place + ahead · towards is the same in both rounds.
    sides = np.stack([first.towards.ravel(), -second.towards.ravel()], axis=1)
    apart = (second.places_mm - first.places_mm).ravel()
    alike = _ALIKE * float(np.sqrt(count)) * np.array([[1.0, -1.0]])
    ahead, *_ = np.linalg.lstsq(np.concatenate([sides, alike]), np.append(apart, 0.0), rcond=None)
    one, other = ahead.tolist()
    meant = first.places_mm + one * first.towards, second.places_mm + other * second.towards
    off_mm = float(np.sqrt(np.mean(np.sum((meant[0] - meant[1]) ** 2, axis=1))))
    if max(abs(one), abs(other)) > _MOST_MM or off_mm > _MOST_APART_MM:
        raise AlignmentError(
            f"the touches from the two sides are {_apart_mm(first, second):.0f} mm apart, more than aim explains; "
            "align again, and touch exactly the same points from both sides"
        )
    return Aim((meant[0] + meant[1]) / 2.0, (one, other))


def offsets_by_side(aim: Aim, rounds: tuple[Round, Round], corners_mm: Doubles) -> EyeOffsets:
    """Return the offsets for the area with these corners (4, 3), top-left first, clockwise.

    Sides that nobody touched from get the mean of the others: people there are likely to aim no better.
    """
    a, b, c, d = corners_mm
    right, down = _unit(b + c - a - d), _unit(c + d - a - b)
    found: dict[str, float] = {}
    for ahead_mm, touched in zip(aim.ahead_mm, rounds, strict=True):
        towards = _mean(touched.towards)
        found[_side(float(towards @ right), float(towards @ down))] = ahead_mm
    other_mm = sum(found.values()) / len(found)
    return EyeOffsets(*(found.get(side, other_mm) for side in ("bottom", "top", "left", "right")))


def _side(right: float, down: float) -> str:
    """Return from which side a finger with these components comes."""
    if abs(down) >= abs(right):
        return "bottom" if down < 0.0 else "top"
    return "left" if right > 0.0 else "right"


def _mean(towards: Doubles) -> Doubles:
    return _unit(towards.sum(axis=0))


def _unit(vector: Doubles) -> Doubles:
    unit: Doubles = vector / max(float(np.linalg.norm(vector)), 1e-9)
    return unit


def _apart_mm(first: Round, second: Round) -> float:
    return float(np.linalg.norm(first.places_mm - second.places_mm, axis=1).mean())
