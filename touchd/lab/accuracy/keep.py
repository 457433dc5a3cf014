"""Outcomes kept in a folder, so that a long run can be broken off, taken up again, or done in parts."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from touchd.errors import RecordingError
from touchd.formats.folder import reading, writing
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.trials import Outcome, Trial, run_trials
from touchd.lab.scoring import Score

Kind = TypeVar("Kind")


def run_trials_once(
    trials: Sequence[Trial], contenders: Sequence[Contender], jobs: int, folder: Path | None, frames: Path | None
) -> Iterator[list[Outcome]]:
    """Yield the outcomes of each trial, in any order: first those in the folder, then the others, which are put there.

    The folder knows nothing of changes to the code: empty it after any. ``frames``: see :func:`run_trials`. Raises
    OutputError, and RecordingError for a file in either folder that cannot be read.
    """
    if folder is None:
        yield from run_trials(trials, contenders, jobs, frames)
        return
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    known = {trial: [path for c in contenders if (path := _path(folder, trial, c.name)).exists()] for trial in trials}
    for paths in known.values():
        if len(paths) == len(contenders):
            yield [_load(path) for path in paths]
    left = [trial for trial, paths in known.items() if len(paths) < len(contenders)]
    for outcomes in run_trials(left, contenders, jobs, frames):
        for outcome in outcomes:
            _store(_path(folder, outcome.trial, outcome.contender), outcome)
        yield outcomes


def _path(folder: Path, trial: Trial, contender: str) -> Path:
    name = f"{trial.scene}-{trial.height_mm:g}-{trial.seed}-{contender}.json"
    return folder / name.replace(" ", "-").replace("/", "-")


def _store(path: Path, outcome: Outcome) -> None:
    with writing(path):
        path.write_text(json.dumps(asdict(outcome)), encoding="utf-8")


def _load(path: Path) -> Outcome:
    with reading(path):
        text = path.read_text(encoding="utf-8")
    try:
        stored: dict[str, Any] = json.loads(text)
        score = _score(Score(), stored["score"])
        return Outcome(**stored | {"trial": Trial(**stored["trial"]), "score": score})
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise RecordingError(f"{path} holds no outcome ({type(error).__name__}: {error}): delete it") from error


def _score(empty: Kind, stored: dict[str, Any]) -> Kind:
    """Return a score, with the scores within it, from what is stored of it; ``empty`` is one of its kind."""
    values = {
        name: tuple(value)
        if isinstance(value, list)
        else _score(getattr(empty, name), value)
        if isinstance(value, dict)
        else value
        for name, value in stored.items()
    }
    return type(empty)(**values)
