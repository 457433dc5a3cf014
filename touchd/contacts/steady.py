"""Fingers that keep still: while the picture around one does not change, neither does what is said of it.

Noise moves a fit from picture to picture, most of all where a finger is steep or far. Whether the picture itself has
changed is far plainer, so what is fitted is averaged for as long as it has not, and begins anew once it has. That
costs a moving finger nothing. And a fit that comes out elsewhere on a finger around which the picture has not changed
went astray.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, pi, tau

import cv2
import numpy as np

from touchd.contacts.fit import Picture
from touchd.contacts.heights import Box, Bytes, Lay, as_bytes
from touchd.contacts.judge import Opinion
from touchd.contacts.neighbours import paired
from touchd.model import Floats

_AROUND_MM = 9.0  # so far around a fingertip the picture is watched
_SAME_MM = 8.0  # so near to where it was a fit is of the same finger
_ALONE_MM = 10.0  # no two fingertips are nearer
# The mean change of heights from which on a finger has moved, in raw steps: noise makes so much of itself, the more
# the more steps high a finger's outlines are.
_MOVED_STEPS, _MOVED_MM = 0.3, 0.45
_MOST_STEPS = 6.0  # what changes by more counts as this
_COMPARED = 3  # pictures whose mean later ones are compared with
_LONGEST = 30  # pictures that an average goes back
_KNOWN = 5  # pictures after which a finger is known to keep still
# Noise alone may change a picture by that much now and then; what is known to keep still moved if it is so much more.
_PLAINLY = 1.4
_ALONG_MM, _ACROSS_MM = 30.0, 6.0  # so far along and across such a finger a fit that went astray may come out


@dataclass(frozen=True, slots=True)
class Seen:
    """One fingertip in a picture.

    ``u``, ``v``: where the surface under the centre of its ball is seen, if it rests; ``u_under``, ``v_under``: the
    same if it is as high as it seems. ``angle``: of the way back along the finger, in the frame of ``lay``. ``odds``:
    the logarithm of its odds of touching, by pictures alone; ``finger_odds``: of being a fingertip. ``shown``: whether
    this picture showed it. It is the average over so many ``pictures``, while ``opinion`` is of this one alone.
    """

    u: float
    v: float
    u_under: float
    v_under: float
    angle: float
    radius_mm: float
    clearance_mm: float
    odds: float
    finger_odds: float
    shown: bool
    lay: Lay
    opinion: Opinion
    pictures: int = 1

    def towards(self, new: "Seen", share: float) -> "Seen":
        """Return it moved by a share of the way to what was seen anew."""
        kept = 1.0 - share
        return Seen(
            kept * self.u + share * new.u,
            kept * self.v + share * new.v,
            kept * self.u_under + share * new.u_under,
            kept * self.v_under + share * new.v_under,
            self.angle + share * ((new.angle - self.angle + pi) % tau - pi),
            kept * self.radius_mm + share * new.radius_mm,
            kept * self.clearance_mm + share * new.clearance_mm,
            kept * self.odds + share * new.odds,
            kept * self.finger_odds + share * new.finger_odds,
            new.shown,
            new.lay,
            new.opinion,
            min(self.pictures + 1, _LONGEST),
        )


@dataclass(frozen=True, slots=True)
class _Still:
    """A finger that has kept still: its average, and how the picture looked around it when it began to.

    ``heights_mm`` are the mean of so many ``compared`` pictures. ``doubted``: whether the last picture may have shown
    that it moved.
    """

    seen: Seen
    window: Box
    heights_mm: Floats
    readings: Bytes
    compared: int = 1
    doubted: bool = False

    @property
    def is_known(self) -> bool:
        """Whether it has kept still for long enough to be sure of it."""
        return self.seen.pictures >= _KNOWN

    def with_another(self, one: Seen) -> "_Still":
        """Return it with one more sighting in the average."""
        seen = self.seen.towards(one, 1.0 / min(self.seen.pictures + 1, _LONGEST))
        return _Still(seen, self.window, self.heights_mm, self.readings, self.compared, self.doubted)

    def compared_with(self, heights_mm: Floats, readings: Bytes) -> "_Still":
        """Return it with what the picture shows around it now, where that and those before are ``readings``."""
        if self.compared == _COMPARED:
            return replace(self, doubted=False) if self.doubted else self
        compared = self.compared + 1
        mean_mm = self.heights_mm.copy()
        np.add(mean_mm, (heights_mm - mean_mm) / np.float32(compared), out=mean_mm, where=readings > 0)
        return replace(self, heights_mm=mean_mm, compared=compared, doubted=False)

    def unseen(self) -> "_Still":
        """Return it as it is after a picture that did not show it."""
        seen, impression = self.seen, np.zeros_like(self.seen.opinion.impression)
        opinion = Opinion(seen.odds, seen.finger_odds, seen.clearance_mm, 0.0, 0.0, impression)
        return replace(self, seen=replace(seen, shown=False, opinion=opinion))


class Steady:
    """Remembers how the picture around each fingertip looked, over one surface with raw steps of ``step_mm``."""

    def __init__(self, step_mm: float) -> None:
        self._moved_mm = _MOVED_STEPS * step_mm + _MOVED_MM
        self._most_mm = _MOST_STEPS * step_mm
        self._still: list[_Still] = []

    def settle(self, seen: Sequence[Seen], picture: Picture) -> list[Seen]:
        """Return fingertips as they are on average for as long as they have kept still.

        A finger that is not among those ``seen``, but looks in the picture as it did, is still where it was; unless
        one of those is so near that it must be the same. What is seen elsewhere on one known to keep still went astray,
        and is left out.
        """
        before = [known for still in self._still if (known := self._if_same(still, picture)) is not None]
        limit_px = _SAME_MM / seen[0].lay.pixel_mm if seen else 0.0
        same = paired(_places(seen), _places([still.seen for still in before]), limit_px)
        lasting = [still for i, still in enumerate(before) if i not in same.values()]
        resting = [still.seen for still in lasting if still.is_known]
        now = _apart(
            [
                before[same[i]].with_another(one) if i in same else _begun(one, picture)
                for i, one in enumerate(seen)
                if i in same or not any(_is_astray(one, still) for still in resting)
            ]
        )
        shown = [still.seen for still in now]
        now += [still.unseen() for still in lasting if still.seen.pictures > 1 and not _is_among(still.seen, shown)]
        self._still = now
        return [still.seen for still in now]

    def _if_same(self, still: _Still, picture: Picture) -> _Still | None:
        """Return a finger with what the picture shows around it if that is as it was; None if it has moved.

        The next picture tells whether one that is known to keep still has moved, unless this one does plainly.
        """
        window = _within(still.window, picture.box)
        if window is None or not still.heights_mm.size:
            return None
        heights_mm = picture.heights_mm[window]
        change_mm = cv2.absdiff(heights_mm, still.heights_mm)
        cv2.threshold(change_mm, self._most_mm, 0.0, cv2.THRESH_TRUNC, dst=change_mm)
        both = as_bytes(cv2.bitwise_and(picture.readings[window], still.readings))
        changed_mm = cv2.mean(change_mm, both)[0]
        if changed_mm < self._moved_mm:
            return still.compared_with(heights_mm, both)
        doubtful = still.is_known and not still.doubted and changed_mm < _PLAINLY * self._moved_mm
        return replace(still, doubted=True) if doubtful else None


def _begun(one: Seen, picture: Picture) -> _Still:
    around = round(_AROUND_MM / one.lay.pixel_mm)
    u, v, box = round(one.u), round(one.v), picture.box
    left, top = max(u - around, box.left), max(v - around, box.top)
    right, bottom = min(u + around + 1, box.right), min(v + around + 1, box.bottom)
    area = Box(left, top, max(right, left), max(bottom, top))
    window = slice(area.top - box.top, area.bottom - box.top), slice(area.left - box.left, area.right - box.left)
    return _Still(one, area, picture.heights_mm[window].copy(), picture.readings[window].copy())


def _within(window: Box, box: Box) -> tuple[slice, slice] | None:
    """Return a window of the whole picture as an index of a box in it, None where that does not hold all of it."""
    top, left = window.top - box.top, window.left - box.left
    if left < 0 or top < 0 or window.right > box.right or window.bottom > box.bottom:
        return None
    return slice(top, window.bottom - box.top), slice(left, window.right - box.left)


def _is_among(one: Seen, shown: Sequence[Seen]) -> bool:
    """Return whether one of those shown is at the same place."""
    alone_px = _ALONE_MM / one.lay.pixel_mm
    return any(hypot(one.u - other.u, one.v - other.v) < alone_px for other in shown)


def _is_astray(one: Seen, still: Seen) -> bool:
    """Return whether what was fitted is a finger that keeps still, found too far ahead or back along it."""
    along_mm, across_mm = still.lay.seen_from(still.angle, one.u - still.u, one.v - still.v)
    return abs(along_mm) < _ALONG_MM and abs(across_mm) < _ACROSS_MM


def _apart(stills: Sequence[_Still]) -> list[_Still]:
    """Return one of those that turn out to be the same finger: the one known for longest."""
    kept: list[_Still] = []
    for still in sorted(stills, key=_known_for, reverse=True):
        if not _is_among(still.seen, [other.seen for other in kept]):
            kept.append(still)
    return kept


def _known_for(still: _Still) -> tuple[int, float]:
    return still.seen.pictures, still.seen.odds


def _places(seen: Sequence[Seen]) -> list[tuple[float, float]]:
    return [(one.u, one.v) for one in seen]
