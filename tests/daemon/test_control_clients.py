"""Clients of the control socket that do not behave."""

import json
import socket
import threading
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.control.client import fetch_status, request
from touchd.control.errors import Refused
from touchd.control.server import ControlServer

from clients.harness import PATIENCE_S
from daemon.fake_daemon import PATIENT, STATUS, FakeControls, answers, connected, serving, wait_until


def _takes(client: socket.socket, more: bytes) -> bool:
    try:
        client.sendall(more)
    except (BrokenPipeError, ConnectionResetError):
        return False
    return True


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


class _HeldBack(Mapping[str, object]):
    """Arguments that a client, once connected, cannot send before it has an answer to read."""

    def __init__(self, turned_away: threading.Event) -> None:
        self._turned_away = turned_away

    def __getitem__(self, key: str) -> object:
        return {"points": 4}[key]

    def __iter__(self) -> Iterator[str]:
        assert self._turned_away.wait(PATIENCE_S)
        return iter(["points"])

    def __len__(self) -> int:
        return 1


def test_a_client_that_is_turned_away_before_it_asks_is_told_why(folder: Path) -> None:
    turned_away = threading.Event()

    def turn_away(listener: socket.socket) -> None:
        with listener.accept()[0] as client:
            client.sendall(b'{"error": "too many", "exit_code": 75, "done": true}\n')
        turned_away.set()

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(folder / "s"))
        listener.listen()
        server = threading.Thread(target=turn_away, args=(listener,))
        server.start()
        with pytest.raises(Refused) as caught:
            next(request(folder / "s", "align", _HeldBack(turned_away)))
        server.join()
    assert (str(caught.value), caught.value.exit_code) == ("too many", 75)


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
