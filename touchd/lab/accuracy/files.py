"""The outcomes as JSON and CSV, for programs."""

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from touchd.lab.accuracy.goals import verdicts
from touchd.lab.accuracy.summary import PERCENTS, Summary, summary
from touchd.lab.accuracy.tables import by_sensor, columns_by_height, heights_in, unique
from touchd.lab.accuracy.trials import Outcome
from touchd.lab.scoring import MEASURES, figures


def as_json(outcomes: Sequence[Outcome], about: Mapping[str, Any], judged: str) -> str:
    """Return everything as a JSON object: what it is about, summaries, scenes, single outcomes, goals."""
    names = unique([outcome.contender for outcome in outcomes])
    by_scene = [
        _summary(sensor, summary(own, name, height, scene))
        for sensor, own in by_sensor(outcomes)
        for scene in unique([outcome.trial.scene for outcome in own])
        for height in heights_in(own)
        for name in names
    ]
    together = [
        _summary(sensor, column)
        for sensor, own in by_sensor(outcomes)
        for _, columns in columns_by_height(own)
        for column in columns
    ]
    document: dict[str, Any] = {
        **about,
        "measures": {measure.key: {"meaning": measure.meaning, "unit": measure.unit} for measure in MEASURES},
        "percents": PERCENTS,
        "summaries": together,
        "scenes": by_scene,
        "scenes_run": unique([outcome.trial.scene for outcome in outcomes]),
        "outcomes": [_outcome(outcome) for outcome in outcomes],
        "judged": judged,
        "goals": [
            {
                "key": verdict.goal.key,
                "height_mm": verdict.goal.height_mm,
                "crowds": verdict.goal.crowded,
                "scene": verdict.goal.scene,
                "where": verdict.goal.where,
                "limit": verdict.goal.limit,
                "at_least": verdict.goal.at_least,
                "found": verdict.found,
                "reached": verdict.reached,
            }
            for verdict in verdicts(outcomes, judged)
        ],
    }
    return json.dumps(document, indent=1)


def csv_lines(outcomes: Sequence[Outcome], head: str) -> Iterator[str]:
    """Yield a comment line, the names of the columns, and a row for each outcome."""
    yield f"# {head}"
    keys = [measure.key for measure in MEASURES]
    yield _csv_row(["method", "sensor", "scene", "height_mm", "seed", "crowded", *keys])
    for outcome in outcomes:
        row = _outcome(outcome)
        own = figures(outcome.score)
        values = [row["method"], outcome.sensor, row["scene"], row["height_mm"], row["seed"], int(outcome.crowded)]
        yield _csv_row([*values, *("" if own[key] is None else own[key] for key in keys)])


def _csv_row(values: Sequence[Any]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(values)
    return line.getvalue()


def _outcome(outcome: Outcome) -> dict[str, Any]:
    return {
        "method": outcome.contender,
        "sensor": outcome.sensor,
        "scene": outcome.trial.scene,
        "height_mm": outcome.trial.height_mm,
        "seed": outcome.trial.seed,
        "crowded": outcome.crowded,
        "figures": figures(outcome.score),
    }


def _summary(sensor: str, column: Summary) -> dict[str, Any]:
    return {
        "sensor": sensor,
        "method": column.contender,
        "height_mm": column.height_mm,
        "scene": column.scene,
        "figures": column.figures,
        "spread": column.spread,
        "error_percentiles_mm": column.error_percentiles_mm,
    }
