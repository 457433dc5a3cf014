"""What touchd's default method must reach, held against what it does reach."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from touchd.lab.accuracy.summary import summary
from touchd.lab.accuracy.trials import Outcome
from touchd.lab.scoring.measures import BY_KEY


@dataclass(frozen=True, slots=True)
class Goal:
    """A limit for a figure at a height: at most, or at least. ``crowded``: over crowds alone, ``scene``: over one."""

    key: str
    height_mm: float
    limit: float
    at_least: bool = False
    crowded: bool = False
    scene: str | None = None

    @property
    def where(self) -> str:
        """Return where it holds, such as "0.75 m, crowds"."""
        among = "crowds" if self.crowded else self.scene
        return f"{self.height_mm / 1000:g} m{f', {among}' if among else ''}"


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
        found = "no scene tells" if self.found is None else f"{self.found:.2f}{unit}"
        return (
            f"{word:6s} {goal.where}: {measure.meaning}: {found}, {'at least' if goal.at_least else 'at most'} "
            f"{goal.limit:g}{unit}"
        )


_SENSOR = "kinect-v1"
_NEAR, _FAR = 750.0, 1500.0
_BOTH = (_NEAR, _FAR)
_TOLD_OF = ("phone", "cup", "book", "laptop")  # a sheet of paper is too thin to be an object
_THINGS = (*_TOLD_OF, "paper")


def _at_both(key: str, limit: float, scenes: Sequence[str], at_least: bool = False) -> tuple[Goal, ...]:
    """Return a goal for each of several scenes at both heights."""
    return tuple(Goal(key, height, limit, at_least, scene=scene) for scene in scenes for height in _BOTH)


# What a surface that lives must hold, by scene.
_LIVING: Sequence[Goal] = (
    *_at_both("found", 100.0, ("drift", "drift-long"), at_least=True),
    *_at_both("false_a_minute", 0.0, ("drift", "drift-long", "knock", "blind", "near-head", "forearm", *_THINGS)),
    *_at_both("found_free", 98.0, ("forearm", "near-head"), at_least=True),
    *_at_both("outlived", 100.0, ("knock", "blind")),
    *_at_both("after_found", 100.0, ("knock", "blind"), at_least=True),
    Goal("after_error", _NEAR, 1.5, scene="knock"),
    Goal("after_error", _FAR, 3.0, scene="knock"),
    *_at_both("switches", 0.0, ("held",)),
    *_at_both("found", 100.0, ("held",), at_least=True),
    *_at_both("on_found", 100.0, _THINGS, at_least=True),
    *_at_both("lay_found", 100.0, _THINGS, at_least=True),
    *_at_both("ghosts", 0.0, _TOLD_OF),
    *_at_both("hand_right", 99.0, ("four-hands",), at_least=True),
    *_at_both("person_right", 99.0, ("four-hands",), at_least=True),
    Goal("hover_p95", _NEAR, 3.0, scene="hover-height"),
)

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
    *_LIVING,
)


def verdicts(outcomes: Sequence[Outcome], contender: str) -> Iterator[Verdict]:
    """Yield a verdict on each goal at a height, and for a scene, that was run.

    They are for a Kinect v1: no other camera counts.
    """
    outcomes = [outcome for outcome in outcomes if outcome.sensor == _SENSOR]
    heights = {outcome.trial.height_mm for outcome in outcomes}
    scenes = {outcome.trial.scene for outcome in outcomes}
    for goal in GOALS:
        if goal.height_mm in heights and goal.scene in (None, *scenes):
            among = summary(outcomes, contender, goal.height_mm, goal.scene, goal.crowded)
            yield Verdict(goal, among.figures[goal.key])
