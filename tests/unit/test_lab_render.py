import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from touchd.cli import run_command_line
from touchd.config.load import load_config
from touchd.errors import OutputError, RecordingError, UsageError
from touchd.formats.recording import open_recording
from touchd.lab.render import render, render_scene
from touchd.lab.scenes import LabScene, lab_scene
from touchd.lab.score import score_events
from touchd.lab.scoring import HAPPENINGS_NAME, read_truth

EMPTY_FRAMES, FRAMES = 10, 70


def short_scene(name: str) -> LabScene:
    return replace(lab_scene(name, 750.0, 1), calibration_frames=EMPTY_FRAMES, frames=FRAMES)


def nowhere(_line: str) -> None:
    """Say nothing."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lab") / "taps"
    render_scene(short_scene("taps"), folder, nowhere)
    return folder


def test_a_rendered_scene_is_a_recording_of_its_frames(recording: Path) -> None:
    opened, scene = open_recording(recording), short_scene("taps")
    assert (len(opened), opened.notes) == (EMPTY_FRAMES + FRAMES, ())
    for index in (0, EMPTY_FRAMES, EMPTY_FRAMES + FRAMES - 1):
        np.testing.assert_array_equal(opened.read(index).raw, scene.frame(index).raw)
        assert abs(opened.times_ns[index] - scene.frame(index).t_ns) < 1000


def test_its_truth_has_a_list_for_each_frame(recording: Path) -> None:
    scene = short_scene("taps")
    truth = json.loads((recording / "truth.json").read_text())
    assert truth == [scene.truth(index).as_json() for index in range(EMPTY_FRAMES + FRAMES)]
    assert any(truth)


def test_what_happens_besides_fingertips_stands_in_a_file_of_its_own_where_anything_does(
    recording: Path, tmp_path: Path
) -> None:
    scene = short_scene("phone")
    render_scene(scene, tmp_path / "phone", nowhere)
    happenings = json.loads((tmp_path / "phone" / HAPPENINGS_NAME).read_text())
    held = [scene.truth(index).happening() for index in range(EMPTY_FRAMES + FRAMES)]
    assert happenings == [happening for happening in held if happening is not None]
    assert len(happenings) > 30
    read = read_truth(tmp_path / "phone" / "truth.json", scene.area.size_mm)
    assert set(read.happenings) == {happening["frame"] for happening in happenings}
    assert not (recording / HAPPENINGS_NAME).exists()


def test_its_config_tells_camera_area_and_calibration_frames_and_nothing_else(recording: Path) -> None:
    scene, config = short_scene("taps"), load_config(recording / "touchd.yaml")
    corners = config.area_corners()
    assert corners is not None
    np.testing.assert_allclose(corners.corners_px, scene.corners.corners_px, atol=1e-3)
    assert corners.size_mm == scene.corners.size_mm
    assert config.intrinsics(open_recording(recording).sensor.intrinsics) == scene.sensor.intrinsics
    assert config.calibration.frames == EMPTY_FRAMES
    assert not config.was_set("touch")
    assert not config.was_set("tracking")


def test_a_replay_of_it_can_be_scored(recording: Path, tmp_path: Path) -> None:
    events = tmp_path / "events.jsonl"
    config = str(recording / "touchd.yaml")
    assert run_command_line(["replay", str(recording), "--config", config, "--events", str(events)]) == 0
    lines = list(score_events(events, recording / "truth.json", None, as_json=False))
    assert lines[0] == f"{events} by the truth of {recording / 'truth.json'}:"
    assert any(line.startswith("touches found") for line in lines)
    (text,) = score_events(events, recording / "truth.json", None, as_json=True)
    assert json.loads(text)["touches"] >= 1


def test_a_score_needs_the_area_s_size(recording: Path, tmp_path: Path) -> None:
    alone = tmp_path / "truth.json"
    alone.write_bytes((recording / "truth.json").read_bytes())
    events = tmp_path / "events.jsonl"
    line = {"frame": 0, "t": 0.0, "state": "tracking", "cursors": [{"id": 1, "x": 0.5, "y": 0.5}]}
    events.write_text(json.dumps(line) + "\n")
    with pytest.raises(UsageError) as caught:
        list(score_events(events, alone, None, as_json=False))
    assert str(caught.value) == (
        f"the area's size is not known: {tmp_path / 'touchd.yaml'} gives no area.size_mm; give it with "
        "--size-mm WIDTH HEIGHT"
    )
    assert list(score_events(events, alone, (600.0, 400.0), as_json=False))


def test_a_truth_that_is_not_there_is_said_to_be_missing_whatever_else_is(tmp_path: Path) -> None:
    events, truth = tmp_path / "events.jsonl", tmp_path / "nowhere" / "truth.json"
    events.write_text('{"frame": 0, "t": 0.0, "state": "tracking", "cursors": []}\n')
    with pytest.raises(RecordingError) as caught:
        list(score_events(events, truth, None, as_json=False))
    assert str(caught.value) == f"{truth} cannot be read: No such file or directory; check its permissions and its disk"


def test_a_stereo_camera_s_scene_is_a_folder_of_pictures_in_mm(tmp_path: Path) -> None:
    scene = replace(short_scene("taps-stereo"), frames=5)
    render_scene(scene, tmp_path / "out", nowhere)
    opened = open_recording(tmp_path / "out")
    assert (len(opened), opened.sensor.unit) == (EMPTY_FRAMES + 5, "mm")
    np.testing.assert_array_equal(opened.read(12).raw, scene.frame(12).raw)


def test_a_folder_that_holds_something_is_refused(recording: Path) -> None:
    with pytest.raises(OutputError, match="is not empty"):
        render_scene(short_scene("taps"), recording, nowhere)


def test_a_scene_that_is_none_and_a_wrong_height_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="there is no lab scene 'dance'; choose one of"):
        render("dance", 750.0, 1, tmp_path / "out", nowhere)
    with pytest.raises(UsageError) as caught:
        render("taps", 75.0, 1, tmp_path / "out", nowhere)
    assert str(caught.value) == "--height: expected 400 to 4000 mm, found 75"
