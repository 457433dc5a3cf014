import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest
from touchd.notify import Notifier


class Manager:
    """The service manager's end: a datagram socket that keeps what it is told."""

    def __init__(self, address: str) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(address)
        self._socket.setblocking(False)

    def told(self) -> list[str]:
        """Return what came since the last time; a datagram on this host has come when its send returns."""
        told = []
        while True:
            try:
                told.append(self._socket.recv(65536).decode())
            except BlockingIOError:
                return told

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    with Manager(str(tmp_path / "notify")) as manager:
        yield manager


@pytest.fixture
def env(tmp_path: Path) -> dict[str, str]:
    return {"NOTIFY_SOCKET": str(tmp_path / "notify")}


def test_ready_stopping_and_watchdog_are_one_message_each(manager: Manager, env: dict[str, str]) -> None:
    notifier = Notifier(env)
    notifier.ready()
    notifier.watchdog()
    notifier.stopping()
    assert manager.told() == ["READY=1", "WATCHDOG=1", "STOPPING=1"]


def test_a_reload_carries_the_monotonic_time_at_which_it_began(manager: Manager, env: dict[str, str]) -> None:
    before_us = time.monotonic_ns() // 1000
    Notifier(env).reloading()
    (message,) = manager.told()
    word, _, stamp = message.partition("\nMONOTONIC_USEC=")
    assert word == "RELOADING=1"
    assert before_us <= int(stamp) <= time.monotonic_ns() // 1000


def test_a_status_is_told_when_it_changed_and_not_again(manager: Manager, env: dict[str, str]) -> None:
    notifier = Notifier(env)
    for text in ("tracking", "tracking", "no frames", "tracking"):
        notifier.status(text)
    assert manager.told() == ["STATUS=tracking", "STATUS=no frames", "STATUS=tracking"]


def test_a_status_is_one_line_that_can_smuggle_nothing_in(manager: Manager, env: dict[str, str]) -> None:
    Notifier(env).status("line one\nREADY=1\r\n  line\0three\n")
    assert manager.told() == ["STATUS=line one READY=1 line three"]


def test_an_odd_or_endless_status_is_told_as_far_as_the_protocol_allows(manager: Manager, env: dict[str, str]) -> None:
    notifier = Notifier(env)
    notifier.status("cannot read /srv/\udcff")
    notifier.status("\udcff°" * 10_000)
    odd, long = manager.told()
    assert odd == "STATUS=cannot read /srv/\\udcff"
    assert 1000 < len(long.encode()) < 4096


def test_a_socket_in_the_abstract_namespace_is_reached_by_its_at_sign() -> None:
    name = f"touchd-test-{os.getpid()}"
    with Manager(f"\0{name}") as manager:
        Notifier({"NOTIFY_SOCKET": f"@{name}"}).ready()
        assert manager.told() == ["READY=1"]


@pytest.mark.parametrize("env", [{}, {"NOTIFY_SOCKET": ""}, {"NOTIFY_SOCKET": "vsock:2:1234"}])
def test_without_a_manager_everything_is_a_quiet_nothing(env: dict[str, str]) -> None:
    notifier = Notifier({**env, "WATCHDOG_USEC": "3000000"})
    for say in (notifier.ready, notifier.reloading, notifier.stopping, notifier.watchdog):
        say()
    notifier.status("tracking")
    assert notifier.watchdog_interval_s is None


def test_a_manager_that_went_away_raises_nothing_and_hears_the_status_when_it_is_back(
    manager: Manager, env: dict[str, str]
) -> None:
    notifier = Notifier(env)
    manager.close()
    Path(env["NOTIFY_SOCKET"]).unlink()
    notifier.ready()
    notifier.status("tracking")
    with Manager(env["NOTIFY_SOCKET"]) as back:
        notifier.status("tracking")
        assert back.told() == ["STATUS=tracking"]


def test_a_manager_that_does_not_read_is_not_waited_for(manager: Manager, env: dict[str, str]) -> None:
    notifier = Notifier(env)
    for _ in range(10_000):  # more than any queue of datagrams holds: a blocking socket would stand still here
        notifier.watchdog()
    assert 0 < len(manager.told()) < 10_000


def test_the_watchdog_is_fed_twice_in_the_time_that_it_waits(env: dict[str, str]) -> None:
    fed = Notifier({**env, "WATCHDOG_USEC": "3000000", "WATCHDOG_PID": str(os.getpid())})
    assert fed.watchdog_interval_s == 1.5


@pytest.mark.parametrize("microseconds", ["", "0", "soon", "-5", "٣"])
def test_a_watchdog_time_that_is_none_is_no_watchdog(microseconds: str, env: dict[str, str]) -> None:
    assert Notifier({**env, "WATCHDOG_USEC": microseconds}).watchdog_interval_s is None


def test_a_child_that_inherited_the_environment_keeps_silent(manager: Manager, env: dict[str, str]) -> None:
    say_ready = "import os; from touchd.notify import Notifier; Notifier(os.environ).ready()"
    for_us = {**os.environ, **env, "WATCHDOG_USEC": "3000000", "WATCHDOG_PID": str(os.getpid())}
    subprocess.run([sys.executable, "-c", say_ready], env=for_us, check=True, timeout=60)
    assert manager.told() == []
    Notifier(for_us).ready()
    assert manager.told() == ["READY=1"]


def test_the_environment_is_left_as_it_is(env: dict[str, str]) -> None:
    before = dict(env)
    Notifier(env).ready()
    assert env == before
