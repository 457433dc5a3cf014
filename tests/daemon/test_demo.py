import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

import pytest
from touchd.demo.run import DemoOptions, demo
from touchd.errors import UsageError

from clients.harness import PATIENCE_S, PythonTuio

TAKEN, GIVEN_BACK = b"\x1b[?1049h\x1b[?25l", b"\x1b[?25h\x1b[?1049l"


def command(client: PythonTuio, scenario: str = "pinch") -> list[str]:
    options = ["--to", client.destination, "--scenario", scenario, "--seed", "3"]
    return [sys.executable, "-m", "touchd", "demo", *options]


def wait_until(happened: Callable[[], bool]) -> None:
    for _ in range(round(PATIENCE_S / 0.01)):
        if happened():
            return
        time.sleep(0.01)
    pytest.fail("it did not happen")


def children_of(process: int) -> list[int]:
    return [
        int(path.parent.name)
        for path in Path("/proc").glob("[0-9]*/status")
        if f"\nPPid:\t{process}\n" in (path.read_text() if path.exists() else "")
    ]


def running(process: int) -> bool:
    try:
        return "State:\tZ" not in Path(f"/proc/{process}/status").read_text()
    except OSError:
        return False


@contextmanager
def plain_demo(client: PythonTuio) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(command(client), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


class ScreenDemo:
    """The demo on a terminal of its own."""

    def __init__(self, client: PythonTuio, size: tuple[int, int], scenario: str = "pinch") -> None:
        self.seen = b""
        self._terminal, theirs = pty.openpty()
        self.resize(size)
        environment = {**os.environ, "TERM": "xterm", "PYTHONIOENCODING": "utf-8"}
        self.process = subprocess.Popen(
            command(client, scenario), stdin=theirs, stdout=theirs, stderr=theirs, env=environment
        )
        os.close(theirs)

    def resize(self, size: tuple[int, int]) -> None:
        fcntl.ioctl(self._terminal, termios.TIOCSWINSZ, struct.pack("HHHH", size[1], size[0], 0, 0))

    def wait_for(self, text: str) -> None:
        begin, until_s = len(self.seen), time.monotonic() + PATIENCE_S
        while text.encode() not in self.seen[begin:]:
            assert self._read(), f"{text!r} did not appear: {self.seen[begin:][-2000:]!r}"
            assert time.monotonic() < until_s, f"{text!r} did not appear: {self.seen[begin:][-2000:]!r}"

    def end(self, number: signal.Signals) -> int:
        self.process.send_signal(number)
        until_s = time.monotonic() + PATIENCE_S
        while self._read():
            assert time.monotonic() < until_s, "it did not end"
        return self.process.wait(PATIENCE_S)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self._terminal)

    def _read(self) -> bool:
        assert select.select([self._terminal], [], [], PATIENCE_S)[0]
        try:
            data = os.read(self._terminal, 65536)
        except OSError:  # nobody has the terminal open any more
            return False
        self.seen += data
        return bool(data)


@contextmanager
def screen_demo(client: PythonTuio, size: tuple[int, int] = (80, 24), scenario: str = "pinch") -> Iterator[ScreenDemo]:
    demo = ScreenDemo(client, size, scenario)
    try:
        yield demo
    finally:
        demo.close()


@pytest.fixture
def client() -> Iterator[PythonTuio]:
    with PythonTuio() as client:
        yield client


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_stopped_in_the_middle_of_a_touch_it_ends_every_touch_keeps_no_state_and_exits_with_0(
    number: signal.Signals, client: PythonTuio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("HOME", "XDG_STATE_HOME", "STATE_DIRECTORY", "RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path))
    with plain_demo(client) as process:
        wait_until(lambda: len(client.log.adds) >= 2)
        process.send_signal(number)
        said, complained = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, complained) == (0, "")
    assert list(tmp_path.iterdir()) == []
    client.sync()
    assert client.log.left_over() == set()
    assert client.log.removes
    assert said.splitlines()[-1].startswith("touchd demo: ")
    assert f" touches sent to {client.destination}, " in said.splitlines()[-1]


def test_without_a_terminal_it_says_a_plain_line_a_second(client: PythonTuio) -> None:
    with plain_demo(client) as process:
        assert process.stdout is not None
        begun_s = time.monotonic()
        lines = [process.stdout.readline() for _ in range(4)]
        took_s = time.monotonic() - begun_s
    assert any(line.startswith("calibrating (frame ") for line in lines)
    assert all(" frames/s   latency " in line and line.isascii() and "\x1b" not in line for line in lines)
    assert took_s >= 3.0


def test_a_reader_that_goes_away_ends_it_and_all_touches(client: PythonTuio) -> None:
    with plain_demo(client) as process:
        assert process.stdout is not None
        wait_until(lambda: bool(client.log.adds))
        process.stdout.close()
        assert process.wait(PATIENCE_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""
    client.sync()
    assert client.log.left_over() == set()


def test_on_a_terminal_the_picture_appears_and_ctrl_c_gives_the_screen_back(client: PythonTuio) -> None:
    with screen_demo(client) as screen:
        screen.wait_for("touchd demo")
        screen.wait_for("calibrating")
        screen.wait_for("tracking")
        screen.wait_for("●1")
        assert screen.end(signal.SIGINT) == 0
    assert screen.seen.startswith(TAKEN)
    assert screen.seen.count(TAKEN) == screen.seen.count(GIVEN_BACK) == 1
    after = screen.seen.split(GIVEN_BACK)[1].decode()
    assert after.startswith("touchd demo: ")
    assert after.count("\n") == 1
    client.sync()
    assert client.log.left_over() == set()


def test_it_follows_the_terminals_size(client: PythonTuio) -> None:
    with screen_demo(client, (80, 24)) as screen:
        screen.wait_for("\x1b[20;1H")
        screen.resize((30, 4))
        for _ in range(2):
            screen.wait_for("   scenario pinch, \x1b[K")  # the title cut to 30 columns
            begin = screen.seen.rindex(b"\x1b[1;1H")
        assert screen.end(signal.SIGINT) == 0
    pictures = screen.seen[begin:].split(b"\x1b[1;1H")[1:]
    assert all(b"\x1b[5;1H" not in picture for picture in pictures)


def test_a_failing_renderer_gives_the_screen_back_and_ends_with_the_error(client: PythonTuio) -> None:
    with screen_demo(client) as screen:
        screen.wait_for("tracking")
        (renderer,) = children_of(screen.process.pid)
        os.kill(renderer, signal.SIGKILL)
        screen.wait_for("touchd: synthetic table 3: its renderer was killed by SIGKILL; start touchd again")
        assert screen.process.wait(PATIENCE_S) == 69
    assert GIVEN_BACK in screen.seen


def test_a_terminal_that_takes_no_text_does_not_keep_it_from_stopping(client: PythonTuio) -> None:
    with screen_demo(client, (200, 60), "ten") as screen:
        # Nobody reads the terminal from here on, so that its buffer fills up.
        wait_until(lambda: len(client.log.adds) >= 10)
        screen.process.send_signal(signal.SIGTERM)
        assert screen.process.wait(PATIENCE_S) == 0
    client.sync()
    assert client.log.left_over() == set()


def test_killed_it_leaves_no_renderer_behind(client: PythonTuio) -> None:
    with plain_demo(client) as process:
        wait_until(lambda: bool(children_of(process.pid)))
        (renderer,) = children_of(process.pid)
        process.kill()
        process.wait(PATIENCE_S)
        wait_until(lambda: not running(renderer))


def test_a_destination_without_a_port_is_one_sentence() -> None:
    with pytest.raises(UsageError) as caught:
        demo(DemoOptions(to="tablet"), StringIO(), {})
    assert str(caught.value) == ('--to: "tablet" has no port; write it as host:port, for example "127.0.0.1:3333".')
