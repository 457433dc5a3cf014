"""Things that are put down on the surface: remembered while they lie there, and handed to the surface in the end."""

from collections.abc import Sequence
from dataclasses import replace
from math import dist

import cv2
import numpy as np

from touchd.hands.clearing import Patch, patch_of
from touchd.hands.lookout import Lookout
from touchd.hands.settings import ObjectSettings
from touchd.hands.standing import Horizon, Part, Standing
from touchd.hands.thing import Look, Shape, Thing, grown, is_part, look_at, mask_of, moved, outline_of, shape_of, slid
from touchd.model import CoarsePicture, Mask

_TALLEST_MM = 300.0  # what is higher was not put down
_OVER_MM, _OVER_STEPS = 4.0, 0.5  # by so much a hand is higher than the thing under it
_LEAST_SEEN = 0.3  # of a thing; of less nothing can be said
_UNCOVERED = 0.9  # of a thing: what hides more stands over it
_BARELY_LEFT, _PARTLY_LEFT, _WHOLLY_LEFT = 0.03, 0.15, 0.7  # of it
_ODD_NS = 150_000_000  # it looks odd for so long before it is believed
_PUSH_MM, _PUSH_UNSEEN_MM = 35.0, 110.0  # at most in a frame, and until the surface lets it go
_STAYS_MM, _STAYS_PX = 8.0, 2.5  # a thing that was pushed no farther, all in all, still lies where it did
_AGAIN_NS, _AGAIN_MM, _AGAIN_SHARE = 2_000_000_000, 350.0, 0.35  # what is put down again is the same thing
_ASKED_NS = 5_000_000_000  # the surface takes it in within this time, or is asked again
_SUNK = 0.3  # of what is seen of it reads as the surface once that has taken it in
_EDGE_SHARE = 0.1  # of a thing that the surface has taken in: less beside it, and no higher, is its edge
_THERE_SHARE = 0.5  # of the level: what is higher is the thing, once it is known that there is one
_ZONE_MM = 15.0  # around a thing, in which its own edge could be taken for a fingertip
_SIDE, _BESIDE = np.ones((3, 3), np.uint8), np.ones((7, 7), np.uint8)


class ThingTracker:
    """Follows things on one surface. Ids count up and are not used again.

    ``levels_mm`` (rows, columns): what stands higher in the next picture is not the surface, nor a thing known so far;
    ``patches``: where those things are to be cleared from it.
    """

    def __init__(self, lookout: Lookout, horizon: Horizon, settings: ObjectSettings, first_id: int) -> None:
        self._lookout = lookout
        self._settings = settings
        self._level_mm, self._empty_mm = horizon.level_mm, horizon.levels_mm
        self._lost: list[tuple[int, Thing]] = []  # when, and what
        self._zone: Mask = np.zeros(lookout.shape, np.bool_)
        self.next_id = first_id
        self.things: tuple[Thing, ...] = ()
        self.levels_mm = horizon.levels_mm
        self.patches: tuple[Patch, ...] = ()

    def step(
        self,
        still: Sequence[Part],
        picture: CoarsePicture,
        standing: Standing | None,
        of_arms: set[int],
        joined: Mask | None,
        t_ns: int,
    ) -> None:
        """Take in one picture, with the islands of it that have come to lie still.

        ``of_arms``: the labels of what stands there that are arms. ``joined`` (rows, columns): where things are part of
        the surface.
        """
        before = self.things
        if not before and not still:
            return
        found = (self._seen(thing, picture, standing, joined, t_ns) for thing in before)
        seen = [None if thing is None else _beneath(thing, standing, of_arms) for thing in found]
        self.things = tuple(thing for thing in seen if thing is not None)
        for thing, now in zip(before, seen, strict=True):
            if thing.freed and now is not None:
                self.things = self._without_parts_of(now)
        self._lost = [(when, thing) for when, thing in self._lost if t_ns - when < _AGAIN_NS]
        self._lost += [(t_ns, thing) for thing, now in zip(before, seen, strict=True) if now is None]
        if standing is not None:
            for part in still:
                self._settle(part, standing, t_ns)
        if [(thing.shape, thing.taken) for thing in before] != [(thing.shape, thing.taken) for thing in self.things]:
            self._draw()

    def slide(self, before: Mask, now: Mask, t_ns: int) -> None:
        """Move those that are part of the surface with it: what was ``before`` (rows, columns) is there ``now``."""
        self.things = tuple(
            self._slid(thing, before, now, t_ns) if thing.taken and is_part(thing.shape, before) else thing
            for thing in self.things
        )
        self._draw()

    def adopt(self, settings: ObjectSettings) -> None:
        """Go on under other settings."""
        self._settings = settings

    def holds(self, place: tuple[float, float]) -> bool:
        """Return whether a thing is at a place, or close by, that the surface has not taken in, or not as it is now."""
        column, row = round(place[0]), round(place[1])
        rows, columns = self._zone.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self._zone[row, column])

    def due(self, t_ns: int) -> Mask | None:
        """Return what the surface is to take in now (rows, columns), None for nothing; it counts as asked."""
        due = [thing for thing in self.things if self._is_due(thing, t_ns)]
        if not due:
            return None
        ids = {thing.object_id for thing in due}
        self.things = tuple(replace(t, asked_ns=t_ns, slid=False) if t.object_id in ids else t for t in self.things)
        self._draw()
        footprint = np.concatenate([thing.shape.footprint for thing in due])
        return grown(mask_of(footprint, self._lookout.shape), _SIDE)

    def _is_due(self, thing: Thing, t_ns: int) -> bool:
        asked = thing.asked_ns is not None and t_ns - thing.asked_ns < _ASKED_NS
        lies = thing.odd_ns is None and t_ns - thing.still_ns >= self._settings.join_after_s * 1e9
        is_known = thing.taken and not thing.slid
        return lies and not (is_known or asked or thing.covered)

    def _seen(
        self, thing: Thing, picture: CoarsePicture, standing: Standing | None, joined: Mask | None, t_ns: int
    ) -> Thing | None:
        """Return a thing as a picture shows it, None where it does not any more."""
        lies_on_joined = joined is not None and is_part(thing.shape, joined)
        if thing.taken and lies_on_joined:
            return thing
        if thing.taken:
            return replace(thing, taken=False, freed=True, slid=False, asked_ns=None, still_ns=t_ns)
        look = look_at(thing, picture, standing)
        # The surface may have taken in only what is below it.
        if lies_on_joined and thing.asked_ns is not None and look.left > _SUNK:
            return replace(thing, taken=True)
        thing = replace(thing, covered=look.seen < _UNCOVERED)
        return self._elsewhere(thing, look, picture, t_ns) or self._left_of(thing, look, picture, t_ns)

    def _elsewhere(self, thing: Thing, look: Look, picture: CoarsePicture, t_ns: int) -> Thing | None:
        """Return a thing where it was pushed to, None where it was not."""
        if look.left <= _BARELY_LEFT or not (look.touched or thing.freed):
            return None
        pushed = self._pushed(thing, picture, _PUSH_UNSEEN_MM if thing.freed else _PUSH_MM)
        if pushed is None:
            return None
        now = replace(thing, shape=pushed, outline=outline_of(pushed, self._lookout), odd_ns=None, freed=False)
        stays = dist(pushed.centre, thing.anchor) < max(_STAYS_PX, self._lookout.px(_STAYS_MM))
        return now if stays else replace(now, still_ns=t_ns, anchor=pushed.centre, asked_ns=None)

    def _slid(self, thing: Thing, before: Mask, now: Mask, t_ns: int) -> Thing:
        """Return a thing where it went with the surface, which is to look at it anew once it lies still."""
        shape = slid(thing.shape, before, now)
        outline = outline_of(shape, self._lookout)
        return replace(
            thing, shape=shape, outline=outline, still_ns=t_ns, anchor=shape.centre, asked_ns=None, slid=True
        )

    def _left_of(self, thing: Thing, look: Look, picture: CoarsePicture, t_ns: int) -> Thing | None:
        """Return what is left of a thing where it was; None where that is nothing."""
        now = replace(thing, freed=False)
        if look.seen < _LEAST_SEEN or look.left < _PARTLY_LEFT:
            return replace(now, odd_ns=None)
        is_gone = look.left > _WHOLLY_LEFT
        odd_ns = t_ns if thing.odd_ns is None else thing.odd_ns
        if t_ns - odd_ns < _ODD_NS and not (is_gone and thing.freed):
            return replace(now, odd_ns=odd_ns)
        return None if is_gone else self._shrunk(now, picture, t_ns)

    def _without_parts_of(self, whole: Thing) -> tuple[Thing, ...]:
        """Return the things without those that are but a part of one, seen before all of it was."""
        own = mask_of(whole.shape.footprint, self._lookout.shape)
        return tuple(t for t in self.things if t is whole or t.taken or not is_part(t.shape, own))

    def _pushed(self, thing: Thing, picture: CoarsePicture, most_mm: float) -> Shape | None:
        """Return the shape of a thing that was pushed, by so much at most; None where it was not."""
        right, down = moved(thing.shape, picture, max(2, round(self._lookout.px(most_mm))))
        if (right, down) == (0, 0):
            return None
        rows, columns = self._lookout.shape
        v, u = np.divmod(thing.shape.footprint, columns)
        kept = (v + down >= 0) & (v + down < rows) & (u + right >= 0) & (u + right < columns)
        heights = np.zeros(self._lookout.shape, np.float32)
        heights[v[kept] + down, u[kept] + right] = thing.shape.heights_mm[kept]
        return shape_of(heights > 0.0, heights) if kept.any() else None

    def _shrunk(self, thing: Thing, picture: CoarsePicture, t_ns: int) -> Thing | None:
        """Return a thing without what of it is there no more."""
        shape = thing.shape
        there = picture.heights_mm.take(shape.footprint) >= np.float32(0.4) * shape.heights_mm
        heights = np.zeros(self._lookout.shape, np.float32)
        heights.ravel()[shape.footprint[there]] = shape.heights_mm[there]
        left = cv2.morphologyEx(heights, cv2.MORPH_OPEN, _SIDE)
        if not (left > 0.0).any():
            return None
        less = shape_of(left > 0.0, np.asarray(left, np.float32))
        outline = outline_of(less, self._lookout)
        return replace(thing, shape=less, outline=outline, still_ns=t_ns, anchor=less.centre, odd_ns=None)

    def _settle(self, part: Part, standing: Standing, t_ns: int) -> None:
        """Take an island for a thing: a new one, more of one that it touches, or one that was lost a moment ago."""
        # The median keeps edges where they are; averages grow what is tall.
        seen = np.asarray(cv2.medianBlur(standing.picture.heights_mm, 3), np.float32)
        mask = (standing.labels == part.label) & (seen > _THERE_SHARE * self._level_mm)
        if not mask.any():
            return
        heights = np.where(mask, seen, np.float32(0.0))
        beside = set(np.flatnonzero(grown(mask, _BESIDE)).tolist())
        rest: list[Thing] = []
        neighbours: list[Thing] = []
        object_id: int | None = None
        for thing in self.things:
            near = not beside.isdisjoint(thing.shape.footprint.tolist())
            if near and not thing.taken:
                own = thing.shape.footprint
                heights.ravel()[own] = np.maximum(heights.take(own), thing.shape.heights_mm)
                object_id = object_id or thing.object_id
            else:
                rest.append(thing)
                neighbours += [thing] if near else []
        shape = shape_of(heights > 0.0, heights)
        # What is seen beside a thing while someone touches it may be that thing, on its way; beside one that has slid,
        # a side of it that was not seen before.
        on_its_way = any(each.slid or _is_touched(each, part, standing) for each in neighbours)
        if shape.height_mm > _TALLEST_MM or on_its_way:
            return
        is_edge = any(_is_edge_of(neighbour.shape, shape) for neighbour in neighbours)
        object_id = object_id or self._again(shape)
        if object_id is None:
            object_id, self.next_id = self.next_id, self.next_id + 1
        outline = outline_of(shape, self._lookout)
        found = Thing(object_id, shape, outline, shape.height_mm, t_ns, shape.centre, is_edge=is_edge)
        self.things = tuple(sorted([*rest, found], key=lambda thing: thing.object_id))

    def _again(self, shape: Shape) -> int | None:
        """Return the id of the lost thing that was put down again."""
        near = [
            (dist(thing.shape.centre, shape.centre), thing.object_id)
            for _, thing in self._lost
            if _alike(len(thing.shape.footprint), len(shape.footprint)) and _alike(thing.height_mm, shape.height_mm)
        ]
        distance, object_id = min(near, default=(0.0, None))
        if object_id is None or distance > self._lookout.px(_AGAIN_MM):
            return None
        self._lost = [(when, thing) for when, thing in self._lost if thing.object_id != object_id]
        return object_id

    def _draw(self) -> None:
        """Draw anew what is known of where things are."""
        over_mm = self._level_mm + _OVER_MM + _OVER_STEPS * self._lookout.step_mm
        self.levels_mm = self._empty_mm
        zone = np.zeros(self._lookout.shape, np.uint8)
        for thing in self.things:
            if thing.slid or not thing.taken:
                zone.ravel()[thing.shape.footprint] = 1
        shapes = [thing.shape for thing in self.things if not thing.taken]
        for shape in shapes:
            heights = np.zeros(self._lookout.shape, np.float32)
            heights.ravel()[shape.footprint] = shape.heights_mm + np.float32(over_mm)
            self.levels_mm = np.maximum(self.levels_mm, np.asarray(cv2.dilate(heights, _SIDE), np.float32))
        self.patches = tuple(patch_of(shape, over_mm, self._lookout) for shape in shapes)
        reach = 2 * round(self._lookout.px(_ZONE_MM)) + 1
        self._zone = cv2.dilate(zone, np.ones((reach, reach), np.uint8)) > 0


def _is_touched(thing: Thing, beside: Part, standing: Standing) -> bool:
    around = standing.labels.take(thing.shape.ring)
    return bool(((around != 0) & (around != beside.label)).any())


def _is_edge_of(thing: Shape, beside: Shape) -> bool:
    return len(beside.footprint) < _EDGE_SHARE * len(thing.footprint) and beside.height_mm <= thing.height_mm


def _alike(a: float, b: float) -> bool:
    return abs(a - b) <= _AGAIN_SHARE * max(a, b)


def _beneath(thing: Thing, standing: Standing | None, of_arms: set[int]) -> Thing:
    """Return a thing that knows whether an arm is over it or close to it, if the surface is to take it in."""
    if thing.taken and not thing.slid:
        return thing
    return replace(thing, covered=_is_near(thing, standing, of_arms) or (thing.covered and not thing.taken))


def _is_near(thing: Thing, standing: Standing | None, of_arms: set[int]) -> bool:
    if standing is None or not of_arms:
        return False
    around = np.concatenate((thing.shape.ring, thing.shape.footprint))
    return bool(np.isin(standing.labels.take(around), list(of_arms)).any())
