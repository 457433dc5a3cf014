"""What the fingertip method saw in simulated scenes, with what was true: the material that its judge learns from."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from math import pi

import numpy as np

from touchd.contacts.fingertip import FingertipMethod, Found
from touchd.contacts.judge import Judge, Opinion, learned_layers
from touchd.contacts.method import Expected, Place
from touchd.contacts.neighbours import paired
from touchd.contacts.tips import Tip
from touchd.lab.scoring import Truth
from touchd.lab.scoring.truth import Tip as TrueTip
from touchd.model import Floats, Frame, Image16
from touchd.pipeline import Pipeline

_SAME_MM = 22.0  # a fit so near to a fingertip is of it
_MOST_TOUCHING, _MOST_OTHERS = 60.0, 400.0  # rows of one touch, or of no finger, that count in full


@dataclass(frozen=True, slots=True)
class Samples:
    """N fitted tips: their traits (N, T) and what was true of each, (N,) or (N, 2), all float32.

    ``touching``, ``finger``: 1 or 0. ``clearance_mm`` and ``place_mm`` (how far along and across the finger the touch
    point lies from where the fit has it) are NaN where there is no finger. ``step_mm``: of a raw step of the sensor.
    ``weight``: how much each counts, less where there are many of one touch.
    """

    traits: Floats
    touching: Floats
    finger: Floats
    clearance_mm: Floats
    place_mm: Floats
    step_mm: Floats
    weight: Floats


@dataclass(frozen=True, slots=True)
class _Row:
    traits: Floats
    step_mm: float
    true: TrueTip | None
    place_mm: tuple[float, float]


class _LastJudge(Judge):
    """The judge from before, by those traits that it was taught; they are added at the end."""

    def opinions(self, traits: Floats) -> list[Opinion]:
        """Return what is said of N fingertips by their traits (N, T)."""
        known = len(self._layers[0][0])
        fitting = np.zeros((len(traits), known), np.float32)
        fitting[:, : traits.shape[1]] = traits[:, :known]
        return super().opinions(fitting)


class _Watched(FingertipMethod):
    """The method, which also keeps what it found in the last picture."""

    found: Found | None = None

    def __init__(self, place: Place) -> None:
        super().__init__(place)
        self._judge: Judge = _LastJudge(learned_layers())

    def look(self, raw: Image16, expected: Sequence[Expected]) -> Found | None:
        """Return all fingertips near the surface, and keep them."""
        self.found = super().look(raw, expected)
        return self.found


def samples(pipeline: Pipeline, frames: Iterable[Frame], truth: Truth) -> Samples | None:
    """Run a pipeline with ``method: fingertip`` over a scene; None where no tip was fitted."""
    ready = pipeline.ready
    if ready is None:
        raise ValueError("the pipeline has no surface")
    method = _Watched(ready.place)
    pipeline.adopt(ready.settings, replace(ready, method=method))
    rows: list[_Row] = []
    for frame in frames:
        pipeline.step(frame)
        if method.found is not None:
            rows += _rows(method, method.found, truth.frames[frame.index], truth.size_mm)
    return _gathered(rows) if rows else None


def joined(parts: Sequence[Samples]) -> Samples:
    """Return the samples of several scenes as one."""
    return Samples(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Samples)))


def _rows(method: _Watched, found: Found, tips: Sequence[TrueTip], size_mm: tuple[float, float]) -> list[_Row]:
    """Return the fitted tips of a frame, each with the true one that it is of."""

    def on_surface(pixel: tuple[float, float]) -> tuple[float, float]:
        x, y = method.area_of(*pixel)
        return x * size_mm[0], y * size_mm[1]

    def away(tip: Tip, true: TrueTip) -> tuple[float, float]:
        (u, v), lay = tip.foot_px, tip.guess.lay
        here = np.array(on_surface((u, v)))
        axes = [lay.along(angle) for angle in (tip.angle, tip.angle + pi / 2)]
        ways = np.array([on_surface((u + du, v + dv)) for du, dv in axes]) - here
        along, across = np.linalg.solve(ways.T, np.array([true.x_mm, true.y_mm]) - here).tolist()
        return along, across

    places = [(true.x_mm, true.y_mm) for true in tips]
    own = paired([on_surface(tip.under_px) for tip in found.tips], places, _SAME_MM)
    own |= paired([on_surface(tip.foot_px) for tip in found.resting], places, _SAME_MM)
    return [
        _Row(told, tip.guess.lay.step_mm, tips[own[i]], away(tip, tips[own[i]]))
        if i in own
        else _Row(told, tip.guess.lay.step_mm, None, (np.nan, np.nan))
        for i, (tip, told) in enumerate(zip(found.resting, found.traits, strict=True))
    ]


def _gathered(rows: Sequence[_Row]) -> Samples:
    true = [row.true for row in rows]
    numbers = [0 if tip is None else tip.touch for tip in true]
    count = Counter(numbers)
    most = [(_MOST_TOUCHING if number else _MOST_OTHERS) / count[number] for number in numbers]
    return Samples(
        traits=np.stack([row.traits for row in rows]),
        touching=np.array([tip is not None and tip.touching for tip in true], np.float32),
        finger=np.array([tip is not None for tip in true], np.float32),
        clearance_mm=np.array([np.nan if tip is None else tip.clearance_mm for tip in true], np.float32),
        place_mm=np.array([row.place_mm for row in rows], np.float32),
        step_mm=np.array([row.step_mm for row in rows], np.float32),
        weight=np.minimum(np.array(most, np.float32), np.float32(1.0)),
    )
