"""What stands above the surface without an arm, and whether it lies still or moves by itself."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import dist

import numpy as np

from touchd.hands.lookout import Lookout
from touchd.hands.standing import Indices, Part, Place, Standing

_STILL_MM, _STILL_PX, _STILL_NS = 8.0, 1.0, 90_000_000  # what moves less in so long lies there
_SAME_SIZE = 0.3  # and changes its size by less
_WALK_MM = 45.0  # what moves so far by itself is a hand
_MISSED_NS = 200_000_000
_LEAST_MM2, _LEAST_PX = 400.0, 6  # of a thing; what is smaller is passed over
_SAMPLES = 80


@dataclass(frozen=True, slots=True)
class _Island:
    """An island: where it was first, where it is now, and since when it has been near an ``anchor``.

    ``pixels`` are some of its own, of the flat picture.
    """

    first: Place
    anchor: Place
    now: Place
    size: int
    since_ns: int
    seen_ns: int
    pixels: Indices


@dataclass(frozen=True, slots=True)
class Sorted:
    """The islands of a picture that lie still, and those that walk about."""

    still: list[Part]
    walking: list[Part]


class IslandWatch:
    """Follows islands until it is known what they are."""

    def __init__(self, lookout: Lookout) -> None:
        self._still_px = max(_STILL_PX, lookout.px(_STILL_MM))
        self._walk_px = lookout.px(_WALK_MM)
        self._least_px = max(_LEAST_PX, round(_LEAST_MM2 / lookout.pixel_mm**2))
        self._islands: list[_Island] = []

    @property
    def waits(self) -> bool:
        """Whether there is anything of which it is not known yet what it is."""
        return bool(self._islands)

    def step(self, parts: Sequence[Part], standing: Standing | None, t_ns: int) -> Sorted:
        """Take in the islands of a picture that are no hands'; return those of which it is known by now."""
        sorted_ = Sorted([], [])
        if standing is None or not (parts or self._islands):
            self._islands = []
            return sorted_
        known: list[_Island] = []
        waiting = list(self._islands)
        for part in parts:
            before = next((island for island in waiting if _is(island, part, standing)), None)
            if before is not None:
                waiting.remove(before)
            island = self._followed(before, part, standing, t_ns)
            if dist(island.first, island.now) > self._walk_px:
                sorted_.walking.append(part)
            elif t_ns - island.since_ns >= _STILL_NS and part.pixels >= self._least_px:
                sorted_.still.append(part)
            else:
                known.append(island)
        self._islands = known + [island for island in waiting if t_ns - island.seen_ns <= _MISSED_NS]
        return sorted_

    def _followed(self, before: _Island | None, part: Part, standing: Standing, t_ns: int) -> _Island:
        columns, rows = standing.places(part.label)
        centre = float(columns.mean()), float(rows.mean())
        flat = (rows * np.float32(standing.labels.shape[1]) + columns).astype(np.intp)
        pixels = flat[:: 1 + len(flat) // _SAMPLES]
        if before is None:
            return _Island(centre, centre, centre, part.pixels, t_ns, t_ns, pixels)
        same = abs(part.pixels - before.size) <= _SAME_SIZE * before.size
        if same and dist(before.anchor, centre) <= self._still_px:
            return replace(before, now=centre, seen_ns=t_ns, pixels=pixels)
        return _Island(before.first, centre, centre, part.pixels, t_ns, t_ns, pixels)


def _is(island: _Island, part: Part, standing: Standing) -> bool:
    """Return whether a part is where an island was."""
    return 2 * int(np.count_nonzero(standing.labels.take(island.pixels) == part.label)) > len(island.pixels)
