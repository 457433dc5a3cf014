import signal
from pathlib import Path

import pytest

from clients.harness import PATIENCE_S, PythonTuio
from daemon.running import running, wait_until


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_in_the_middle_of_a_touch_it_ends_every_touch_and_exits_with_0(
    number: signal.Signals, config: Path, client: PythonTuio, tmp_path: Path
) -> None:
    with running(config, tmp_path / "state") as daemon:
        wait_until(lambda: bool(client.log.adds))
        assert daemon.end(number) == 0
    client.sync()
    assert client.log.left_over() == set()
    assert client.log.removes
    assert f"stopping: {number.name}" in daemon.lines


def test_a_recording_plays_over_and_over_and_no_id_comes_twice(
    config: Path, client: PythonTuio, tmp_path: Path
) -> None:
    with running(config, tmp_path / "state") as daemon:
        wait_until(lambda: len(client.log.adds) >= 5)
        assert daemon.end(signal.SIGTERM) == 0
    assert len(set(client.log.adds)) == len(client.log.adds)


def test_the_surface_is_kept_and_the_next_start_needs_no_calibration(config: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    with running(config, state) as daemon:
        daemon.wait_for("surface: 821 mm away, tilted 3°")
        assert daemon.end(signal.SIGTERM) == 0
    with running(config, state) as daemon:
        daemon.wait_for("state: tracking")
        assert daemon.end(signal.SIGTERM) == 0
    assert f"using the surface in {state}/surface.touchd" in daemon.lines
    assert not any("state: calibrating" in line for line in daemon.lines)


def test_a_damaged_surface_is_named_and_learned_anew(config: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    state.mkdir()
    (state / "surface.touchd").write_bytes(b"not a surface")
    with running(config, state) as daemon:
        daemon.wait_for("state: tracking")
        assert daemon.end(signal.SIGTERM) == 0
    assert f"{state}/surface.touchd: this is no surface file of touchd; name another one or recalibrate" in daemon.lines


def test_sigusr1_calibrates_again(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        daemon.process.send_signal(signal.SIGUSR1)
        daemon.wait_for("recalibrating: SIGUSR1")
        daemon.wait_for("state: tracking", times=2)
        assert daemon.end(signal.SIGTERM) == 0


def test_a_second_daemon_on_the_same_state_folder_is_exit_code_75(config: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    with running(config, state) as first:
        first.wait_for("state:")
        with running(config, state) as second:
            assert second.process.wait(PATIENCE_S) == 75
            second.wait_for(f"touchd: {state}: another touchd uses this state folder")
        assert first.end(signal.SIGTERM) == 0


def test_a_source_that_is_not_built_yet_is_exit_code_69(tmp_path: Path) -> None:
    (tmp_path / "touchd.yaml").write_text("source: {kind: realsense}\n")
    with running(tmp_path / "touchd.yaml", tmp_path / "state") as daemon:
        assert daemon.process.wait(PATIENCE_S) == 69
        daemon.wait_for(
            "source.kind: this version of touchd cannot read from 'realsense', only from kinect, recording, synthetic"
        )


def test_killed_in_the_middle_of_a_touch_and_started_again_no_touch_is_stuck_or_doubled(
    config: Path, client: PythonTuio, tmp_path: Path
) -> None:
    with running(config, tmp_path / "state") as daemon:
        wait_until(lambda: bool(client.log.left_over()))
        daemon.process.kill()
        daemon.process.wait(PATIENCE_S)
    client.sync()
    stuck = client.log.left_over()
    with running(config, tmp_path / "state") as daemon:
        wait_until(lambda: not client.log.left_over() & stuck)
        seen = len(client.log.adds)
        wait_until(lambda: len(client.log.adds) >= seen + 3)
        assert daemon.end(signal.SIGTERM) == 0
    client.sync()
    assert client.log.left_over() == set()
    assert len(set(client.log.adds)) == len(client.log.adds)


def test_two_daemons_that_send_to_one_port_are_warned_of(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "one") as first:
        first.wait_for("state:")
        with running(config, tmp_path / "two") as second:
            second.wait_for("another touchd on this computer sends to 127.0.0.1:")
            assert second.end(signal.SIGTERM) == 0
        assert first.end(signal.SIGTERM) == 0
