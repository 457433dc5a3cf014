"""What many outcomes come to: figures over all of them, and how they spread from seed to seed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchd.lab.accuracy.trials import Outcome
from touchd.lab.scoring import Score, figures, pooled

PERCENTS = (5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95, 98, 99, 100)


@dataclass(frozen=True, slots=True)
class Summary:
    """Figures of a contender, by the keys of the measures.

    ``height_mm`` is None over all heights, ``scene`` over all scenes. ``spread``: the least and greatest over the
    seeds. ``error_percentiles_mm``: the position error at ``PERCENTS``, empty where there is none.
    """

    contender: str
    height_mm: float | None
    scene: str | None
    crowded_only: bool
    figures: dict[str, float | None]
    spread: dict[str, tuple[float, float] | None]
    error_percentiles_mm: tuple[float, ...]


def summary(
    outcomes: Sequence[Outcome],
    contender: str,
    height_mm: float | None = None,
    scene: str | None = None,
    crowded_only: bool = False,
) -> Summary:
    """Return what a contender's outcomes come to, over those at a height, of a scene, or of crowds, if given."""
    own = [
        outcome
        for outcome in outcomes
        if outcome.contender == contender
        and height_mm in (None, outcome.trial.height_mm)
        and scene in (None, outcome.trial.scene)
        and (outcome.crowded or not crowded_only)
    ]
    seeds = sorted({outcome.trial.seed for outcome in own})
    each = [figures(pooled(outcome.score for outcome in own if outcome.trial.seed == seed)) for seed in seeds]
    together = pooled(outcome.score for outcome in own)
    values = figures(together)
    return Summary(
        contender,
        height_mm,
        scene,
        crowded_only,
        values,
        {key: _spread([one[key] for one in each]) for key in values},
        _percentiles(together),
    )


def _spread(values: Sequence[float | None]) -> tuple[float, float] | None:
    known = [value for value in values if value is not None]
    return (min(known), max(known)) if known else None


def _percentiles(score: Score) -> tuple[float, ...]:
    return tuple(np.percentile(score.errors_mm, PERCENTS).tolist()) if score.errors_mm else ()
