"""Left or right hand: by the side of the thumb, where all five fingertips show it."""

from collections.abc import Mapping, Sequence
from math import dist

FINGERS = 5
_WIDER = 1.35  # times the gap between ring and little finger, at least, is that between thumb and index finger
_VOTES = 5  # pictures more than of the other side

# x to the right and y down on the surface, in mm.
PlaceMm = tuple[float, float]


def thumb_side(tips_mm: Sequence[PlaceMm], ahead: PlaceMm) -> str | None:
    """Return which hand the five tips are of, palm down; None where no thumb can be told.

    ``ahead``: in which direction its arm points.
    """
    if len(tips_mm) != FINGERS:
        return None
    # From its left to its right, as its owner sees it.
    fan = sorted(tips_mm, key=lambda tip: tip[1] * ahead[0] - tip[0] * ahead[1])
    left_gap, right_gap = dist(fan[0], fan[1]), dist(fan[-2], fan[-1])
    if max(left_gap, right_gap) < _WIDER * min(left_gap, right_gap):
        return None
    return "right" if left_gap > right_gap else "left"


class Thumbs:
    """Remembers what thumbs showed of hands, by their ids."""

    def __init__(self) -> None:
        self._votes: dict[int, int] = {}  # above 0 for a right one

    def step(self, seen: Mapping[int, str | None]) -> None:
        """Take in what one picture shows of each hand that is there."""
        self._votes = {
            hand: self._votes.get(hand, 0) + (side == "right") - (side == "left") for hand, side in seen.items()
        }

    def side_of(self, hand: int) -> str | None:
        """Return "left" or "right", None where no thumb told."""
        votes = self._votes.get(hand, 0)
        if abs(votes) < _VOTES:
            return None
        return "right" if votes > 0 else "left"
