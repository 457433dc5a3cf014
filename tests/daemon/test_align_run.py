"""`touchd align` against a running daemon that sees fingers on the corners of an area."""

import json
import os
import re
import signal
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.control.commands import align_lines
from touchd.control.paths import find_control_socket
from touchd.formats.libfreenect import write_libfreenect
from touchd.geometry import ZeroPlane
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Area, Hand, TableCamera
from touchd.table.table import Table

from clients.harness import PATIENCE_S
from daemon.running import TOUCHD, running

EMPTY_FRAMES, HELD_FRAMES, LIFTED_FRAMES = 24, 29, 9
FRAME_NS = 33_333_000
AREA = Area((0.0, 0.0), (576.0, 416.0))
INNER_AREA = Area((0.0, 0.0), (400.0, 240.0))  # with room for hands all round
AIM_MM = 4.0


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A daemon's config: it plays fingers that are held on the four corners, one after the other, again and again."""
    table = Table(TableCamera(height_mm=800.0, tilt_deg=5.0), seed=1)
    hands: list[list[Hand]] = [[] for _ in range(EMPTY_FRAMES)]
    for corner in ((0, 0), (1, 0), (1, 1), (0, 1)):
        hands += [[pointing_hand(HandPose(AREA.at(*corner)))]] * HELD_FRAMES + [[]] * LIFTED_FRAMES
    frames = (table.render(present, index * FRAME_NS, index) for index, present in enumerate(hands))
    write_libfreenect(tmp_path / "recording", frames, ZeroPlane())
    path = tmp_path / "touchd.yaml"
    path.write_text("source: {kind: recording, path: recording}\ncalibration: {frames: 20}\noutputs: []\n")
    return path


@pytest.fixture
def config_from_two_sides(tmp_path: Path) -> Path:
    """A config as above: after four empty seconds, people aim 4 mm ahead of their touch, from below and from above."""
    table = Table(TableCamera(height_mm=800.0, tilt_deg=5.0), seed=1)
    frames = [table.render([], 0, 0) for _ in range(EMPTY_FRAMES)] * 6
    for heading_deg, ahead in ((0.0, (0.0, -AIM_MM)), (180.0, (0.0, AIM_MM))):
        for corner in ((0, 0), (1, 0), (1, 1), (0, 1)):
            x, y = INNER_AREA.at(*corner)
            hand = pointing_hand(HandPose((x - ahead[0], y - ahead[1]), heading_deg=heading_deg))
            frames += [table.render([hand], 0, 0) for _ in range(HELD_FRAMES + 9)]
            frames += [table.render([], 0, 0) for _ in range(LIFTED_FRAMES)]
    numbered = (replace(frame, index=i, t_ns=i * FRAME_NS) for i, frame in enumerate(frames))
    write_libfreenect(tmp_path / "recording", numbered, ZeroPlane())
    path = tmp_path / "touchd.yaml"
    path.write_text("source: {kind: recording, path: recording}\ncalibration: {frames: 20}\noutputs: []\n")
    return path


def touchd(tmp_path: Path, *words: str) -> str:
    environment = {**os.environ, "STATE_DIRECTORY": str(tmp_path / "state")}
    done = subprocess.run([*TOUCHD, *words], check=True, capture_output=True, text=True, env=environment, timeout=60)
    return done.stdout


def test_an_alignment_is_in_force_at_once_and_after_a_restart(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        said = touchd(tmp_path, "align")
        found = re.search(r"aligned and in force: (\d+) x (\d+) mm, residual (\d+\.\d) mm; kept in (.*)", said)
        assert found is not None, said
        # The user may begin at any corner, so width and height may be swapped.
        assert sorted(map(float, found.group(1, 2))) == pytest.approx([416.0, 576.0], abs=8.0)
        assert found.group(4) == str(tmp_path / "state" / "alignment.json")
        assert "area      from touchd align, " in touchd(tmp_path, "status")
        assert daemon.end(signal.SIGTERM) == 0
        assert "state: paused (being aligned)" in daemon.lines
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        assert "area      from touchd align, " in touchd(tmp_path, "status")
        assert daemon.end(signal.SIGTERM) == 0


def test_from_two_sides_it_is_measured_how_far_ahead_people_aim_and_kept(
    config_from_two_sides: Path, tmp_path: Path
) -> None:
    with running(config_from_two_sides, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        environment = {**os.environ, "STATE_DIRECTORY": str(tmp_path / "state")}
        # Asked from here, it begins before the first touch: the rounds must not be mixed.
        said = "\n".join(line.text for line in align_lines(find_control_socket(environment, None), 4, 2))
        assert daemon.end(signal.SIGTERM) == 0
    found = re.search(r"people aim ahead of their touch by (\S+) mm from the bottom, (\S+) mm from the top", said)
    assert found is not None, said
    assert list(map(float, found.groups())) == pytest.approx([AIM_MM, AIM_MM], abs=1.5)
    kept = json.loads((tmp_path / "state" / "alignment.json").read_text())
    assert kept["size_mm"] == pytest.approx([400.0, 240.0], abs=4.0)
    assert kept["eye"]["bottom"] == pytest.approx(AIM_MM, abs=1.5)
    assert kept["residual_mm"] < 3.0


def test_an_alignment_that_is_ended_leaves_the_area_as_it_was(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        environment = {**os.environ, "STATE_DIRECTORY": str(tmp_path / "state")}
        aligning = subprocess.Popen([*TOUCHD, "align"], stdout=subprocess.PIPE, text=True, env=environment)
        daemon.wait_for("state: paused (being aligned)")
        aligning.send_signal(signal.SIGINT)
        said, _ = aligning.communicate(timeout=PATIENCE_S)
        assert "alignment ended: the area stays as it was" in said
        daemon.wait_for("state: tracking", times=2)
        assert "area      guessed, " in touchd(tmp_path, "status")
        assert daemon.end(signal.SIGTERM) == 0
