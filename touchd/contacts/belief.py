"""Touching or not, over time: the odds of each fingertip, carried from picture to picture.

A hidden Markov model of two states. Between two pictures a finger comes down or lifts with a small chance; each
picture then tells by what factor its odds of touching change. So a plain sight decides at once, doubtful ones add up,
and a single odd one ends nothing.
"""

from collections.abc import Sequence
from math import exp, log

from touchd.contacts.neighbours import Places, paired

_COMES_DOWN, _LIFTS = 0.15, 0.15  # the chance of it from one picture to the next
_UNSEEN = -1.1  # log odds of a fingertip that was not seen before
_TRUST = 0.9  # in a picture: neighbouring ones err in the same way, and so tell less than each alone
_MOST = 6.0  # log odds that one picture can tell
_FARTHEST_MM = 35.0  # that a finger moves between two pictures
_FORGOTTEN_AFTER = 2  # pictures that do not show it


class Beliefs:
    """Remembers how likely each fingertip of the last pictures was to touch; ``pixel_mm`` is a pixel's usual size."""

    def __init__(self, pixel_mm: float) -> None:
        self._reach_px = _FARTHEST_MM / pixel_mm
        self._before: list[tuple[Sequence[float], float, int]] = []

    def update(self, places: Places, odds: Sequence[float]) -> list[float]:
        """Return the log odds (N,) that fingertips seen at N places (u, v) touch, by this picture and all before."""
        pairs = paired(places, [place for place, _, _ in self._before], self._reach_px)
        now = []
        for i, told in enumerate(odds):
            before = _after_a_frame(self._before[pairs[i]][1]) if i in pairs else _UNSEEN
            now.append(before + _TRUST * min(max(told, -_MOST), _MOST))
        known = set(pairs.values())
        lost = [
            (place, _after_a_frame(belief), unseen + 1)
            for j, (place, belief, unseen) in enumerate(self._before)
            if j not in known and unseen < _FORGOTTEN_AFTER
        ]
        self._before = [(place, belief, 0) for place, belief in zip(places, now, strict=True)] + lost
        return now


def _after_a_frame(log_odds: float) -> float:
    """Return the log odds of touching a picture later, before looking."""
    touching = 1.0 / (1.0 + exp(-log_odds))
    then = touching * (1.0 - _LIFTS) + (1.0 - touching) * _COMES_DOWN
    return log(then / (1.0 - then))
