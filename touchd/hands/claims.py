"""Which parts of what stands above the surface are an arm that was there before."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

import numpy as np

from touchd.hands.limb import Limb, Pixels, limbs_of
from touchd.hands.lookout import Lookout
from touchd.hands.standing import Indices, Place, Standing
from touchd.hands.unattached import upper_end

_DOOR_MM = 90.0  # an arm comes in at most so far from where it did in the last picture
_GAP_MM = 45.0  # a hand is at most so far from the end of its arm; a thing left behind is farther
_HELD_SHARE = 0.25  # of a hand's pixels must still be there
_ENTERED_SHARE = 0.05  # of an arm's
_HAND_MM = 28.0  # a hand rises higher somewhere
_AT_BORDER_MM = 40.0  # a hand so near to the border needs no arm in the picture


@dataclass(frozen=True, slots=True)
class Traces:
    """Where arms were in the last picture.

    ``pixels`` (N,) of the flat picture; ``whose`` (N,) they were, counted through ``arms``' keys; and ``at_hand``
    (M,), which of them were a hand's.
    """

    arms: tuple[int, ...]
    pixels: Indices
    whose: Indices
    at_hand: Indices

    def overlaps(self, standing: Standing) -> dict[int, tuple[list[int], list[int]]]:
        """Return how many pixels of each arm, and of its hand, have which label now."""
        shape = len(self.arms), standing.count
        now = self.whose * standing.count + standing.labels.take(self.pixels)
        of_all, of_hand = (
            np.bincount(chosen, minlength=shape[0] * shape[1]).reshape(shape).tolist()
            for chosen in (now, now[self.at_hand])
        )
        return dict(zip(self.arms, zip(of_all, of_hand, strict=True), strict=True))


NO_TRACES = Traces((), np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros(0, np.intp))


class Claims:
    """Decides for one surface what is the same arm."""

    def __init__(self, lookout: Lookout, hand_px: float) -> None:
        self._lookout = lookout
        self._hand_px = hand_px

    def of(self, limb: Limb, of_all: Sequence[int], of_hand: Sequence[int], standing: Standing) -> list[int]:
        """Return the labels of the parts that an arm is in: where its hand was, and where it comes in.

        ``of_all``, ``of_hand``: how many of its pixels, and of its hand's, have which label now.
        """
        parts = standing.parts
        held = max(parts, key=lambda label: of_hand[label])
        if of_hand[held] <= _HELD_SHARE * sum(of_hand):
            held = 0
        near, least = self._lookout.px(_DOOR_MM), _ENTERED_SHARE * sum(of_all)
        entered = [
            label
            for label, part in parts.items()
            if of_all[label] > least and any(dist(door, limb.door) < near for door in part.doors)
        ]
        if held in entered:
            return [held]
        if entered:
            most = max(entered, key=lambda label: of_all[label])
            if not held or parts[held].doors or self.is_left(most, held, limb.door, standing):
                return [most]
            return [held, most]
        islands = [label for label in parts if of_all[label] > least and not parts[label].doors]
        led = [label for label in islands if self.is_led(label, standing)] if len(islands) > 1 else []
        if led and held not in led:
            return [max(led, key=lambda label: of_all[label])]
        return [held] if held else []

    def at_door(self, limb: Limb, standing: Standing) -> list[int]:
        """Return the label of the part that comes in where an arm did."""
        doors = [(dist(door, limb.door), label) for label, part in standing.parts.items() for door in part.doors]
        distance, label = min(doors, default=(0.0, 0))
        return [label] if label and distance < self._lookout.px(_DOOR_MM) else []

    def is_left(self, arm: int, held: int, door: Place, standing: Standing) -> bool:
        """Return whether an arm ends too far from an island for that to be its hand."""
        columns, rows = standing.places(arm)
        alone = Pixels(columns, rows, np.zeros(len(rows), np.intp))
        (limb,), _ = limbs_of(alone, standing.picture.heights_mm, [door], self._hand_px)
        columns, rows = standing.places(held)
        away = np.hypot(columns - np.float32(limb.tip[0]), rows - np.float32(limb.tip[1]))
        return float(away.min()) > self._lookout.px(_GAP_MM)

    def way_in(self, before: Place, labels: Sequence[int], standing: Standing) -> "WayIn":
        """Return how an arm in parts comes in, that did at a place before; the first of its parts is its hand's."""
        doors = [door for label in labels for door in standing.parts[label].doors]
        if doors:
            door = nearest(doors, before)
            return WayIn(door, _height_mm(door, standing), connected=True, led=True)
        dark = standing.dark_doors(labels[0])
        if dark:
            return WayIn(nearest(dark, before), 0.0, connected=False, led=True)
        if self._is_at_border(labels[0], standing):
            return WayIn(before, 0.0, connected=False, led=True)
        upper = upper_end(labels[0], standing, self._lookout)
        if upper is not None:
            return WayIn(upper, _height_mm(upper, standing), connected=False, led=True)
        return WayIn(before, 0.0, connected=False, led=False)

    def is_led(self, label: int, standing: Standing) -> bool:
        """Return whether an arm may lead to an island, one of which there are no readings, or is the island."""
        return (
            self._is_at_border(label, standing)
            or bool(standing.dark_doors(label))
            or upper_end(label, standing, self._lookout) is not None
        )

    def is_sleeved(self, label: int, standing: Standing) -> bool:
        """Return whether an island that nobody knows is a hand to which a dark sleeve leads."""
        return float(standing.heights(label).max()) > _HAND_MM and bool(standing.dark_doors(label))

    def _is_at_border(self, label: int, standing: Standing) -> bool:
        columns, rows = standing.places(label)
        whole = self._lookout.window
        gaps = (
            columns.min() - whole.left,
            rows.min() - whole.top,
            whole.right - 1.0 - columns.max(),
            whole.bottom - 1.0 - rows.max(),
        )
        return float(min(gaps)) < self._lookout.px(_AT_BORDER_MM)


@dataclass(frozen=True, slots=True)
class WayIn:
    """How an arm comes in: at a ``door``, so high above the surface if it is seen there.

    ``connected``: seen to come in over the border. ``led``: or something dark is seen that does, and hides the arm, or
    the arm itself ends in the picture.
    """

    door: Place
    height_mm: float
    connected: bool
    led: bool


def _height_mm(door: Place, standing: Standing) -> float:
    return max(0.0, float(standing.heights_mm[round(door[1]), round(door[0])]))


def nearest(doors: Sequence[Place], place: Place) -> Place:
    """Return the door that is nearest to a place."""
    return min(doors, key=lambda door: dist(door, place))
