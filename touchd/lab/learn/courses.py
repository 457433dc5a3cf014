"""Fingertips over time in simulated scenes, with what was true: the material that beliefs are learned from."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import exp, log
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from touchd.contacts.belief import Beliefs, Known
from touchd.contacts.company import Standing, company
from touchd.contacts.fingertip import FingertipMethod
from touchd.contacts.method import Place
from touchd.contacts.neighbours import paired
from touchd.contacts.recurrent import Said, learned_weights
from touchd.lab.scoring import Truth
from touchd.lab.scoring.truth import Tip as TrueTip
from touchd.model import Floats, Frame, Mask
from touchd.pipeline import Pipeline

Rows: TypeAlias = NDArray[np.int64]

_SAME_MM = 22.0  # what is seen so near to a fingertip is it
_COMES_DOWN, _LIFTS = 0.15, 0.15  # the chance of it from one picture to the next
_UNSEEN = -1.1  # log odds of a fingertip that was not seen before
_TRUST = 0.9  # in a picture: neighbouring ones err in the same way, and so tell less than each alone
_MOST = 6.0  # log odds that one picture can tell


@dataclass(frozen=True, slots=True)
class Course:
    """What a scene shows of fingertips: R rows, in the order of frames.

    ``inputs`` (R, F) float32. ``frame``, ``last`` (R,): the frame of each row, and which row the same fingertip was
    before, or -1. ``heard`` (E, 2): rows beside each other, the first of which hears of the second. What was true:
    ``touching``, ``finger``, ``either`` (R,) bool, the last of fingers that hold a thing and may be taken for touching
    or not; ``clearance_mm``, ``step_mm`` (R,) float32, and how far along and across the finger it was from where it is
    seen at rest, ``place_mm`` (R, 2) float32. Both are 0 without a finger.
    """

    inputs: Floats
    frame: Rows
    last: Rows
    heard: Rows
    touching: Mask
    finger: Mask
    either: Mask
    clearance_mm: Floats
    place_mm: Floats
    step_mm: Floats


@dataclass(frozen=True, slots=True)
class _Row:
    frame: int
    last: int
    true: TrueTip | None
    place_mm: tuple[float, float]
    step_mm: float


class _Watched(Beliefs):
    """Beliefs by a hidden Markov model of two states, before anything was learned; what to learn from is kept.

    The state of a fingertip is its row and its log odds of touching.
    """

    def __init__(self, pixel_mm: float) -> None:
        super().__init__(pixel_mm, learned_weights())
        self.inputs: list[Floats] = []
        self.heard: list[tuple[int, int]] = []
        self.standing: list[tuple[Standing, int]] = []  # in the last picture, with the row that each was before
        self.count = 0

    def think(self, now: Sequence[Standing], last: Sequence[Known | None]) -> tuple[list[Said], Floats]:
        """Return what is said of N fingertips, given those that they were before, and their states (N, 2)."""
        self.standing = []
        if not now:
            return [], np.zeros((0, 2), np.float32)
        before = [None if known is None else known.standing for known in last]
        inputs, hearing = company(now, before)
        self.inputs.append(inputs)
        self.heard += [(self.count + row, self.count + other) for row, other in np.argwhere(hearing).tolist()]
        odds = [_odds(one, known) for one, known in zip(now, last, strict=True)]
        rows = range(self.count, self.count + len(now))
        self.count += len(now)
        self.standing = [
            (one, -1 if known is None else int(known.state[0])) for one, known in zip(now, last, strict=True)
        ]
        said = [
            Said(told, one.seen.finger_odds, one.seen.clearance_mm, 0.0, 0.0)
            for told, one in zip(odds, now, strict=True)
        ]
        return said, np.column_stack([rows, odds]).astype(np.float32)


class _WatchedMethod(FingertipMethod):
    """The method with such beliefs."""

    def __init__(self, place: Place) -> None:
        super().__init__(place)
        self.watched = _Watched(self._pixel_mm)
        self._beliefs = self.watched


def course(pipeline: Pipeline, frames: Iterable[Frame], truth: Truth) -> Course | None:
    """Run a pipeline with ``method: fingertip`` over a scene, every frame of it; None where no fingertip was seen."""
    ready = pipeline.ready
    if ready is None:
        raise ValueError("the pipeline has no surface")
    method = _WatchedMethod(ready.place)
    pipeline.adopt(ready.settings, replace(ready, method=method))
    rows: list[_Row] = []
    for frame in frames:
        method.watched.standing = []  # while touches are paused nobody looks
        pipeline.step(frame)
        rows += _rows(frame.index, method.watched.standing, truth.frames[frame.index])
    return _gathered(rows, method.watched) if rows else None


def _rows(frame: int, standing: Sequence[tuple[Standing, int]], tips: Sequence[TrueTip]) -> list[_Row]:
    places = [(true.x_mm, true.y_mm) for true in tips]
    own = paired([one.under_mm for one, _ in standing], places, _SAME_MM)
    own |= paired([one.rest_mm for one, _ in standing], places, _SAME_MM)
    return [
        _Row(frame, last, tips[own[i]], _away_mm(one, tips[own[i]]), one.seen.lay.step_mm)
        if i in own
        else _Row(frame, last, None, (0.0, 0.0), one.seen.lay.step_mm)
        for i, (one, last) in enumerate(standing)
    ]


def _away_mm(one: Standing, true: TrueTip) -> tuple[float, float]:
    """Return how far along and across a fingertip truly is from where it is seen at rest."""
    (c, s), x_mm, y_mm = one.towards, true.x_mm - one.rest_mm[0], true.y_mm - one.rest_mm[1]
    return x_mm * c + y_mm * s, y_mm * c - x_mm * s


def _gathered(rows: Sequence[_Row], watched: _Watched) -> Course:
    true = [row.true for row in rows]
    return Course(
        inputs=np.concatenate(watched.inputs),
        frame=np.array([row.frame for row in rows]),
        last=np.array([row.last for row in rows]),
        heard=np.array(watched.heard, np.int64).reshape(-1, 2),
        touching=np.array([tip is not None and tip.touching for tip in true]),
        finger=np.array([tip is not None for tip in true]),
        either=np.array([tip is not None and tip.either for tip in true]),
        clearance_mm=np.array([0.0 if tip is None else tip.clearance_mm for tip in true], np.float32),
        place_mm=np.array([row.place_mm for row in rows], np.float32),
        step_mm=np.array([row.step_mm for row in rows], np.float32),
    )


def _odds(one: Standing, known: Known | None) -> float:
    """Return the log odds that a fingertip touches, by its picture and the ones before."""
    before = _UNSEEN
    if known is not None:
        before = float(known.state[1])
        for _ in range(known.standing.unseen + 1):
            before = _after_a_frame(before)
    return before + _TRUST * min(max(one.seen.odds, -_MOST), _MOST)


def _after_a_frame(log_odds: float) -> float:
    """Return the log odds of touching a picture later, before looking."""
    touching = 1.0 / (1.0 + exp(-log_odds))
    then = touching * (1.0 - _LIFTS) + (1.0 - touching) * _COMES_DOWN
    return log(then / (1.0 - then))
