"""Things on the table: which touches are on them, beside them, or where one lay before; and whether they are seen."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from touchd.lab.scoring.events import Pair
from touchd.lab.scoring.matching import ScoredFrame
from touchd.lab.scoring.touches import Life, TrueTouch
from touchd.lab.scoring.truth import Outline, TrueThing

_NEAR_MM = 15.0  # a false touch so near to a thing is the thing's
_MIDDLE_MM = 20.0  # so far outside a thing the middle of what is said of it may lie
_NOTICED_S = 2.0  # what lies so long is to be seen
_GONE_S = 1.0  # what is gone for so long is not


@dataclass(frozen=True, slots=True)
class ThingScore:
    """What happened around things that were put down; ``rests`` is how many places they lay in.

    - ``on``, ``beside``, ``where_lay``: touches on a thing that lies there, on the bare table meanwhile, and on the
      bare table where one lay before; ``found_...``: of those the found.
    - ``false_on``, ``false_where_lay``: false touches that began on a thing or within 15 mm of it, be it that a hand
      still held it, and where one lay.
    - ``lying``, ``seen``: how often a thing that had lain for 2 s was there in a frame, and was among the objects that
      the program told of; both 0 where it told of none at all. ``told``: how many objects it told of, frame by frame;
      ``ghosts``: of those the ones where there was none, nor had been within a second.
    """

    rests: int = 0
    on: int = 0
    found_on: int = 0
    beside: int = 0
    found_beside: int = 0
    where_lay: int = 0
    found_where_lay: int = 0
    false_on: int = 0
    false_where_lay: int = 0
    lying: int = 0
    seen: int = 0
    ghosts: int = 0
    told: int = 0


@dataclass(frozen=True, slots=True)
class _Rest:
    """A thing that lies in one place, from one scored frame to another."""

    number: int
    outline_mm: Outline
    footprint_mm: Outline
    first: int
    last: int


def thing_score(
    frames: Sequence[ScoredFrame],
    touches: Mapping[int, TrueTouch],
    found: set[int],
    false: Iterable[Life],
) -> ThingScore:
    """Score what happened around things; ``false`` are the lives of false cursors."""
    rests = _rests(frames)
    if not rests:
        return ThingScore()
    where = {number: _where(rests, touch) for number, touch in touches.items()}
    false_where = [_where_false(frames, rests, life) for life in false]
    lying, seen, ghosts = _told(frames, rests)
    told = sum(len(frame.objects_mm) for frame in frames)
    return ThingScore(
        rests=len(rests),
        on=_count(where, "on", set(where)),
        found_on=_count(where, "on", found),
        beside=_count(where, "beside", set(where)),
        found_beside=_count(where, "beside", found),
        where_lay=_count(where, "where it lay", set(where)),
        found_where_lay=_count(where, "where it lay", found),
        false_on=false_where.count("on"),
        false_where_lay=false_where.count("where it lay"),
        lying=lying if told else 0,
        seen=seen,
        ghosts=ghosts,
        told=told,
    )


def _count(where: Mapping[int, str | None], place: str, among: set[int]) -> int:
    return sum(where[number] == place for number in among)


def _rests(frames: Sequence[ScoredFrame]) -> list[_Rest]:
    """Return where things lay and when, each place once."""
    rests: list[_Rest] = []
    open_: dict[int, _Rest] = {}
    for at, frame in enumerate(frames):
        for thing in frame.things:
            rest = open_.get(thing.number)
            same = rest is not None and rest.outline_mm == thing.outline_mm and rest.last == at - 1
            if thing.held:
                continue
            first = rest.first if rest is not None and same else at
            if rest is not None and not same:
                rests.append(rest)
            open_[thing.number] = _Rest(thing.number, thing.outline_mm, thing.footprint_mm, first, at)
    return rests + list(open_.values())


def _where(rests: Sequence[_Rest], touch: TrueTouch) -> str | None:
    """Return where a touch begins: on a thing, where one lay, beside one; None where nothing lay yet."""
    there = any(rest.first <= touch.first <= rest.last for rest in rests)
    if touch.raised and there:
        return "on"
    left = [rest for rest in rests if rest.last < touch.first]
    if any(_inside(rest.footprint_mm, touch.place_mm, 0.0) for rest in left):
        return "where it lay"
    return "beside" if there else None


def _where_false(frames: Sequence[ScoredFrame], rests: Sequence[_Rest], life: Life) -> str | None:
    """Return what a false cursor began on, if on anything; a thing counts before it lies still as well."""
    if any(_is_near(thing, life.place_mm) for thing in frames[life.born].things):
        return "on"
    left = [rest for rest in rests if rest.last < life.born]
    return "where it lay" if any(_is_near(rest, life.place_mm) for rest in left) else None


def _is_near(thing: TrueThing | _Rest, place_mm: Pair) -> bool:
    return any(_inside(outline, place_mm, _NEAR_MM) for outline in (thing.outline_mm, thing.footprint_mm))


def _inside(outline_mm: Outline, place_mm: Pair, margin_mm: float) -> bool:
    return cv2.pointPolygonTest(np.array(outline_mm, np.float32), place_mm, measureDist=True) >= -margin_mm


def _told(frames: Sequence[ScoredFrame], rests: Sequence[_Rest]) -> tuple[int, int, int]:
    """Return in how many frames things lay, in how many of them they were seen, and how often one was but told of."""
    lying = seen = ghosts = 0
    for at, frame in enumerate(frames):
        middles = [_middle(outline) for outline in frame.objects_mm]
        there = [rest for rest in rests if rest.first <= at <= rest.last]
        noticed = [rest for rest in there if frame.t_s - frames[rest.first].t_s >= _NOTICED_S]
        lying += len(noticed)
        seen += sum(any(_inside(rest.outline_mm, middle, _MIDDLE_MM) for middle in middles) for rest in noticed)
        outlines = [thing.outline_mm for thing in frame.things]
        outlines += [rest.outline_mm for rest in rests if 0.0 <= frame.t_s - frames[rest.last].t_s <= _GONE_S]
        ghosts += sum(_is_ghost(outlines, middle) for middle in middles)
    return lying, seen, ghosts


def _is_ghost(outlines: Iterable[Outline], middle: Pair) -> bool:
    return not any(_inside(outline, middle, _MIDDLE_MM) for outline in outlines)


def _middle(outline: Outline) -> Pair:
    xs, ys = (list(axis) for axis in zip(*outline, strict=True))
    return (sum(xs) / len(xs), sum(ys) / len(ys))
