"""`touchd lab score`: any program's events against a truth file."""

import json
from collections.abc import Iterator
from pathlib import Path

from touchd.config.load import load_config
from touchd.errors import UsageError
from touchd.formats.folder import reading
from touchd.lab.accuracy.tables import number
from touchd.lab.render import CONFIG_NAME
from touchd.lab.scoring import MEASURES, figures, read_events, read_truth, score


def score_events(events: Path, truth: Path, size_mm: tuple[float, float] | None, as_json: bool) -> Iterator[str]:
    """Yield the figures of a program's events (JSON lines, see docs/design.md) by a truth.json.

    ``size_mm`` is the area's width and height; None: as in the touchd.yaml beside the truth. Raises RecordingError for
    files that are not what they should be, and UsageError where the size is not known.
    """
    seen = read_events(events)
    with reading(truth):
        truth.open("rb").close()  # a missing truth is told before a missing size
    found = figures(score(seen, read_truth(truth, size_mm or _size_mm_beside(truth))))
    if as_json:
        yield json.dumps(found)
        return
    yield f"{events} by the truth of {truth}:"
    for measure in (measure for measure in MEASURES if found[measure.key] is not None):
        unit = f" {measure.unit}" if measure.unit else ""
        yield f"{measure.meaning:42s}{number(found[measure.key]):>10s}{unit}"


def _size_mm_beside(truth: Path) -> tuple[float, float]:
    config = truth.parent / CONFIG_NAME
    area = load_config(config).area if config.exists() else None
    if area is None or area.size_mm is None:
        raise UsageError(
            f"the area's size is not known: {config} gives no area.size_mm; give it with --size-mm WIDTH HEIGHT"
        )
    return area.size_mm
