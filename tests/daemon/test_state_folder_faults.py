"""State folders and event files that cannot be written to: said in one sentence, and touch goes on."""

import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from clients.harness import PythonTuio
from daemon.running import AS_NOBODY, running, wait_until


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder on a disk of 16 kB that is full."""
    folder = tmp_path / "disk"
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", folder], check=True)
    try:
        subprocess.run(["dd", "if=/dev/zero", f"of={folder}/filler"], check=False, stderr=subprocess.DEVNULL)
        assert os.statvfs(folder).f_bavail == 0
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


def test_on_a_full_disk_nothing_is_kept_and_touch_goes_on(config: Path, client: PythonTuio, full_disk: Path) -> None:
    with running(config, full_disk / "state") as daemon:
        daemon.wait_for("No space left on device; check the folder's owner and free space")
        wait_until(lambda: bool(client.log.adds))
        assert daemon.end(signal.SIGTERM) == 0
    assert not list(full_disk.glob("state/.surface*"))


def test_a_state_folder_of_somebody_else_is_named_and_touch_goes_on(
    config: Path, client: PythonTuio, tmp_path: Path
) -> None:
    state = tmp_path / "state"
    state.mkdir(mode=0o755)
    with running(config, state, AS_NOBODY) as daemon:
        daemon.wait_for(
            "running without a state folder, so the surface is learned at each start: "
            f"{state}/lock: cannot be written: Permission denied; check the folder's owner and free space"
        )
        daemon.wait_for(f"the surface is not kept: {state}/surface.touchd: cannot be written: Permission denied")
        wait_until(lambda: bool(client.log.adds))
        assert daemon.end(signal.SIGTERM) == 0
    assert list(state.iterdir()) == []


def test_a_surface_in_a_read_only_state_folder_is_still_used(config: Path, client: PythonTuio, tmp_path: Path) -> None:
    state = tmp_path / "state"
    with running(config, state) as daemon:
        daemon.wait_for("surface: ")
        assert daemon.end(signal.SIGTERM) == 0
    state.chmod(0o555)
    (state / "surface.touchd").chmod(0o444)
    with running(config, state, AS_NOBODY) as daemon:
        daemon.wait_for("running without a state folder")
        daemon.wait_for(f"using the surface in {state}/surface.touchd")
        wait_until(lambda: bool(client.log.adds))
        assert daemon.end(signal.SIGTERM) == 0


def test_an_events_file_on_a_full_disk_is_counted_and_said_once_and_touch_goes_on(
    config: Path, client: PythonTuio, full_disk: Path, tmp_path: Path
) -> None:
    config.write_text(config.read_text() + f"  - events: {{path: {full_disk}/events.jsonl}}\n")
    with running(config, tmp_path / "state") as daemon:
        daemon.wait_for(f"events to {full_disk}/events.jsonl: ")
        wait_until(lambda: len(client.log.adds) >= 3)
        assert daemon.end(signal.SIGTERM) == 0
    assert sum("No space left on device" in line for line in daemon.lines) == 1


def test_the_tests_that_need_root_run_as_root() -> None:
    assert os.getuid() == 0, "run these tests as root: they mount a small disk and become another user"
