"""The tables of docs/accuracy.md."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from touchd.lab.accuracy.tables import number

Row: TypeAlias = Mapping[str, Any]


def markdown(results: Row) -> Iterator[str]:
    """Yield the lines: what was run, goals, a table for each sensor and height, scenes of the judged method."""
    yield head(results)
    yield ""
    yield f"What `{results['judged']}` must reach, all scenes together:"
    yield ""
    yield from _goals(results)
    yield ""
    yield "![How far cursors lie from the touch point, by method](accuracy/errors.svg)"
    for sensor in results["sensors"]:
        for height in [*results["heights_mm"], None]:
            columns = [s for s in results["summaries"] if (s["sensor"], s["height_mm"]) == (sensor, height)]
            if columns:
                yield from _titled(f"{_model(sensor)}, {f'{height / 1000:g} m' if height else 'all heights'}", results)
                yield from _measures(results, columns)
        yield from _titled(f"{_model(sensor)}: `{results['judged']}` by scene", results)
        yield from _scenes(results, sensor)


def head(results: Row) -> str:
    """Return the sentence that stands over every table."""
    seeds = ", ".join(str(seed) for seed in results["seeds"])
    models = " and ".join(_model(sensor) for sensor in results["sensors"])
    return f"**Simulated**: {models}; seeds {seeds}; touchd {results['touchd']}."


def _model(sensor: str) -> str:
    return f"model of {sensor}"


def _titled(title: str, results: Row) -> Iterator[str]:
    yield ""
    yield f"### {title[0].upper()}{title[1:]}"
    yield head(results)
    yield ""


def _goals(results: Row) -> Iterator[str]:
    yield "| | found | must be | |"
    yield "|---|---|---|---|"
    for goal in results["goals"]:
        measure = results["measures"][goal["key"]]
        unit = f" {measure['unit']}" if measure["unit"] else ""
        what = f"{goal['where']}: {measure['meaning']}"
        limit = f"{'≥' if goal['at_least'] else '≤'} {goal['limit']:g}{unit}"
        word = {True: "within", False: "**over**", None: "not told"}[goal["reached"]]
        yield f"| {what} | {number(goal['found'])}{unit if goal['found'] is not None else ''} | {limit} | {word} |"


def _measures(results: Row, columns: Sequence[Row]) -> Iterator[str]:
    yield "| | " + " | ".join(f"`{column['method']}`" for column in columns) + " |"
    yield "|---|" + "---|" * len(columns)
    told = ((key, m) for key, m in results["measures"].items() if any(c["spread"][key] for c in columns))
    for key, measure in told:
        unit = f", {measure['unit']}" if measure["unit"] else ""
        yield f"| {measure['meaning']}{unit} | " + " | ".join(_cell(column, key) for column in columns) + " |"


def _cell(column: Row, key: str) -> str:
    value, spread = column["figures"][key], column["spread"][key]
    return "–" if spread is None else f"{number(value)} ({number(spread[0])}–{number(spread[1])})"


_SCENE_KEYS = ("found", "false_a_minute", "switches", "error_mean", "error_p99")


def _scenes(results: Row, sensor: str) -> Iterator[str]:
    heights = results["heights_mm"]
    yield "In each cell: found %, false touches a minute, splits and swaps per touch %, error mean and p99 in mm."
    yield ""
    yield "| scene | " + " | ".join(f"{height / 1000:g} m" for height in heights) + " |"
    yield "|---|" + "---|" * len(heights)
    own = {
        (row["scene"], row["height_mm"]): row
        for row in results["scenes"]
        if (row["sensor"], row["method"]) == (sensor, results["judged"])
    }
    for scene in results["scenes_run"]:
        if any((scene, height) in own for height in heights):
            cells = [" · ".join(number(own[scene, h]["figures"][key]) for key in _SCENE_KEYS) for h in heights]
            yield f"| {scene} | " + " | ".join(cells) + " |"
