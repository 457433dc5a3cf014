import csv
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from touchd.config.schema import Config
from touchd.errors import RecordingError, UsageError
from touchd.lab.accuracy import keep
from touchd.lab.accuracy.command import AccuracyOptions, Form, heading, judged_of, plan
from touchd.lab.accuracy.contenders import Contender, contenders
from touchd.lab.accuracy.files import as_json, csv_lines
from touchd.lab.accuracy.frames import played
from touchd.lab.accuracy.goals import GOALS, verdicts
from touchd.lab.accuracy.keep import run_trials_once
from touchd.lab.accuracy.summary import summary
from touchd.lab.accuracy.tables import text_tables
from touchd.lab.accuracy.trials import Outcome, Trial, learn, run_scene
from touchd.lab.baselines import BASELINES
from touchd.lab.scenes import LAB_SCENES, LONG_SCENES, LabScene, lab_scene
from touchd.lab.scoring import Score
from touchd.lab.scoring.hovering import HoverScore
from touchd.lab.scoring.rests import ThingScore
from touchd.lab.scoring.upset import UpsetScore

OPTIONS = AccuracyOptions("taps,pinch", "750,1500", "shell", "1-3", None, 1, None, None, "text")
TWO = (Contender("shell", "shell"), Contender("mean-sigma", "shell", "mean-sigma"))


def short_scene() -> LabScene:
    return replace(lab_scene("taps", 750.0, 1), calibration_frames=20, frames=60)


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return run_scene(short_scene(), played(short_scene(), None), TWO)


def outcome(seed: int, score: Score, height_mm: float = 750.0, crowded: bool = False) -> Outcome:
    return Outcome("shell", Trial("taps", height_mm, seed), "kinect-v1", crowded, score)


def test_each_contender_has_an_outcome_of_the_same_scene(outcomes: list[Outcome]) -> None:
    assert [one.contender for one in outcomes] == ["shell", "mean-sigma"]
    assert {one.trial for one in outcomes} == {Trial("taps", 750.0, 1)}
    assert {one.sensor for one in outcomes} == {"kinect-v1"}
    assert len({one.score.touches for one in outcomes}) == 1
    assert outcomes[0].score.touches > 0


def test_the_same_trial_has_the_same_outcome_again(outcomes: list[Outcome]) -> None:
    assert run_scene(short_scene(), played(short_scene(), None), TWO) == outcomes


def test_a_run_that_is_taken_up_again_has_the_outcomes_it_had(
    tmp_path: Path, outcomes: list[Outcome], monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[Trial] = []

    def run(
        trials: Sequence[Trial], _contenders: Sequence[Contender], _jobs: int, _frames: Path | None
    ) -> Iterator[list[Outcome]]:
        ran.extend(trials)
        yield from ([replace(one, trial=trial) for one in outcomes] for trial in trials)

    monkeypatch.setattr(keep, "run_trials", run)
    first, second = Trial("taps", 750.0, 1), Trial("taps", 750.0, 2)
    before = list(run_trials_once([first], TWO, 1, tmp_path / "kept", None))
    again = list(run_trials_once([first, second], TWO, 1, tmp_path / "kept", None))
    assert ran == [first, second]
    assert again[0] == before[0] == outcomes
    assert [one.trial for one in again[1]] == [second, second]


def test_a_kept_outcome_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "taps-750-1-shell.json"
    path.write_text("{}")
    with pytest.raises(RecordingError) as caught:
        list(run_trials_once([Trial("taps", 750.0, 1)], TWO[:1], 1, tmp_path, None))
    assert str(caught.value) == f"{path} holds no outcome (KeyError: 'score'): delete it"


def test_a_plan_is_every_scene_at_every_height_with_every_seed() -> None:
    wanted = plan(OPTIONS)
    assert len(wanted.trials) == 2 * 2 * 3
    assert wanted.trials[0] == Trial("taps", 750.0, 1)
    assert wanted.trials[-1] == Trial("pinch", 1500.0, 3)


def test_without_names_all_methods_and_baselines_take_part_in_all_scenes_but_stacks_and_long_ones() -> None:
    wanted = plan(replace(OPTIONS, scenes=None, methods=None, seeds="1", heights="750"))
    names = [contender.name for contender in wanted.contenders]
    assert set(names) >= {"fingertip", "shell", *BASELINES}
    run = {trial.scene for trial in wanted.trials}
    assert run == set(LAB_SCENES) - {"stacks", "drift-long", "held"}
    for scene in ("stacks", *LONG_SCENES):
        assert scene in {trial.scene for trial in plan(replace(OPTIONS, scenes=scene)).trials}


def test_a_sweep_makes_a_contender_of_each_value() -> None:
    found = contenders(["shell"], "far_mm=8:20:4")
    assert [one.name for one in found] == ["shell far_mm=8", "shell far_mm=12", "shell far_mm=16", "shell far_mm=20"]
    assert [one.config().touch.far_mm for one in found] == [8, 12, 16, 20]
    mixed = contenders(["shell"], "touch.far_mm=auto,14.5")
    assert [one.config().touch.far_mm for one in mixed] == ["auto", 14.5]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"scenes": "dance"}, "--scenes: there is no lab scene 'dance'; choose from targets"),
        ({"methods": "magic"}, "--methods: there is no method 'magic'; choose from"),
        ({"heights": "75"}, "--heights: expected heights of 400 to 4000 mm such as 750,1500, found '75'"),
        ({"heights": "low"}, "--heights: expected heights of 400 to 4000 mm such as 750,1500, found 'low'"),
        ({"seeds": "a-b"}, "--seeds: expected seeds such as 101-105 or 1,7,9, found 'a-b'"),
        ({"seeds": "5-1"}, "--seeds: '5-1' has 0 seeds; expected 1 to 200"),
        ({"sweep": "far_mm"}, "--sweep: expected KEY=FIRST:LAST:STEP such as far_mm=8:20:1, found 'far_mm'"),
        ({"sweep": "fat_mm=1"}, "--sweep: 'fat_mm' is no key of the config; touchd show-config lists the keys"),
        ({"sweep": "frames=1:x:2"}, "--sweep: expected FIRST:LAST:STEP in numbers such as 8:20:1, found '1:x:2'"),
        ({"sweep": "far_mm=1:9:0"}, "--sweep: expected FIRST:LAST:STEP in numbers such as 8:20:1, found '1:9:0'"),
        ({"sweep": "far_mm=500"}, "touch.far_mm"),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_sentence(change: dict[str, str], sentence: str) -> None:
    with pytest.raises(UsageError) as caught:
        plan(replace(OPTIONS, **change))  # type: ignore[arg-type]
    assert sentence in str(caught.value)


def test_a_summary_pools_the_touches_and_spreads_over_the_seeds() -> None:
    runs = [
        outcome(1, Score(touches=10, found=10, errors_mm=(1.0, 1.0))),
        outcome(2, Score(touches=30, found=15, errors_mm=(4.0,))),
    ]
    got = summary(runs, "shell")
    assert (got.figures["found"], got.spread["found"]) == (62.5, (50.0, 100.0))
    assert (got.figures["error_mean"], got.spread["error_mean"]) == (2.0, (1.0, 4.0))
    assert got.error_percentiles_mm[-1] == 4.0
    assert got.spread["gap"] is None


def test_goals_are_within_over_or_untold() -> None:
    runs = [outcome(1, Score(touches=10, found=10, tracked_s=60.0, false_touches=1, errors_mm=(2.0, 2.0)))]
    lines = [verdict.line() for verdict in verdicts(runs, "shell")]
    assert "within 0.75 m: touches found: 100.00 %, at least 100 %" in lines
    assert "OVER   0.75 m: false touches a minute: 1.00, at most 0" in lines
    assert "OVER   0.75 m: position error, mean: 2.00 mm, at most 1.5 mm" in lines
    assert "untold 0.75 m: wobble of a still finger, 1 sd: no scene tells, at most 0.2 mm" in lines
    assert "untold 0.75 m, crowds: touches found: no scene tells, at least 100 %" in lines
    assert not any("1.5 m:" in line for line in lines)


def test_goals_for_crowds_look_at_crowds_alone() -> None:
    runs = [
        outcome(1, Score(touches=9, found=9), 1500.0),
        outcome(1, Score(touches=10, found=5), 1500.0, crowded=True),
    ]
    lines = [verdict.line() for verdict in verdicts(runs, "shell")]
    assert "OVER   1.5 m, crowds: touches found: 50.00 %, at least 92 %" in lines
    assert "OVER   1.5 m: touches found: 73.68 %, at least 98 %" in lines


def test_goals_for_a_scene_look_at_it_alone_and_are_silent_where_it_was_not_run() -> None:
    knocked = Score(touches=4, found=4, upset=UpsetScore(upsets=1, outlived_ms=(66.7, 133.3), after=4, found_after=3))
    runs = [outcome(1, Score(touches=6, found=6)), replace(outcome(1, knocked), trial=Trial("knock", 750.0, 1))]
    lines = [verdict.line() for verdict in verdicts(runs, "shell")]
    assert "OVER   0.75 m, knock: cursor's longest life after an upset: 133.30 ms, at most 100 ms" in lines
    assert "OVER   0.75 m, knock: touches after an upset found: 75.00 %, at least 100 %" in lines
    assert "within 0.75 m: touches found: 100.00 %, at least 100 %" in lines
    assert not any("blind" in line or "four-hands" in line for line in lines)


def test_every_goal_for_a_scene_is_for_one_that_there_is() -> None:
    assert {goal.scene for goal in GOALS} - {None} < set(LAB_SCENES)


def test_a_table_has_no_row_for_what_nothing_tells() -> None:
    plain = "\n".join(text_tables([outcome(1, Score(touches=4, found=4))], "head"))
    assert "touches found, %" in plain
    assert "hover height" not in plain
    hovered = Score(touches=4, found=4, hovering=HoverScore(hovering=9, found=9, height_errors_mm=(1.0,) * 9))
    assert "hover height error, mean, mm" in "\n".join(text_tables([outcome(1, hovered)], "head"))


def test_what_happens_to_things_and_after_upsets_has_a_table_by_scene_where_a_scene_tells_it() -> None:
    plain = outcome(1, Score(touches=4, found=4))
    assert not any("upsets and things" in line for line in text_tables([plain], "head"))
    laid = replace(plain, score=Score(things=ThingScore(rests=2, on=4, found_on=3)), trial=Trial("cup", 750.0, 1))
    lines = list(text_tables([plain, laid], "head"))
    table = lines[lines.index("head; kinect-v1, 0.75 m; upsets and things") :]
    assert "shell" in table[1]
    assert table[2].split() == ["cup:", "touches", "on", "things", "found,", "%", "75"]
    assert not any(line.startswith("taps:") for line in table)


def test_the_default_method_is_judged_or_the_first_where_it_takes_no_part() -> None:
    default = Config().touch.method
    assert judged_of(["plane", default]) == default
    assert judged_of(["plane", "snapshot"]) == "plane"


def test_every_table_says_that_it_is_simulated_by_what_model_and_with_which_seeds(outcomes: list[Outcome]) -> None:
    head = heading(outcomes)
    assert head.startswith("simulated: model of kinect-v1, seeds 1, touchd ")
    tables = "\n".join(text_tables(outcomes, head)).strip().split("\n\n")
    assert len(tables) == 2
    assert all(each.startswith(head) for each in tables)


@pytest.mark.parametrize("form", ["json", "csv"])
def test_programs_get_the_same_figures(form: Form, outcomes: list[Outcome]) -> None:
    found = summary(outcomes, "shell").figures
    if form == "json":
        document = json.loads(as_json(outcomes, {"simulated": True}, "shell"))
        assert document["simulated"] is True
        own = next(one["figures"] for one in document["summaries"] if one["method"] == "shell")
        assert own == pytest.approx(found)
    else:
        head, *rows = csv_lines(outcomes, heading(outcomes))
        assert head.startswith("# simulated")
        row = next(row for row in csv.DictReader(rows) if row["method"] == "shell")
        assert float(row["found"]) == pytest.approx(found["found"])
        assert row["wobble"] == ""


def test_the_baselines_see_the_same_surface_each_in_its_way() -> None:
    learned = learn(replace(lab_scene("taps", 750.0, 1), calibration_frames=20))
    middle = (slice(200, 280), slice(280, 360))
    raw = learned.first.raw[middle]
    for name, model in BASELINES.items():
        surface = model(learned.surface, learned.first)
        assert surface.valid[middle].mean() > 0.9, name
        off = surface.reference[middle] - raw.astype(np.float32)
        assert abs(float(np.median(off))) < 2.0, name
        assert np.all(surface.dmax[surface.valid] <= surface.reference[surface.valid] + 1.0), name
