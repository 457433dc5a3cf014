"""The control socket, from both ends, with a daemon behind it that does as the test wants."""

import itertools
import json
import os
import socket
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import pytest
from touchd.align.hold import Phase
from touchd.align.session import AlignProgress
from touchd.control.client import fetch_status, request
from touchd.control.commands import Line, Terminal, align, align_lines, calibrate, check_daemon, status_page
from touchd.control.errors import ControlError, NotRunning, Refused
from touchd.control.paths import check_private, control_socket_path, find_control_socket
from touchd.control.protocol import Progress
from touchd.control.server import ControlServer, Limits
from touchd.errors import AlreadyRunning, ConfigError, ExitCode
from touchd.model import State
from touchd.state import instance_of
from touchd.status.data import ConfigFacts, SourceFacts, Status

from clients.harness import PATIENCE_S

T = TypeVar("T")
PATIENT = Limits(request_s=PATIENCE_S, reply_s=PATIENCE_S)
STRANGER = 65534
STATUS = Status(
    version="0.1.0",
    pid=1,
    time_s=1000.0,
    started_s=900.0,
    memory_bytes=80_000_000,
    state=State.TRACKING,
    state_since_s=910.0,
    why=None,
    cursors=0,
    touches=3,
    config=ConfigFacts(None),
    not_kept=None,
    source=SourceFacts("a test", "synthetic", None, 0, 2700, 30.0, 0, 0, 1.0, 2.0, 3.0),
    surface=None,
    area=None,
    outputs=(),
)
DONE = Progress(State.TRACKING, "flat to 1.0 mm", done=True, ok=True)
ALIGNED = AlignProgress(
    *(4, 4, "bottom-left corner", Phase.DONE),
    done=True,
    residual_mm=1.26,
    size_mm=(800.4, 600.2),
    kept_in="/var/lib/touchd/alignment.json",
)


@dataclass
class FakeControls:
    """A daemon that calibrates and aligns as it is told; without an end it goes on until it is closed."""

    calibration: list[Progress] = field(default_factory=list)
    alignment: list[AlignProgress] = field(default_factory=list)
    begun: threading.Event = field(default_factory=threading.Event)
    closed: threading.Event = field(default_factory=threading.Event)

    def status(self) -> Status:
        return STATUS

    def reload(self) -> str:
        raise ConfigError("touchd.yaml:1:1: tracking is wrong")

    def calibrate(self) -> Generator[Progress]:
        yield from self.calibration
        yield from self._for_ever(lambda: Progress(State.CALIBRATING, "x" * 1000))

    def align(self, points: int) -> Generator[AlignProgress]:
        yield from self.alignment
        yield from self._for_ever(lambda: AlignProgress(1, points, "top-left corner", Phase.TOUCH))

    def _for_ever(self, make: Callable[[], T]) -> Generator[T]:
        self.begun.set()
        try:
            while True:
                yield make()
        finally:
            self.closed.set()


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder that is open to everybody, unlike pytest's own."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@contextmanager
def serving(path: Path, controls: FakeControls, limits: Limits = PATIENT) -> Iterator[ControlServer]:
    server = ControlServer(path, controls, limits)
    server.start()
    try:
        yield server
    finally:
        server.stop()


@pytest.fixture
def controls() -> FakeControls:
    return FakeControls()


@pytest.fixture
def path(folder: Path, controls: FakeControls) -> Iterator[Path]:
    with serving(folder / "control.sock", controls) as server:
        yield server.path


def connected(path: Path) -> socket.socket:
    client = socket.socket(socket.AF_UNIX)
    client.settimeout(PATIENCE_S)
    client.connect(str(path))
    return client


def wait_until(happened: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < deadline_s, "it did not happen"
        time.sleep(0.005)


def _takes(client: socket.socket, more: bytes) -> bool:
    try:
        client.sendall(more)
    except (BrokenPipeError, ConnectionResetError):
        return False
    return True


def answers(path: Path) -> bool:
    try:
        return fetch_status(path) == STATUS
    except Refused:
        return False


def test_the_status_comes_through_the_socket_in_every_form(path: Path) -> None:
    assert fetch_status(path) == STATUS
    assert status_page(path, "people").startswith("state     tracking for 1 min 30 s\n")
    assert json.loads(status_page(path, "json")) == STATUS.as_json()
    assert "\ntouchd_frames_total 2700\n" in status_page(path, "prometheus")
    assert check_daemon(lambda: path) == (0, "ok: tracking at 30.0 frames/s, 0 touches")


def test_a_daemon_that_is_not_there_is_critical_and_exit_code_69(folder: Path) -> None:
    gone = folder / "control.sock"
    sentence = f"no touchd is running here (no socket at {gone}); start it with touchd run"
    with pytest.raises(NotRunning) as caught:
        fetch_status(gone)
    assert (str(caught.value), caught.value.exit_code) == (sentence, 69)
    assert check_daemon(lambda: gone) == (2, f"critical: {sentence}")


def test_calibrating_tells_how_far_it_is_and_ends_with_what_came_out(path: Path, controls: FakeControls) -> None:
    controls.calibration = [
        Progress(State.CALIBRATING, "frame 1 of 2"),
        Progress(State.CALIBRATING, "frame 2 of 2"),
        DONE,
    ]
    assert list(calibrate(path)) == [
        Line("calibrating: frame 1 of 2"),
        Line("calibrating: frame 2 of 2"),
        Line("calibrated: flat to 1.0 mm", lasting=True),
    ]


def test_a_calibration_that_gave_up_ends_with_the_daemon_s_reason_and_exit_code_75(
    path: Path, controls: FakeControls
) -> None:
    controls.calibration = [Progress(State.TRACKING, "something moved for 60 s", done=True, exit_code=75)]
    with pytest.raises(Refused) as caught:
        list(calibrate(path))
    assert (str(caught.value), caught.value.exit_code) == ("something moved for 60 s", ExitCode.TRY_AGAIN)


def test_a_reload_that_is_refused_comes_with_the_errors_and_exit_code_78(path: Path) -> None:
    with pytest.raises(Refused) as caught:
        list(request(path, "reload"))
    assert (str(caught.value), caught.value.exit_code) == ("touchd.yaml:1:1: tracking is wrong", 78)


def test_only_one_at_a_time_may_calibrate_or_align(path: Path, controls: FakeControls) -> None:
    first = request(path, "calibrate")
    next(first)
    for command in ("calibrate", "align"):
        with pytest.raises(Refused) as caught:
            list(request(path, command))
        assert caught.value.exit_code == 75
        assert str(caught.value).startswith("touchd is calibrating or being aligned for somebody else; try again")
    assert fetch_status(path) == STATUS
    first.close()
    assert controls.closed.wait(PATIENCE_S)


def test_the_user_is_led_from_point_to_point_and_hears_what_came_out(path: Path, controls: FakeControls) -> None:
    def at(point: int, phase: Phase, share: float = 0.0, why: str | None = None) -> AlignProgress:
        return AlignProgress(point, 4, "top-left corner" if point == 1 else "top-right corner", phase, share, why)

    controls.alignment = [
        at(1, Phase.TOUCH),
        at(1, Phase.TOUCH, why="2 touches are seen: use one finger"),
        at(1, Phase.HOLD, 0.5),
        at(1, Phase.LIFT, 1.0),
        at(1, Phase.LIFT, 1.0),
        at(2, Phase.LIFT, 1.0, why="that was the top-left corner again"),
        replace(ALIGNED, residual_mm=6.0),
    ]
    first, *lines = align_lines(path, 4)
    assert first.text.startswith("You will be asked to touch 4 points of the area")
    assert lines == [
        Line("[1/4] top-left corner: touch it and hold"),
        Line("[1/4] top-left corner: touch it and hold (2 touches are seen: use one finger)"),
        Line("[1/4] top-left corner: hold still, 50%"),
        Line("[1/4] top-left corner: got it, lift your finger", lasting=True),
        Line("[2/4] top-right corner: lift your finger (that was the top-left corner again)"),
        Line(
            "aligned and in force: 800 x 600 mm, residual 6.0 mm; kept in /var/lib/touchd/alignment.json", lasting=True
        ),
        Line(
            "A residual over 5 mm is much: were the points touched exactly, and is the area a rectangle? Run touchd "
            "align again to be sure.",
            lasting=True,
        ),
    ]


def test_ctrl_c_ends_an_alignment_at_both_ends(path: Path, controls: FakeControls) -> None:
    written: list[str] = []

    def write(text: str) -> None:
        written.append(text)
        if "touch it and hold" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        align(path, 9, Terminal(write, redraws=True, columns=80, now_s=lambda: 0.0))
    assert written[-1] == "alignment ended: the area stays as it was\n"
    assert controls.closed.wait(PATIENCE_S)
    wait_until(lambda: answers(path))


def test_a_terminal_redraws_one_line_and_leaves_what_lasts() -> None:
    written: list[str] = []
    Terminal(written.append, redraws=True, columns=10, now_s=lambda: 0.0).show(
        [Line("0123456789abc"), Line("0123456789abc", lasting=True)]
    )
    assert written == ["\r\x1b[K012345678", "\r\x1b[K0123456789abc\n", "\r\x1b[K"]


def test_without_a_terminal_progress_is_a_line_a_second() -> None:
    written: list[str] = []
    clock = itertools.count(0.0, 0.4)
    lines = [Line(f"frame {number}") for number in range(10)] + [Line("done", lasting=True), Line("done")]
    Terminal(written.append, redraws=False, columns=80, now_s=lambda: next(clock)).show(lines)
    assert written[-1] == "done\n"
    assert 2 <= len(written) <= 6
    assert written[0] == "frame 0\n"


def test_a_client_that_says_nothing_is_let_go(folder: Path, controls: FakeControls) -> None:
    with serving(folder / "s", controls, replace(PATIENT, request_s=0.05)) as server, connected(server.path) as client:
        assert client.recv(100) == b""


def test_a_client_that_says_it_bit_by_bit_is_let_go(folder: Path, controls: FakeControls) -> None:
    with serving(folder / "s", controls, replace(PATIENT, request_s=0.1)) as server, connected(server.path) as client:
        wait_until(lambda: not _takes(client, b" "))
        assert fetch_status(server.path) == STATUS


def test_silent_clients_are_bounded_in_number_and_the_next_one_is_told(folder: Path, controls: FakeControls) -> None:
    with serving(folder / "s", controls, replace(PATIENT, clients=2)) as server:
        silent = [connected(server.path) for _ in range(2)]
        with pytest.raises(Refused) as caught:
            fetch_status(server.path)
        assert (str(caught.value), caught.value.exit_code) == ("touchd has too many clients at once; try again", 75)
        for client in silent:
            client.close()
        wait_until(lambda: answers(server.path))


def test_a_client_that_does_not_listen_ends_its_own_command_alone(folder: Path, controls: FakeControls) -> None:
    with serving(folder / "s", controls, replace(PATIENT, reply_s=0.05)) as server, connected(server.path) as deaf:
        deaf.sendall(b'{"command": "calibrate"}\n')
        assert controls.begun.wait(PATIENCE_S)
        assert fetch_status(server.path) == STATUS
        assert controls.closed.wait(PATIENCE_S)


def test_a_client_that_vanishes_ends_its_alignment(path: Path, controls: FakeControls) -> None:
    with connected(path) as client:
        client.sendall(b'{"command": "align", "points": 9}\n')
        assert client.recv(1)
    assert controls.closed.wait(PATIENCE_S)
    wait_until(lambda: answers(path))


def test_a_request_without_end_is_refused(path: Path) -> None:
    with connected(path) as client:
        client.sendall(b" " * 5000)
        reply = json.loads(client.recv(1000))
    assert reply == {"error": "a request has at most 4096 bytes", "exit_code": 64, "done": True}


def test_a_daemon_that_stops_tells_those_who_wait_and_removes_its_socket(folder: Path, controls: FakeControls) -> None:
    server = ControlServer(folder / "s", controls, PATIENT)
    server.start()
    waiting = request(server.path, "align", {"points": 4})
    next(waiting)
    said: list[Refused] = []

    def listen() -> None:
        try:
            list(waiting)
        except Refused as error:
            said.append(error)

    listener = threading.Thread(target=listen)
    listener.start()
    server.stop()
    listener.join(PATIENCE_S)
    assert [(str(error), error.exit_code) for error in said] == [("touchd is stopping", 75)]
    assert controls.closed.is_set()
    assert list(folder.iterdir()) == []
    server.stop()


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
