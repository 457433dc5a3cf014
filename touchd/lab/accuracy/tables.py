"""The outcomes as text: tables for people."""

from collections import Counter
from collections.abc import Iterator, Sequence

from touchd.lab.accuracy.summary import Summary, summary
from touchd.lab.accuracy.trials import Outcome
from touchd.lab.scoring import MEASURES, Measure
from touchd.lab.scoring.measures import BY_KEY

_LABEL = 50
SCENE_CELL = "found % / false touches a minute / splits and swaps % / mean error in mm"
_SCENE_MEASURES = ("found", "false_a_minute", "switches", "error_mean")
# What only scenes tell in which the camera is upset, or things lie on the table.
_HAPPENING_MEASURES = (
    "outlived",
    "after_found",
    "after_error",
    "on_found",
    "beside_found",
    "lay_found",
    "on_false",
    "lay_false",
    "things_seen",
    "ghosts",
)


def unique(values: Sequence[str]) -> list[str]:
    """Return the values in the order of their first appearance."""
    return list(dict.fromkeys(values))


def heights_in(outcomes: Sequence[Outcome]) -> list[float]:
    """Return the heights that were run, in mm, rising."""
    return sorted({outcome.trial.height_mm for outcome in outcomes})


def by_sensor(outcomes: Sequence[Outcome]) -> Iterator[tuple[str, list[Outcome]]]:
    """Yield each kind of camera with its outcomes, the one with most of them first."""
    kinds = Counter(outcome.sensor for outcome in outcomes)
    for kind, _ in kinds.most_common():
        yield kind, [outcome for outcome in outcomes if outcome.sensor == kind]


def columns_by_height(outcomes: Sequence[Outcome]) -> Iterator[tuple[str, list[Summary]]]:
    """Yield a heading and each contender's summary, for each height and then for all of them; of one sensor."""
    names = unique([outcome.contender for outcome in outcomes])
    heights = heights_in(outcomes)
    for height in heights:
        yield f"{height / 1000:g} m", [summary(outcomes, name, height) for name in names]
    if len(heights) > 1:
        yield "all heights", [summary(outcomes, name) for name in names]


def text_tables(outcomes: Sequence[Outcome], head: str) -> Iterator[str]:
    """Yield the lines of the tables: measures by contender for each sensor and height, then scenes by contender."""
    for sensor, own in by_sensor(outcomes):
        for heading, columns in columns_by_height(own):
            yield f"{head}; {sensor}, {heading}; in brackets the least and greatest over the seeds"
            yield from _measure_table(columns)
            yield ""
        for height in heights_in(own):
            yield f"{head}; {sensor}, {height / 1000:g} m; {SCENE_CELL}"
            yield from _scene_table(own, height)
            yield ""
            happenings = list(_happening_rows(own, height))
            if happenings:
                yield f"{head}; {sensor}, {height / 1000:g} m; upsets and things"
                yield from [_names(own), *happenings, ""]


def _measure_table(columns: Sequence[Summary]) -> Iterator[str]:
    width = max(24, *(len(column.contender) + 2 for column in columns))
    yield " " * _LABEL + "".join(f"{column.contender:>{width}s}" for column in columns)
    for measure in (measure for measure in MEASURES if any(column.spread[measure.key] for column in columns)):
        label = f"{measure.meaning}{f', {measure.unit}' if measure.unit else ''}"
        yield f"{label:{_LABEL}s}" + "".join(f"{cell(measure, column):>{width}s}" for column in columns)


def _scene_table(outcomes: Sequence[Outcome], height_mm: float) -> Iterator[str]:
    yield _names(outcomes)
    for scene, columns in _by_scene(outcomes, height_mm):
        yield _row(scene, [scene_cell(column) for column in columns], columns)


def _happening_rows(outcomes: Sequence[Outcome], height_mm: float) -> Iterator[str]:
    """Yield a row for each scene and measure of what happens besides fingertips, where there is anything to tell."""
    for scene, columns in _by_scene(outcomes, height_mm):
        for measure in (BY_KEY[key] for key in _HAPPENING_MEASURES):
            if any(column.spread[measure.key] for column in columns):
                label = f"{scene}: {measure.meaning}{f', {measure.unit}' if measure.unit else ''}"
                yield _row(label, [number(column.figures[measure.key]) for column in columns], columns)


def _by_scene(outcomes: Sequence[Outcome], height_mm: float) -> Iterator[tuple[str, list[Summary]]]:
    """Yield each scene with each contender's summary of it at a height."""
    names = unique([outcome.contender for outcome in outcomes])
    for scene in unique([outcome.trial.scene for outcome in outcomes]):
        yield scene, [summary(outcomes, name, height_mm, scene) for name in names]


def _names(outcomes: Sequence[Outcome]) -> str:
    """Return the line that heads the contenders' columns."""
    names = unique([outcome.contender for outcome in outcomes])
    return " " * _LABEL + "".join(f"{name:>{_width(names)}s}" for name in names)


def _row(label: str, cells: Sequence[str], columns: Sequence[Summary]) -> str:
    width = _width([column.contender for column in columns])
    return f"{label:{_LABEL}s}" + "".join(f"{cell_:>{width}s}" for cell_ in cells)


def _width(names: Sequence[str]) -> int:
    return max(28, *(len(name) + 2 for name in names))


def cell(measure: Measure, column: Summary) -> str:
    """Return a figure with its spread, such as "1.23 [1.10–1.40]"; "–" where nothing tells it."""
    value, spread = column.figures[measure.key], column.spread[measure.key]
    if value is None or spread is None:
        return "–"
    return f"{number(value)} [{number(spread[0])}–{number(spread[1])}]"


def scene_cell(column: Summary) -> str:
    """Return a scene's most telling figures."""
    return " / ".join(number(column.figures[key]) for key in _SCENE_MEASURES)


def number(value: float | None) -> str:
    """Return a figure with as many decimals as tell something; "–" for None."""
    if value is None:
        return "–"
    if abs(value) >= 1000.0 or float(value).is_integer():
        return f"{value:.0f}"
    return f"{value:.1f}" if abs(value) >= 20.0 else f"{value:.2f}"
