"""Touching or not, over time and in company: what is made of the judge's opinions, from picture to picture."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchd.contacts.company import Standing, company
from touchd.contacts.neighbours import paired
from touchd.contacts.recurrent import Said, Weights, step
from touchd.model import Floats

_FARTHEST_MM = 35.0  # that a finger moves between two pictures
_FORGOTTEN_AFTER = 2  # pictures that do not show it


@dataclass(frozen=True, slots=True)
class Known:
    """A fingertip of a picture before, and the state that it was left in."""

    standing: Standing
    state: Floats


class Beliefs:
    """Remembers the fingertips of the last pictures; ``pixel_mm`` is a pixel's usual size."""

    def __init__(self, pixel_mm: float, weights: Weights) -> None:
        self._reach_px = _FARTHEST_MM / pixel_mm
        self._weights = weights
        self._before: list[Known] = []

    def update(self, now: Sequence[Standing]) -> list[Said]:
        """Return what to think of fingertips by this picture and all before."""
        pairs = paired(_places(now), _places([known.standing for known in self._before]), self._reach_px)
        last = [self._before[pairs[i]] if i in pairs else None for i in range(len(now))]
        said, states = self.think(now, last)
        again = set(pairs.values())
        lost = [
            replace(known, standing=replace(known.standing, unseen=known.standing.unseen + 1))
            for j, known in enumerate(self._before)
            if j not in again and known.standing.unseen < _FORGOTTEN_AFTER
        ]
        self._before = [Known(one, state) for one, state in zip(now, states, strict=True)] + lost
        return said

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


def _places(standing: Sequence[Standing]) -> list[tuple[float, float]]:
    return [(one.seen.u, one.seen.v) for one in standing]
