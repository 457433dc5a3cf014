"""From a score to the figures that are shown."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from touchd.lab.scoring.rests import ThingScore
from touchd.lab.scoring.score import Samples, Score
from touchd.lab.scoring.upset import UpsetScore

_GAP_STEP_MM = 5.0
_RESOLVED_SHARE = 0.9


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of a score: None where the score has nothing to tell it by."""

    key: str
    meaning: str
    unit: str
    of: Callable[[Score], float | None]


def _share(part: float, whole: float, scale: float = 1.0) -> float | None:
    return scale * part / whole if whole > 0 else None


def _percentile(samples: Samples, percent: float) -> float | None:
    return float(np.percentile(samples, percent)) if samples else None


def _mean(samples: Samples) -> float | None:
    return float(np.mean(samples)) if samples else None


def _outlived(upset: UpsetScore) -> float | None:
    return max(upset.outlived_ms, default=0.0) if upset.upsets else None


def _around_things(things: ThingScore, count: int) -> float | None:
    """Return a count of what happens around things, None where there are none."""
    return float(count) if things.rests else None


def least_gap_mm(score: Score) -> float | None:
    """Return the least distance from which on two fingers have their own cursors in 9 of 10 frames.

    Counted in steps of 5 mm from the widest seen downwards; None where no two fingers came near each other.
    """
    resolved, unresolved = (np.array(gaps) for gaps in (score.resolved_gaps_mm, score.unresolved_gaps_mm))
    everything = np.concatenate([resolved, unresolved])
    if not everything.size:
        return None
    least = float(everything.max())
    for step in sorted(set((everything // _GAP_STEP_MM).tolist()), reverse=True):
        good = np.count_nonzero(resolved // _GAP_STEP_MM == step)
        if good < _RESOLVED_SHARE * np.count_nonzero(everything // _GAP_STEP_MM == step):
            break
        least = max(step * _GAP_STEP_MM, float(everything.min()))
    return least


MEASURES: Sequence[Measure] = (
    Measure("touches", "true touches", "", lambda s: float(s.touches)),
    Measure("found", "touches found", "%", lambda s: _share(s.found, s.touches, 100.0)),
    Measure(
        "free", "touches with the fingertip in plain sight", "%", lambda s: _share(s.free, s.free and s.touches, 100.0)
    ),
    Measure("found_free", "of those in plain sight found", "%", lambda s: _share(s.found_free, s.free, 100.0)),
    Measure("merged", "of them lost in the one before", "%", lambda s: _share(s.merged, s.touches, 100.0)),
    Measure("false_a_minute", "false touches a minute", "", lambda s: _share(s.false_touches, s.tracked_s, 60.0)),
    Measure("splits", "splits per touch", "%", lambda s: _share(s.splits, s.touches, 100.0)),
    Measure("swaps", "id swaps per touch", "%", lambda s: _share(s.swaps, s.touches, 100.0)),
    Measure("switches", "splits and id swaps per touch", "%", lambda s: _share(s.splits + s.swaps, s.touches, 100.0)),
    Measure(
        "switches_free",
        "the same of those in plain sight",
        "%",
        lambda s: _share(s.switched_free, s.free, 100.0),
    ),
    Measure("error_mean", "position error, mean", "mm", lambda s: _mean(s.errors_mm)),
    Measure("error_p95", "position error, p95", "mm", lambda s: _percentile(s.errors_mm, 95)),
    Measure("error_p99", "position error, p99", "mm", lambda s: _percentile(s.errors_mm, 99)),
    Measure("error_worst", "position error, worst", "mm", lambda s: _percentile(s.errors_mm, 100)),
    Measure("lag", "lag along the path, 0.3–0.9 m/s, mean", "ms", lambda s: _mean(s.lags_ms)),
    Measure("wobble", "wobble of a still finger, 1 sd", "mm", lambda s: _mean(s.wobbles_mm)),
    Measure("fires_median", "fires at a clearance, median", "mm", lambda s: _percentile(s.fired_mm, 50)),
    Measure("fires_p95", "fires at a clearance, p95", "mm", lambda s: _percentile(s.fired_mm, 95)),
    Measure("releases_median", "releases at a clearance, median", "mm", lambda s: _percentile(s.released_mm, 50)),
    Measure("releases_p95", "releases at a clearance, p95", "mm", lambda s: _percentile(s.released_mm, 95)),
    Measure("down_median", "touch-down delay, median", "frames", lambda s: _percentile(s.down_frames, 50)),
    Measure("down_p95", "touch-down delay, p95", "frames", lambda s: _percentile(s.down_frames, 95)),
    Measure("lift_median", "lift-off delay, median", "frames", lambda s: _percentile(s.lift_frames, 50)),
    Measure("lift_p95", "lift-off delay, p95", "frames", lambda s: _percentile(s.lift_frames, 95)),
    Measure("gap", "pinch resolved down to", "mm", least_gap_mm),
    Measure("outlived", "cursor's longest life after an upset", "ms", lambda s: _outlived(s.upset)),
    Measure(
        "after_found", "touches after an upset found", "%", lambda s: _share(s.upset.found_after, s.upset.after, 100.0)
    ),
    Measure("after_error", "position error after an upset, mean", "mm", lambda s: _mean(s.upset.errors_after_mm)),
    Measure("on_found", "touches on things found", "%", lambda s: _share(s.things.found_on, s.things.on, 100.0)),
    Measure(
        "beside_found",
        "touches beside things found",
        "%",
        lambda s: _share(s.things.found_beside, s.things.beside, 100.0),
    ),
    Measure(
        "lay_found",
        "touches where a thing lay found",
        "%",
        lambda s: _share(s.things.found_where_lay, s.things.where_lay, 100.0),
    ),
    Measure("on_false", "false touches on things", "", lambda s: _around_things(s.things, s.things.false_on)),
    Measure(
        "lay_false", "false touches where a thing lay", "", lambda s: _around_things(s.things, s.things.false_where_lay)
    ),
    Measure(
        "things_seen",
        "frames in which a thing is an object",
        "%",
        lambda s: _share(s.things.seen, s.things.lying, 100.0),
    ),
    Measure("ghosts", "objects that are none", "%", lambda s: _share(s.things.ghosts, s.things.told, 100.0)),
    Measure(
        "hand_right",
        "contacts given to the right hand",
        "%",
        lambda s: _share(s.owners.right_hand, s.owners.contacts, 100.0),
    ),
    Measure(
        "person_right",
        "contacts given to the right person",
        "%",
        lambda s: _share(s.owners.right_person, s.owners.contacts, 100.0),
    ),
    Measure(
        "side_right",
        "left or right hand right where said",
        "%",
        lambda s: _share(s.owners.right_side, s.owners.sided, 100.0),
    ),
    Measure("hovers_found", "hovers found", "%", lambda s: _share(s.hovering.found, s.hovering.hovering, 100.0)),
    Measure("hover_error", "hover height error, mean", "mm", lambda s: _mean(s.hovering.height_errors_mm)),
    Measure("hover_p95", "hover height error, p95", "mm", lambda s: _percentile(s.hovering.height_errors_mm, 95)),
    Measure("landing_error", "first frame's position error, mean", "mm", lambda s: _mean(s.hovering.landing_errors_mm)),
    Measure(
        "landing_speed",
        "first frame's velocity error, mean",
        "mm/s",
        lambda s: _mean(s.hovering.landing_speed_errors_mm_s),
    ),
)

BY_KEY: Mapping[str, Measure] = MappingProxyType({measure.key: measure for measure in MEASURES})


def figures(score: Score) -> dict[str, float | None]:
    """Return every measure of a score by its key."""
    return {measure.key: measure.of(score) for measure in MEASURES}
