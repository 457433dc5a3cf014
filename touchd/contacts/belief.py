"""Touching or not, over time and in company: what is made of the judge's opinions, from picture to picture."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchd.contacts.company import Standing, company
from touchd.contacts.recurrent import Said, Weights, step
from touchd.model import Floats

_FARTHEST_MM = 35.0  # that a finger moves between two pictures
_DOUBTED_MM = 12.0  # so much farther counts what was taken for no fingertip
_FORGOTTEN_AFTER = 2  # pictures that do not show it
# A network may make much of what it never saw: log odds lie at most so far above the best that the judge gave lately,
# which counts so much less in each picture.
_BEYOND, _FADES = 3.0, 1.0


@dataclass(frozen=True, slots=True)
class Known:
    """A fingertip of a picture before, the state that it was left in, and what was said of it.

    ``way_px``: how far it moved from the picture before that one, in u and v. ``shown_odds``: the judge's best of
    touching lately.
    """

    standing: Standing
    state: Floats
    said: Said
    way_px: tuple[float, float]
    shown_odds: float

    @property
    def place_px(self) -> tuple[float, float]:
        """Where it was."""
        return self.standing.seen.u, self.standing.seen.v

    @property
    def expected_px(self) -> tuple[float, float]:
        """Where it is by now if it goes on as it did."""
        (u, v), (du, dv), pictures = self.place_px, self.way_px, self.standing.unseen + 1
        return u + du * pictures, v + dv * pictures


@dataclass(frozen=True, slots=True)
class Belief:
    """What is said of a fingertip, and what was known of it before, if it was seen before."""

    said: Said
    before: Known | None


class Beliefs:
    """Remembers the fingertips of the last pictures; ``pixel_mm`` is a pixel's usual size."""

    def __init__(self, pixel_mm: float, weights: Weights) -> None:
        self._reach_px = _FARTHEST_MM / pixel_mm
        self._doubted_px = _DOUBTED_MM / pixel_mm
        self._weights = weights
        self._before: list[Known] = []

    def update(self, now: Sequence[Standing]) -> list[Belief]:
        """Return what to think of fingertips by this picture and all before."""
        pairs = self._pairs(now)
        last = [self._before[pairs[i]] if i in pairs else None for i in range(len(now))]
        thought, states = self.think(now, last)
        shown = [_shown_odds(one, known) for one, known in zip(now, last, strict=True)]
        said = [replace(one, odds=min(one.odds, odds + _BEYOND)) for one, odds in zip(thought, shown, strict=True)]
        again = set(pairs.values())
        lost = [
            replace(known, standing=replace(known.standing, unseen=known.standing.unseen + 1))
            for j, known in enumerate(self._before)
            if j not in again and known.standing.unseen < _FORGOTTEN_AFTER
        ]
        self._before = [
            Known(one, state, told, _way_px(one, known), odds)
            for one, state, told, known, odds in zip(now, states, said, last, shown, strict=True)
        ] + lost
        return [Belief(told, known) for told, known in zip(said, last, strict=True)]

    def _pairs(self, now: Sequence[Standing]) -> dict[int, int]:
        """Return which of those now are which of those before, where they were or went."""
        limit, doubted = self._reach_px**2, self._doubted_px**2
        places = [(one.seen.u, one.seen.v) for one in now]
        near = []
        for j, known in enumerate(self._before):
            handicap = doubted if known.said.finger_odds < 0.0 else 0.0
            (stays_u, stays_v), (goes_u, goes_v) = known.place_px, known.expected_px
            for i, (u, v) in enumerate(places):
                stayed = (stays_u - u) * (stays_u - u) + (stays_v - v) * (stays_v - v)
                went = (goes_u - u) * (goes_u - u) + (goes_v - v) * (goes_v - v)
                least = min(stayed, went)
                if least < limit:
                    near.append((least + handicap, i, j))
        pairs: dict[int, int] = {}
        for _, i, j in sorted(near):
            if i not in pairs and j not in pairs.values():
                pairs[i] = j
        return pairs

    def think(self, now: Sequence[Standing], last: Sequence[Known | None]) -> tuple[list[Said], Floats]:
        """Return what is said of N fingertips, given those that they were before, and their states (N, S)."""
        states = np.zeros((len(now), self._weights.state_size), np.float32)
        if not now:
            return [], states
        for i, known in enumerate(last):
            if known is not None:
                states[i] = known.state
        inputs, hearing = company(now, [None if known is None else known.standing for known in last])
        return step(self._weights, inputs, states, hearing)


def _shown_odds(one: Standing, known: Known | None) -> float:
    """Return the best log odds of touching that the judge gave a fingertip lately."""
    now = one.seen.opinion.odds
    return now if known is None else max(now, known.shown_odds - _FADES)


def _way_px(one: Standing, known: Known | None) -> tuple[float, float]:
    """Return how far a fingertip moved in a picture, if it was seen before."""
    if known is None:
        return 0.0, 0.0
    (u, v), pictures = known.place_px, known.standing.unseen + 1
    return (one.seen.u - u) / pictures, (one.seen.v - v) / pictures
