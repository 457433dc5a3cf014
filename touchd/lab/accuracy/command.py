"""`touchd bench accuracy`: from what the command line asks for to the lines that answer it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any, Literal, TypeAlias

from touchd.config.schema import Config
from touchd.errors import UsageError
from touchd.lab.accuracy.contenders import Contender, contenders
from touchd.lab.accuracy.files import as_json, csv_lines
from touchd.lab.accuracy.goals import verdicts
from touchd.lab.accuracy.keep import run_trials_once
from touchd.lab.accuracy.ranges import heights_of, names_of, seeds_of
from touchd.lab.accuracy.tables import by_sensor, heights_in, text_tables
from touchd.lab.accuracy.trials import Outcome, Trial
from touchd.lab.scenes import LAB_SCENES, LONG_SCENES

# Run only where they are named: what a method makes of paper is neither right nor wrong, and ten minutes are long.
_ON_REQUEST = ("stacks", *LONG_SCENES)

Say: TypeAlias = Callable[[str], None]
Form: TypeAlias = Literal["text", "json", "csv"]


@dataclass(frozen=True, slots=True)
class AccuracyOptions:
    """What to run, as the command line has it: lists apart by commas.

    None stands for everything there is; of the scenes, for all but the stacks of paper and those of ten minutes.
    """

    scenes: str | None
    heights: str
    methods: str | None
    seeds: str
    sweep: str | None
    jobs: int
    keep: Path | None
    frames: Path | None
    form: Form


@dataclass(frozen=True, slots=True)
class Plan:
    """What to run."""

    trials: tuple[Trial, ...]
    contenders: tuple[Contender, ...]


def plan(options: AccuracyOptions) -> Plan:
    """Return what options ask for. Raises UsageError."""
    scenes = names_of(options.scenes) or tuple(scene for scene in LAB_SCENES if scene not in _ON_REQUEST)
    for scene in scenes:
        if scene not in LAB_SCENES:
            raise UsageError(f"--scenes: there is no lab scene {scene!r}; choose from {', '.join(LAB_SCENES)}")
    trials = product(scenes, heights_of(options.heights), seeds_of(options.seeds))
    return Plan(tuple(Trial(*each) for each in trials), contenders(names_of(options.methods), options.sweep))


def accuracy(options: AccuracyOptions, say: Say) -> Iterator[str]:
    """Yield the lines of the tables; how far it is goes to ``say``. Raises UsageError."""
    wanted = plan(options)
    outcomes: list[Outcome] = []
    runs = run_trials_once(wanted.trials, wanted.contenders, options.jobs, options.keep, options.frames)
    for done, more in enumerate(runs, 1):
        outcomes += more
        trial = more[0].trial
        say(f"{done} of {len(wanted.trials)}: {trial.scene} at {trial.height_mm / 1000:g} m, seed {trial.seed}")
    outcomes.sort(key=lambda outcome: wanted.trials.index(outcome.trial))
    judged = judged_of([contender.name for contender in wanted.contenders])
    if options.form == "json":
        yield as_json(outcomes, about(outcomes), judged)
    elif options.form == "csv":
        yield from csv_lines(outcomes, heading(outcomes))
    else:
        yield from text_tables(outcomes, heading(outcomes))
        yield f"{heading(outcomes)}; what {judged} must reach:"
        yield from (verdict.line() for verdict in verdicts(outcomes, judged))


def judged_of(names: Sequence[str]) -> str:
    """Return the contender that the goals are for: the default method, or the first where it takes no part."""
    default = Config().touch.method
    return default if default in names else names[0]


def about(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return what every table must be headed with."""
    return {
        "simulated": True,
        "sensors": [sensor for sensor, _ in by_sensor(outcomes)],
        "seeds": sorted({outcome.trial.seed for outcome in outcomes}),
        "heights_mm": heights_in(outcomes),
        "touchd": version("touchd"),
    }


def heading(outcomes: Sequence[Outcome]) -> str:
    """Return the same as a line."""
    known = about(outcomes)
    seeds = ", ".join(str(seed) for seed in known["seeds"])
    return f"simulated: model of {' and '.join(known['sensors'])}, seeds {seeds}, touchd {known['touchd']}"
