"""Every signal at every moment of start, calibration, run and stop."""

import signal
from pathlib import Path

import pytest

from clients.harness import PATIENCE_S
from daemon.running import running

# Lines of the log that tell where the daemon is, in their order.
MOMENTS = ("touchd 0.", "source: ", "state: calibrating", "state: tracking")


@pytest.fixture
def config(short_recording: Path, tmp_path: Path) -> Path:
    path = tmp_path / "touchd.yaml"
    path.write_text((short_recording.parent / "touchd.yaml").read_text() + "\noutputs: []\n")
    return path


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_signal_to_stop_stops_it_at_any_moment_with_exit_code_0(
    moment: str, number: signal.Signals, config: Path, tmp_path: Path
) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for(moment)
        assert daemon.end(number) == 0
    assert f"stopping: {number.name}" in daemon.lines


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGUSR1])
def test_reloading_and_recalibrating_at_any_moment_leaves_it_tracking(
    number: signal.Signals, config: Path, tmp_path: Path
) -> None:
    with running(config, tmp_path / "state") as daemon:
        for moment in MOMENTS:
            daemon.wait_for(moment)
            daemon.process.send_signal(number)
        before = sum("state: tracking" in line for line in daemon.lines)
        if number == signal.SIGUSR1:
            daemon.wait_for("state: tracking", times=before + 1)
        else:
            daemon.wait_for("config: nothing changed")
        assert daemon.end(signal.SIGTERM) == 0


def test_signals_while_it_stops_change_nothing(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
            daemon.process.send_signal(number)
        assert daemon.process.wait(PATIENCE_S) == 0
    assert sum(line.startswith("stopping: ") for line in daemon.lines) == 1


def test_killed_it_leaves_a_state_that_the_next_start_can_use(config: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    with running(config, state) as daemon:
        daemon.wait_for("surface: ")
        daemon.process.kill()
        assert daemon.process.wait(PATIENCE_S) == -signal.SIGKILL
    with running(config, state) as daemon:
        daemon.wait_for("state: tracking")
        assert daemon.end(signal.SIGTERM) == 0
    assert not any("cannot" in line or "damaged" in line for line in daemon.lines)
