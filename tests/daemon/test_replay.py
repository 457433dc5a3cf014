import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from touchd.cli import run_command_line
from touchd.formats.libfreenect import write_libfreenect
from touchd.geometry import ZeroPlane
from touchd.model import Frame

from clients.comparison import differences, learned_offset
from clients.harness import OscDump, PythonTuio
from golden.truth import read_events


def replay(recording: Path, *options: str | Path) -> int:
    return run_command_line(["replay", str(recording), *map(str, options)])


def test_a_real_kinect_s_recording_gives_one_event_line_a_frame(desk_recording: Path, tmp_path: Path) -> None:
    assert replay(desk_recording, "--events", tmp_path / "events.jsonl") == 0
    events = read_events(tmp_path / "events.jsonl")
    assert [event["frame"] for event in events] == list(range(80))
    times = [event["t"] for event in events]
    assert times[0] == 0.0
    assert times == sorted(set(times))


def test_a_short_recording_calibrates_on_its_first_third_and_says_so(
    desk_recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay(desk_recording, "--events", tmp_path / "events.jsonl") == 0
    states = [event["state"] for event in read_events(tmp_path / "events.jsonl")]
    assert states == ["calibrating"] * 26 + ["tracking"] * 54
    assert (
        "the recording has only 80 depth frames, so the surface is learned from its first 26 "
        "(calibration.frames is 300 where it is not set)" in capsys.readouterr().err
    )


def test_the_frame_after_calibration_frames_is_the_first_that_is_tracked(table_recording: Path, tmp_path: Path) -> None:
    assert replay(table_recording, "--config", table_recording / "touchd.yaml", "--events", tmp_path / "e") == 0
    states = [event["state"] for event in read_events(tmp_path / "e")]
    assert states == ["calibrating"] * 60 + ["tracking"] * 147


def test_the_same_recording_gives_the_same_bytes_twice_and_in_another_process(
    table_recording: Path, tmp_path: Path
) -> None:
    config = table_recording / "touchd.yaml"
    for name in ("one", "two"):
        assert replay(table_recording, "--config", config, "--events", tmp_path / name) == 0
    command: list[str | Path] = [sys.executable, "-m", "touchd", "replay", table_recording, "--config", config]
    environment = {**os.environ, "PYTHONHASHSEED": "42"}
    subprocess.run([*command, "--events", tmp_path / "three"], check=True, env=environment, capture_output=True)
    first = (tmp_path / "one").read_bytes()
    assert first.count(b'"cursors":[{') > 60
    assert (tmp_path / "two").read_bytes() == first
    assert (tmp_path / "three").read_bytes() == first


def test_without_an_events_file_touches_are_told_as_they_come_and_go(
    table_recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay(table_recording, "--config", table_recording / "touchd.yaml", "--speed", "max") == 0
    said = capsys.readouterr()
    assert [line.split()[2:5] for line in said.out.splitlines()] == [
        ["touch", str(number), word] for number in (1, 2, 3, 4) for word in ("down", "up")
    ]
    assert "207 frames, 4 touches" in said.err


def test_a_replay_leaves_the_state_folder_alone(
    table_recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "state"))
    assert replay(table_recording, "--config", table_recording / "touchd.yaml", "--events", tmp_path / "e") == 0
    assert not (tmp_path / "state").exists()


def test_a_recording_that_ends_during_calibration_says_so(
    desk_recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "touchd.yaml").write_text("calibration: {frames: 90}\n")
    assert replay(desk_recording, "--config", tmp_path / "touchd.yaml", "--events", tmp_path / "e") == 0
    assert {event["state"] for event in read_events(tmp_path / "e")} == {"calibrating"}
    assert (
        "the recording ended during calibration: it has 80 depth frames, calibration.frames is 90"
        in capsys.readouterr().err
    )


def test_an_area_size_that_the_camera_contradicts_is_a_warning(
    table_recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = (table_recording / "touchd.yaml").read_text().replace("[600.0, 420.0]", "[660.0, 420.0]")
    (tmp_path / "touchd.yaml").write_text(config)
    assert replay(table_recording, "--config", tmp_path / "touchd.yaml", "--events", tmp_path / "e") == 0
    assert "area.size_mm says 660 x 420 mm but the camera measures 60" in capsys.readouterr().err


def test_an_events_file_that_cannot_be_written_is_exit_code_73(
    desk_recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay(desk_recording, "--events", tmp_path / "absent" / "events.jsonl") == 73
    assert "No such file or directory" in capsys.readouterr().err


def test_a_recording_that_does_not_exist_is_exit_code_65(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert replay(tmp_path / "nothing", "--events", tmp_path / "e") == 65
    assert f"touchd: {tmp_path}/nothing does not exist: check the path of the recording\n" == capsys.readouterr().err
    assert not (tmp_path / "e").exists()


def test_all_invalid_frames_are_tracked_as_nothing(tmp_path: Path) -> None:
    blind = np.full((480, 640), 2047, np.uint16)
    write_libfreenect(tmp_path / "blind", (Frame(i, i * 33_333_000, blind) for i in range(9)), ZeroPlane())
    assert replay(tmp_path / "blind", "--events", tmp_path / "e") == 0
    events = read_events(tmp_path / "e")
    assert [event["state"] for event in events] == ["calibrating"] * 3 + ["tracking"] * 6
    assert all(event["cursors"] == [] for event in events)


def test_real_clients_see_at_30_hz_what_the_events_file_tells(table_recording: Path, tmp_path: Path) -> None:
    with PythonTuio() as listener, OscDump() as dump:
        config = (table_recording / "touchd.yaml").read_text()
        outputs = f'outputs: [{{tuio: {{to: ["{listener.destination}", "{dump.destination}"]}}}}]'
        (tmp_path / "touchd.yaml").write_text(f"{config}\n{outputs}\n")
        options = ("--config", tmp_path / "touchd.yaml", "--events", tmp_path / "e", "--send", "--speed", "1")
        assert replay(table_recording, *options) == 0
        listener.sync()
        dump.sync()
    events = read_events(tmp_path / "e")
    for log in (listener.log, dump.log):
        assert len(log.adds) == 4
        assert differences(log, events, learned_offset(log, events)) == []
