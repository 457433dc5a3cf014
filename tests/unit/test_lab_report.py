import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import cv2
import numpy as np
import pytest
from touchd.errors import RecordingError
from touchd.lab.accuracy.command import about
from touchd.lab.accuracy.files import as_json
from touchd.lab.accuracy.trials import Outcome, Trial
from touchd.lab.report import document
from touchd.lab.report.chart import error_chart
from touchd.lab.report.document import BEGIN, END, between_marks, write_report
from touchd.lab.report.stages import stage_pictures
from touchd.lab.report.tables import markdown
from touchd.lab.scoring import Score


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    score = Score(touches=4, found=3, tracked_s=60.0, errors_mm=(1.0, 2.0, 3.0))
    outcomes = [
        Outcome(method, Trial(scene, height, seed), sensor, False, score)
        for method in ("fingertip", "shell")
        for scene, sensor in (("taps", "kinect-v1"), ("drag", "kinect-v1"), ("taps-stereo", "stereo"))
        for height in (750.0, 1500.0)
        for seed in (101, 102)
    ]
    found: dict[str, Any] = json.loads(as_json(outcomes, about(outcomes), "fingertip"))
    return found


def test_every_table_stands_under_what_was_simulated(results: dict[str, Any]) -> None:
    text = "\n".join(markdown(results))
    tables = sum(line.startswith("|---|") for line in text.splitlines())
    assert tables == text.count("**Simulated**: model of kinect-v1 and model of stereo; seeds 101, 102; touchd ")
    assert tables == 1 + 2 * (3 + 1)


def test_goals_are_marked_where_they_are_missed(results: dict[str, Any]) -> None:
    lines = list(markdown(results))
    assert "| 0.75 m: touches found | 75 % | ≥ 100 % | **over** |" in lines
    assert "| 1.5 m: position error, mean | 2 mm | ≤ 3 mm | within |" in lines
    assert "| 0.75 m: wobble of a still finger, 1 sd | – | ≤ 0.2 mm | not told |" in lines


def test_scenes_stand_under_the_camera_they_were_seen_by(results: dict[str, Any]) -> None:
    kinect, stereo = "\n".join(markdown(results)).split("### Model of stereo, 0.75 m")
    assert "| drag | 75 · 0 · 0 · 2 · 3 | 75 · 0 · 0 · 2 · 3 |" in kinect
    assert "| taps-stereo |" in stereo
    assert "| drag |" not in stereo


def test_the_chart_has_a_line_for_each_method_at_each_height(results: dict[str, Any]) -> None:
    chart = ET.fromstring(error_chart(results))
    assert len(chart.findall("{http://www.w3.org/2000/svg}polyline")) == 4


def test_what_people_wrote_around_the_marks_stays() -> None:
    page = f"# Title\nwords\n{BEGIN}\nold\n{END}\nmore words\n"
    assert between_marks(page, "new") == f"# Title\nwords\n{BEGIN}\nnew\n{END}\nmore words\n"


def test_a_page_without_marks_is_refused() -> None:
    with pytest.raises(RecordingError) as caught:
        between_marks("# Title\n", "new")
    assert str(caught.value) == (
        f"accuracy.md has no line {BEGIN!r} with {END!r} after it: put them where the tables belong"
    )


def test_the_report_writes_page_chart_and_pictures(
    results: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = np.zeros((4, 4, 3), np.uint8)
    monkeypatch.setattr(document, "stage_pictures", lambda: [("stages-shell-750", picture)])
    written = list(write_report(tmp_path, results))
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [
        "accuracy.md",
        "accuracy/errors.svg",
        "accuracy/stages-shell-750.png",
    ]
    assert all(path.stat().st_size for path in written)
    before = written[0].read_text()
    list(write_report(tmp_path, results))
    assert written[0].read_text() == before


def test_there_is_a_picture_of_the_stages_of_each_method() -> None:
    name, picture = next(stage_pictures())
    assert name == "stages-shell-750"
    height, width, colours = picture.shape
    assert (height, colours) == (326, 3)
    assert width == 4 * 308
    assert cv2.imencode(".png", picture)[0]
