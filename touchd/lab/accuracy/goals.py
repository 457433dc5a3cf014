"""What touchd's default method must reach, held against what it does reach."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from touchd.lab.accuracy.summary import summary
from touchd.lab.accuracy.trials import Outcome
from touchd.lab.scoring.measures import BY_KEY


@dataclass(frozen=True, slots=True)
class Goal:
    """A limit for a figure at a height: at most, or at least. ``crowded``: over crowds alone."""

    key: str
    height_mm: float
    limit: float
    at_least: bool = False
    crowded: bool = False


@dataclass(frozen=True, slots=True)
class Verdict:
    """A goal and what was found; None where the scenes had nothing to tell it by."""

    goal: Goal
    found: float | None

    @property
    def reached(self) -> bool | None:
        """Whether the goal is reached; None where nothing tells."""
        if self.found is None:
            return None
        return self.found >= self.goal.limit if self.goal.at_least else self.found <= self.goal.limit

    def line(self) -> str:
        """Return it as a sentence, as `touchd bench` does for times."""
        goal, measure = self.goal, BY_KEY[self.goal.key]
        word = {True: "within", False: "OVER", None: "untold"}[self.reached]
        unit = f" {measure.unit}" if measure.unit else ""
        where = f"{goal.height_mm / 1000:g} m{', crowds' if goal.crowded else ''}"
        found = "no scene tells" if self.found is None else f"{self.found:.2f}{unit}"
        return (
            f"{word:6s} {where}: {measure.meaning}: {found}, {'at least' if goal.at_least else 'at most'} "
            f"{goal.limit:g}{unit}"
        )


_SENSOR = "kinect-v1"
_NEAR, _FAR = 750.0, 1500.0
GOALS: Sequence[Goal] = (
    Goal("found", _NEAR, 100.0, at_least=True),
    Goal("found", _FAR, 98.0, at_least=True),
    Goal("false_a_minute", _NEAR, 0.0),
    Goal("false_a_minute", _FAR, 0.2),
    Goal("switches", _NEAR, 0.0),
    Goal("switches", _FAR, 1.0),
    Goal("error_mean", _NEAR, 1.5),
    Goal("error_mean", _FAR, 3.0),
    Goal("error_p99", _NEAR, 4.0),
    Goal("error_p99", _FAR, 9.0),
    Goal("wobble", _NEAR, 0.2),
    Goal("wobble", _FAR, 0.7),
    Goal("fires_p95", _NEAR, 8.0),
    Goal("fires_p95", _FAR, 16.0),
    Goal("down_p95", _NEAR, 1.0),
    Goal("down_p95", _FAR, 1.0),
    Goal("lift_p95", _NEAR, 2.0),
    Goal("lift_p95", _FAR, 2.0),
    Goal("lag", _NEAR, 20.0),
    Goal("lag", _FAR, 25.0),
    Goal("gap", _NEAR, 22.0),
    Goal("gap", _FAR, 42.0),
    Goal("found", _NEAR, 100.0, at_least=True, crowded=True),
    Goal("found", _FAR, 92.0, at_least=True, crowded=True),
    Goal("swaps", _NEAR, 0.0, crowded=True),
    Goal("swaps", _FAR, 1.0, crowded=True),
)


def verdicts(outcomes: Sequence[Outcome], contender: str) -> Iterator[Verdict]:
    """Yield a verdict on each goal at a height that was run; they are for a Kinect v1: no other camera counts."""
    outcomes = [outcome for outcome in outcomes if outcome.sensor == _SENSOR]
    heights = {outcome.trial.height_mm for outcome in outcomes}
    for goal in GOALS:
        if goal.height_mm in heights:
            crowd = summary(outcomes, contender, goal.height_mm, crowded_only=goal.crowded)
            yield Verdict(goal, crowd.figures[goal.key])
