"""Edits of the config file while the daemon runs."""

import math
import signal
from pathlib import Path

from clients.harness import PythonTuio
from daemon.running import running, wait_until


def test_a_saved_edit_is_in_force_without_a_signal_and_says_what_it_changed(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state:")
        config.write_text(config.read_text() + "tracking: {min_cutoff_hz: 3}\n")
        daemon.wait_for("config: in force now: tracking.min_cutoff_hz")
        assert daemon.end(signal.SIGTERM) == 0


def test_sighup_reloads_at_once(config: Path, tmp_path: Path) -> None:
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state:")
        daemon.process.send_signal(signal.SIGHUP)
        daemon.wait_for("config: nothing changed")
        assert daemon.end(signal.SIGTERM) == 0


def test_a_bad_edit_keeps_the_running_config_and_says_why(config: Path, tmp_path: Path) -> None:
    good = config.read_text()
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state:")
        config.write_text(good + "tracking: {stall_ms: soon}\n")
        daemon.wait_for("config: not used, the one from before is in force: ")
        daemon.wait_for('tracking.stall_ms: expected milliseconds from 34 to 5000, found "soon"')
        daemon.wait_for("state: tracking")
        config.write_text(good)
        daemon.wait_for("config: nothing changed")
        assert daemon.end(signal.SIGTERM) == 0


def test_changing_smoothing_and_outputs_in_mid_touch_loses_no_touch(
    config: Path, client: PythonTuio, tmp_path: Path
) -> None:
    with PythonTuio() as other, running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state: tracking")
        wait_until(lambda: bool(client.log.adds))
        text = config.read_text().replace(client.destination, f'{client.destination}", "{other.destination}')
        config.write_text(text + "tracking: {min_cutoff_hz: 3}\n")
        daemon.wait_for("config: in force now: tracking.min_cutoff_hz, outputs")
        wait_until(lambda: len(other.log.adds) >= 3 and not other.log.left_over())
        assert daemon.end(signal.SIGTERM) == 0
        client.sync()
    # Three touches a lap, each one added and removed once: none was broken in two.
    assert len(set(client.log.adds)) == len(client.log.adds)
    assert sorted(client.log.adds) == sorted(client.log.removes)
    assert set(other.log.adds) <= set(client.log.adds)


def test_turning_the_screen_in_mid_touch_ends_the_touch_and_begins_it_anew_in_the_new_place(
    config: Path, client: PythonTuio, tmp_path: Path
) -> None:
    with running(config, tmp_path / "state") as daemon:
        wait_until(lambda: len(client.log.adds) > 3 and bool(client.log.left_over()))
        config.write_text(config.read_text().replace("tuio: {", "tuio: {flip_x: true, flip_y: true, "))
        daemon.wait_for("config: in force now: outputs")
        before = len(client.log.adds)
        wait_until(lambda: len(client.log.adds) >= before + 3 and not client.log.left_over())
        assert daemon.end(signal.SIGTERM) == 0
        client.sync()
    assert len(set(client.log.adds)) == len(client.log.adds)
    assert sorted(client.log.adds) == sorted(client.log.removes)
    begun = [client.log.moves[session_id][0] for session_id in client.log.adds]
    for x, y in begun[-3:]:
        assert min(math.dist((1.0 - x, 1.0 - y), other) for other in begun[:3]) < 0.01


def test_a_new_source_is_opened_and_a_missing_one_is_not_used(
    config: Path, client: PythonTuio, short_recording: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "copy"
    copy.symlink_to(short_recording)
    good = config.read_text()
    with running(config, tmp_path / "state") as daemon:
        wait_until(lambda: bool(client.log.adds))
        config.write_text(good.replace(str(short_recording), str(tmp_path / "absent")))
        daemon.wait_for("absent does not exist: check the path of the recording")
        config.write_text(good.replace(str(short_recording), str(copy)))
        daemon.wait_for("config: in force now: source.path")
        daemon.wait_for("state: tracking", times=2)
        seen = len(client.log.adds)
        wait_until(lambda: len(client.log.adds) > seen)
        assert daemon.end(signal.SIGTERM) == 0
        client.sync()
    assert client.log.left_over() == set()
    assert len(set(client.log.adds)) == len(client.log.adds)


def test_a_config_that_names_a_destination_twice_is_not_used(config: Path, client: PythonTuio, tmp_path: Path) -> None:
    good = config.read_text()
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for("state:")
        config.write_text(good.replace(f'"{client.destination}"', f'"{client.destination}", "{client.destination}"'))
        daemon.wait_for(f"outputs: {client.destination} is named twice; name each destination once")
        assert daemon.end(signal.SIGTERM) == 0
