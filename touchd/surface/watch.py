"""Watches whether a surface is still where it was: drift, a knock, a camera that is covered."""

from dataclasses import dataclass
from math import dist

import numpy as np

from touchd.geometry import Doubles
from touchd.model import Mask
from touchd.surface.drift import OUTLIER, Fields
from touchd.surface.sight import Sight

WHY_MOVED = "the camera or the table was moved: learning the surface again as soon as enough of it is empty"
WHY_BLIND = "the camera sees next to nothing of the surface: is it covered, blinded by light, or switched off?"
WHY_COVERED = "something is close before the camera and hides the surface: take it away"

# A smooth change of this size from one picture to the next is no drift, which is caught up with far sooner; in units
# of noise. From the second on, or where less than the share is free, it is worth a closer look, and a closer one from
# the third on. What moves on by the last is not yet at rest.
_MOVED, _SUSPICIOUS, _STRIKING, _STEADY = 0.35, 0.1, 0.25, 0.15
_FREE = 0.5
_IN_A_ROW = 2  # pictures that say so
# Once found, an empty surface must be at rest for so long, one with something on or over it for longer.
_AT_REST_NS, _AT_REST_BELOW_NS = 200_000_000, 2_000_000_000
_STANDING, _EMPTY = 3.0, 0.005  # what stands there is nearer by so much, over no more than a share of it
_LOST_NS = 5_000_000_000
# Shares of the surface: less than the first in its place is worth a closer look, less than the second and it is not
# here; so much that agrees is a surface; so much hidden, and so much of that unreadable.
_IN_PLACE, _GONE = 0.5, 0.1
_AGREES, _ALIKE = 0.6, 1.2
_HIDDEN, _BLIND = 0.85, 0.5
# The pull of gravity as the camera feels it, in g: a jolt, and another way of hanging.
_JOLT_G, _TURNED_G = 0.2, 0.05
_RESTING_SHARE, _HANGING_SHARE = 0.25, 0.01


@dataclass(frozen=True, slots=True)
class Outlook:
    """What a picture says of the surface as a whole.

    ``why``: why no touch can be seen by now, None if all is well. ``drift``: the smooth change to follow little by
    little. ``jump``: the change to take over at once, as the surface has come to rest elsewhere. ``lost``: it has been
    moved so that it cannot be found again. ``doubtful``: it seems to be moved, which is not sure yet.
    """

    why: str | None = None
    drift: Doubles | None = None
    jump: Doubles | None = None
    lost: bool = False
    doubtful: bool = False

    @property
    def is_news(self) -> bool:
        """Whether the next picture should be looked at, too."""
        return self.drift is None


class Watch:
    """Watches one surface, picture by picture."""

    def __init__(self, fields: Fields, region: Mask) -> None:
        """``region``: the blocks (rows, columns) of the surface."""
        self._fields = fields
        self._blocks = max(1, int(region.sum()))
        self._hints = _Streak()
        self._hidden = _Streak()
        self._gravity = _Gravity()
        self._search: _Search | None = None

    def step(self, sight: Sight, t_ns: int, accel_g: tuple[float, float, float] | None) -> Outlook:
        """Return what one picture says."""
        jolted = self._gravity.jolted(accel_g)
        if self._search is None:
            if not jolted:
                return self._watch(sight, t_ns)
            self._search = _Search(self._fields, self._blocks, t_ns)
        outlook = self._search.step(sight, t_ns)
        if outlook.jump is not None:
            self._search = None
            self._hints, self._hidden = _Streak(), _Streak()
            self._gravity = _Gravity()
        return outlook

    def is_jolt(self, accel_g: tuple[float, float, float] | None) -> bool:
        """Return whether the camera feels a jolt, if it can; nothing is taken in."""
        return self._gravity.is_jolt(accel_g)

    def _watch(self, sight: Sight, t_ns: int) -> Outlook:
        free = sight.free & sight.readable
        drift, size = self._fields.small(sight.off, free)
        hint, why = False, None  # that it was moved, and what hides it
        if size > _SUSPICIOUS or np.count_nonzero(free) < _FREE * self._blocks:
            # What moved may stand out like a thing, in part; and a large thin thing bends the fit, but not for most.
            hint = self._fields.small(sight.off, sight.readable)[1] > _STRIKING and self._is_elsewhere(sight)
        in_place = np.count_nonzero(sight.readable & (np.abs(sight.off) < OUTLIER)) / self._blocks
        if in_place < _IN_PLACE:
            why = self._hiding(sight)
            hint = why is None and (hint or bool(in_place < _GONE) or self._is_elsewhere(sight))
        if self._hints.goes_on(hint):
            self._search = _Search(self._fields, self._blocks, t_ns)
            return Outlook(WHY_MOVED)
        if self._hidden.goes_on(why is not None):
            return Outlook(why)
        return Outlook(drift=drift if not hint and why is None else None, doubtful=hint)

    def _hiding(self, sight: Sight) -> str | None:
        unreadable = 1.0 - np.count_nonzero(sight.readable) / self._blocks
        if unreadable + np.count_nonzero(sight.above) / self._blocks < _HIDDEN:
            return None
        return WHY_BLIND if unreadable > _BLIND else WHY_COVERED

    def _is_elsewhere(self, sight: Sight) -> bool:
        field = self._fields.any_size(sight.off, sight.readable)
        agreeing = agrees(self._fields, field, sight)
        return bool(np.count_nonzero(agreeing) > _AGREES * self._blocks) and self._fields.size(field, agreeing) > _MOVED


class _Search:
    """Looks for a surface that was moved, until it is at rest."""

    def __init__(self, fields: Fields, blocks: int, t_ns: int) -> None:
        self._fields = fields
        self._blocks = blocks
        self._began_ns = t_ns
        self._found: list[Doubles] = []
        self._rest_ns = t_ns

    def step(self, sight: Sight, t_ns: int) -> Outlook:
        field = self._fields.any_size(sight.off, sight.readable)
        agreeing = agrees(self._fields, field, sight)
        if np.count_nonzero(agreeing) < _AGREES * self._blocks:
            self._found = []
            return Outlook(WHY_MOVED, lost=t_ns - self._began_ns > _LOST_NS)
        if not self._found or self._fields.size(field - self._found[-1], agreeing) > _STEADY:
            self._found, self._rest_ns = [], t_ns
        self._found.append(field)
        standing = sight.readable & (sight.off - self._fields.at_blocks(field) < -_STANDING)
        empty = np.count_nonzero(standing) < _EMPTY * self._blocks
        if t_ns - self._rest_ns < (_AT_REST_NS if empty else _AT_REST_BELOW_NS):
            return Outlook(WHY_MOVED)
        return Outlook(WHY_MOVED, jump=np.asarray(np.mean(self._found, axis=0), np.float64))


def agrees(fields: Fields, field: Doubles, sight: Sight) -> Mask:
    """Return the blocks that a change of the whole surface explains."""
    found: Mask = sight.readable & (np.abs(sight.off - fields.at_blocks(field)) < _ALIKE)
    return found


class _Streak:
    """Counts pictures in a row that say the same."""

    def __init__(self) -> None:
        self._count = 0

    def goes_on(self, now: bool) -> bool:
        """Return whether enough pictures in a row say so, this one among them."""
        self._count = self._count + 1 if now else 0
        return self._count >= _IN_A_ROW


class _Gravity:
    """Feels jolts and turns of a camera that knows where down is."""

    def __init__(self) -> None:
        self._hanging: tuple[float, float, float] | None = None
        self._lately: tuple[float, float, float] | None = None

    def is_jolt(self, accel_g: tuple[float, float, float] | None) -> bool:
        """Return whether the camera is pulled elsewhere than it has been."""
        return accel_g is not None and self._hanging is not None and dist(accel_g, self._hanging) > _JOLT_G

    def jolted(self, accel_g: tuple[float, float, float] | None) -> bool:
        """Return whether the camera was jolted, or hangs otherwise than it did."""
        if accel_g is None:
            return False
        if self._hanging is None or self._lately is None:
            self._hanging = self._lately = accel_g
            return False
        jolt = self.is_jolt(accel_g)
        self._lately = _mixed(self._lately, accel_g, _RESTING_SHARE)
        turned = dist(self._lately, self._hanging) > _TURNED_G
        self._hanging = _mixed(self._hanging, accel_g, _HANGING_SHARE)
        return jolt or turned


def _mixed(
    old: tuple[float, float, float], new: tuple[float, float, float], share: float
) -> tuple[float, float, float]:
    x, y, z = (a + share * (b - a) for a, b in zip(old, new, strict=True))
    return x, y, z
