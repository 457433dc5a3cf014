"""The control socket as a file: where it is, whose it is, and who may use it."""

import os
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from touchd.control.client import fetch_status
from touchd.control.errors import ControlError, NotRunning
from touchd.control.paths import check_private, control_socket_path, find_control_socket
from touchd.control.server import ControlServer
from touchd.errors import AlreadyRunning
from touchd.state import instance_of

from daemon.fake_daemon import STATUS, STRANGER, FakeControls, serving


def test_the_socket_of_a_dead_daemon_is_replaced(folder: Path, controls: FakeControls) -> None:
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(folder / "s"))
        dead.listen()
    with pytest.raises(NotRunning, match="nobody listens at"):
        fetch_status(folder / "s")
    with serving(folder / "s", controls) as server:
        assert fetch_status(server.path) == STATUS


def test_the_socket_of_a_living_daemon_is_left_to_it(path: Path) -> None:
    with pytest.raises(AlreadyRunning) as caught:
        ControlServer(path, FakeControls()).start()
    assert str(caught.value) == f"{path}: another touchd answers at this control socket; stop it first"
    assert fetch_status(path) == STATUS


def test_a_daemon_that_stops_leaves_the_socket_of_its_successor(folder: Path, controls: FakeControls) -> None:
    with serving(folder / "s", controls) as first:
        (folder / "s").unlink()
        with serving(folder / "s", controls) as second:
            first.stop()
            assert fetch_status(second.path) == STATUS


def test_what_is_no_socket_is_not_removed(folder: Path, controls: FakeControls) -> None:
    (folder / "s").write_text("mine")
    with pytest.raises(ControlError) as caught:
        ControlServer(folder / "s", controls).start()
    assert str(caught.value) == f"{folder / 's'}: is in the way of the control socket; remove it"
    assert (folder / "s").read_text() == "mine"


def test_a_path_too_long_for_a_socket_is_named(folder: Path, controls: FakeControls) -> None:
    path = folder / ("long" * 25) / "control.sock"
    with pytest.raises(ControlError, match=r"too long for a socket's path \(\d+ bytes, at most 107\); name a shorter"):
        ControlServer(path, controls).start()


def test_a_folder_that_cannot_be_made_is_named(folder: Path, controls: FakeControls) -> None:
    (folder / "file").touch()
    with pytest.raises(ControlError, match=r"the control socket's folder cannot be made: .*RUNTIME_DIRECTORY$"):
        ControlServer(folder / "file" / "run" / "s", controls).start()


def status_as(path: Path, *, group: int) -> str:
    """What a user who is nobody, but a member of ``group``, gets for the status."""
    script = (
        "import sys, os\n"
        "from pathlib import Path\n"
        "from touchd.control.client import request\n"
        "from touchd.errors import TouchdError\n"
        f"os.setgroups([{group}]); os.setgid({STRANGER}); os.setuid({STRANGER})\n"
        "try:\n"
        "    print(next(request(Path(sys.argv[1]), 'status'))['state'])\n"
        "except TouchdError as error:\n"
        "    print(int(error.exit_code), error)\n"
    )
    run = subprocess.run([sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE, text=True, check=True)
    return run.stdout.strip()


def test_the_socket_is_open_to_its_group_and_to_nobody_else(path: Path) -> None:
    members = 60_000
    assert stat.S_IMODE(path.stat().st_mode) == 0o660
    os.chown(path, -1, members)
    assert status_as(path, group=members) == "tracking"
    assert status_as(path, group=STRANGER) == (
        f"69 {path}: permission denied; it is open to user root and to group {members}: become a member of group "
        f"{members} and log in again, or use sudo"
    )


def test_a_socket_in_a_folder_of_one_user_alone_is_said_to_be_that(folder: Path, path: Path) -> None:
    folder.chmod(0o700)
    assert status_as(path, group=0) == f"69 {path}: permission denied; it is open to user root alone: use sudo"


def test_the_umask_does_not_open_or_close_the_socket(folder: Path, controls: FakeControls) -> None:
    for mask in (0, 0o777):
        before = os.umask(mask)
        try:
            server = ControlServer(folder / "s", controls)
            server.start()
        finally:
            os.umask(before)
        assert stat.S_IMODE(server.path.stat().st_mode) == 0o660
        server.stop()


def test_the_socket_is_in_systemd_s_runtime_folder_else_in_the_user_s_under_the_instance_s_name() -> None:
    state = {"STATE_DIRECTORY": "/var/lib/touchd"}
    name = f"control-{instance_of(Path('/var/lib/touchd'))}.sock"
    other = {"STATE_DIRECTORY": "/var/lib/other", "XDG_RUNTIME_DIR": "/run/user/7"}
    assert control_socket_path({"RUNTIME_DIRECTORY": "/run/touchd:/run/x", **state}) == Path("/run/touchd/control.sock")
    assert control_socket_path({"XDG_RUNTIME_DIR": "/run/user/7", **state}) == Path("/run/user/7/touchd") / name
    assert control_socket_path(state) == Path(f"/tmp/touchd-{os.getuid()}") / name
    assert control_socket_path(other).name != name


def test_a_command_talks_to_the_socket_given_else_to_the_user_s_own_else_to_the_system_s(folder: Path) -> None:
    env = {"XDG_RUNTIME_DIR": str(folder / "user"), "STATE_DIRECTORY": "/var/lib/touchd"}
    run, own = folder / "run", control_socket_path(env)
    with pytest.raises(NotRunning) as caught:
        find_control_socket(env, None, run)
    assert str(caught.value) == (
        f"no touchd is running here (no socket at {own} or {run}/touchd/control.sock); start it with touchd run"
    )
    for service in ("touchd", "touchd-left"):
        (run / service).mkdir(parents=True)
    (run / "touchd-left" / "control.sock").touch()
    assert find_control_socket(env, None, run) == run / "touchd-left" / "control.sock"
    (run / "touchd" / "control.sock").touch()
    with pytest.raises(ControlError) as several:
        find_control_socket(env, None, run)
    assert str(several.value) == (
        f"several touchd run here; choose one with --socket: {run}/touchd/control.sock, {run}/touchd-left/control.sock"
    )
    own.parent.mkdir(parents=True)
    own.touch()
    assert find_control_socket(env, None, run) == own
    assert find_control_socket(env, Path("/given"), run) == Path("/given")
    assert find_control_socket({"RUNTIME_DIRECTORY": "/nowhere"}, None, run) == Path("/nowhere/control.sock")


def test_a_folder_in_tmp_that_somebody_else_may_have_made_is_not_trusted(folder: Path) -> None:
    private = folder / "private"
    private.mkdir(mode=0o700)
    check_private(private)
    link = folder / "link"
    link.symlink_to(private)
    open_to_all = folder / "open"
    open_to_all.mkdir()
    foreign = folder / "foreign"
    foreign.mkdir(mode=0o700)
    os.chown(foreign, STRANGER, -1)
    for bad in (link, open_to_all, foreign):
        with pytest.raises(ControlError, match=rf"{bad}: not used for the control socket, .*or set XDG_RUNTIME_DIR"):
            check_private(bad)
