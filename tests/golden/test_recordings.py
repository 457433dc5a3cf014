import json
from pathlib import Path

import numpy as np
import pytest
from touchd.cli import run_command_line

from golden.truth import Score, read_events, score


@pytest.fixture(scope="module")
def table_score(table_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Score:
    events = tmp_path_factory.mktemp("replay") / "events.jsonl"
    config = table_recording / "touchd.yaml"
    assert run_command_line(["replay", str(table_recording), "--config", str(config), "--events", str(events)]) == 0
    truth = json.loads((table_recording / "truth.json").read_text())
    return score(read_events(events), truth, (600.0, 420.0))


def test_every_touch_of_the_rendered_table_is_found_once_and_none_that_is_not_there(table_score: Score) -> None:
    assert table_score.touches == 4
    assert table_score.found == 4
    assert table_score.splits == 0
    assert table_score.false_cursors == 0


def test_touches_of_the_rendered_table_lie_where_the_paper_says_or_nearer(table_score: Score) -> None:
    # The paper saw 7 mm at worst at 0.75 m; this table is 0.82 m away.
    assert max(table_score.errors_mm) <= 7.0
    assert np.mean(table_score.errors_mm) <= 3.0


def test_touches_of_the_rendered_table_begin_without_delay(table_score: Score) -> None:
    assert max(table_score.late_frames) <= 0
