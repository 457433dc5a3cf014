"""The clients in processes of their own start, tell what they see, and are gone at the end, whatever happens."""

import os
import shutil
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from touchd.model import Cursor, State, TouchFrame
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender

from clients.bundles import Mailbox
from clients.harness import Client, OscDump, PythonTuio, free_udp_port
from clients.process_client import FOLDER, KivyTuio, NodeTuio, ProcessClient, QtTouch, udp_sockets

IN_PROCESSES = [QtTouch, KivyTuio, NodeTuio]
HIGHEST_ID = 2**31 - 1
WRITES_NOTHING_AND_READS = "import sys; print('hello'); sys.stdin.read()"
MakeClient = Callable[[int | None], Client]


@pytest.fixture(params=IN_PROCESSES)
def client(request: pytest.FixtureRequest) -> Iterator[ProcessClient]:
    with request.param() as running:
        yield running


class Program(ProcessClient):
    """A child that is given as a Python program."""

    def __init__(self, program: str) -> None:
        super().__init__()
        self._program = program

    def command(self) -> list[str]:
        return [sys.executable, "-c", self._program]


def bundle(*cursors: tuple[int, float, float], fseq: int = 1000) -> bytes:
    encoder = TuioEncoder("a@b", 0, fseq)
    frame = encoder.next_frame([Cursor(i, x, y, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0) for i, x, y in cursors])
    (datagram,) = frame.split(4096)
    return datagram


def send(client: Client, *datagrams: bytes) -> None:
    host, _, port = client.destination.rpartition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for datagram in datagrams:
            sender.sendto(datagram, (host, int(port)))


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def test_each_tells_ids_and_positions_as_they_were_sent(client: ProcessClient) -> None:
    corners = [(1, 0.0, 0.0), (2**24, 1.0, 0.0), (2**24 + 1, 0.0, 1.0), (HIGHEST_ID, 1.0, 1.0)]
    send(client, bundle(*corners), bundle((1, 0.25, 0.125), *corners[1:], fseq=1001), bundle(fseq=1002))
    client.sync()
    assert sorted(client.log.adds) == sorted(client.log.removes) == [i for i, _, _ in corners]
    assert {i: path[0] for i, path in client.log.moves.items()} == {i: (x, y) for i, x, y in corners}
    assert client.log.moves[1] == [(0.0, 0.0), (0.25, 0.125)]
    assert client.log.faults == []


def test_a_complaint_of_the_client_is_a_fault(client: ProcessClient) -> None:
    of_doubles = bundle((1, 0.5, 0.5)).replace(b",sifffff", b",siddddd")
    send(client, of_doubles)
    client.sync()
    assert client.log.faults != []


def test_datagrams_that_overflow_its_buffer_are_counted(client: ProcessClient) -> None:
    assert client.dropped == 0
    os.kill(client.pid, signal.SIGSTOP)
    send(client, *[bundle((1, 0.5, 0.5))] * 5000)
    os.kill(client.pid, signal.SIGCONT)
    client.sync()
    assert 0 < client.dropped < 5000
    assert client.log.left_over() == {1}


def test_its_process_and_its_folder_are_gone_at_the_end(client: ProcessClient) -> None:
    folder = Path(client._folder.name)
    assert is_running(client.pid)
    assert folder.exists()
    client.__exit__(None, None, None)
    assert not is_running(client.pid)
    assert not folder.exists()


def test_it_ends_when_the_test_run_is_killed(client: ProcessClient) -> None:
    assert client._process.stdin is not None
    client._process.stdin.close()  # as the system does
    assert client._process.wait(30.0) == 0


def test_one_that_was_killed_is_told_of_in_place_of_a_wait(client: ProcessClient) -> None:
    os.kill(client.pid, signal.SIGKILL)
    client._process.wait(30.0)
    with pytest.raises(OSError, match=rf"{type(client).__name__} has closed its UDP port {client.port}"):
        client.sync()


@pytest.mark.parametrize("make_client", [PythonTuio, OscDump, *IN_PROCESSES])
def test_a_client_can_stop_and_come_back_on_its_port(make_client: MakeClient) -> None:
    port = free_udp_port()
    with UdpSender([f"127.0.0.1:{port}"]) as sender:
        output = TuioUdpOutput(TuioEncoder("a@b", 0, 1000), sender)
        for turn in range(2):
            touch = Cursor(1, 0.5, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0)
            with make_client(port) as client:
                assert client.destination == f"127.0.0.1:{port}"
                output.publish(TouchFrame(turn, turn, State.TRACKING, (touch,)), turn)
                client.sync()
                assert client.log.left_over() == {1}


def test_a_free_port_is_given_once_and_is_none_that_the_kernel_gives_away_or_that_is_taken() -> None:
    lowest = int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    following = free_udp_port() + workers
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", following))
        given = [free_udp_port() for _ in range(100)]
    assert following not in given
    assert len(set(given)) == 100
    assert max(given) < lowest


@pytest.mark.parametrize("make_client", IN_PROCESSES)
def test_a_port_that_is_taken_fails_the_start_and_leaves_nothing_behind(make_client: MakeClient) -> None:
    with Mailbox() as box:
        client = make_client(box.port)
        with pytest.raises(OSError, match=r"(ended with code|does not listen on UDP port)(.|\n)*(in use|EADDRINUSE)"):
            client.__enter__()
        assert isinstance(client, ProcessClient)
        assert not is_running(client.pid)


def test_one_that_ends_before_it_is_ready_fails_the_start_with_what_it_said() -> None:
    with pytest.raises(OSError, match=r"The client Program ended with code 3; it said: \['no screen'\]\."):
        Program("import sys; print('no screen'); sys.exit(3)").__enter__()


def test_one_that_says_that_it_listens_but_does_not_fails_the_start() -> None:
    client = Program("""import sys; print('["ready"]', flush=True); sys.stdin.read()""")
    with pytest.raises(OSError, match=rf"The client Program does not listen on UDP port {client.port}"):
        client.__enter__()
    assert not is_running(client.pid)


def test_one_that_never_becomes_ready_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.process_client.PATIENCE_S", 0.5)
    client = Program(WRITES_NOTHING_AND_READS)
    with pytest.raises(TimeoutError, match=r"The client Program did not become ready within 0\.5 s"):
        client.__enter__()
    assert not is_running(client.pid)


class WithoutPackages(ProcessClient):
    """A Python client whose interpreter finds the standard library alone."""

    def __init__(self, program: str) -> None:
        super().__init__()
        self._program = program

    def command(self) -> list[str]:
        return [sys.executable, "-I", "-S", str(FOLDER / self._program)]


class NodeWithoutPackages(NodeTuio):
    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._program = shutil.copy(FOLDER / "node" / "client.mjs", folder)

    def command(self) -> list[str]:
        return [super().command()[0], str(self._program)]


@pytest.mark.parametrize(
    ("program", "remedy"),
    [
        ("qt_client.py", r"Qt is not installed .*: pip install 'touchd\[test\]'; apt-get install libegl1 "),
        ("kivy_client.py", r"Kivy is not installed .*: pip install 'touchd\[test\]'$"),
    ],
)
def test_without_its_package_a_client_fails_in_ci_with_the_remedy_and_is_skipped_elsewhere(
    program: str, remedy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match=remedy):
        WithoutPackages(program).__enter__()
    monkeypatch.delenv("CI")
    with pytest.raises(pytest.skip.Exception, match=remedy):
        WithoutPackages(program).__enter__()


def test_without_its_packages_the_node_client_names_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match=r"tuio-client is not installed .*: npm ci in tests/clients/node"):
        NodeWithoutPackages(tmp_path).__enter__()


def test_without_node_its_client_names_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(pytest.fail.Exception, match="apt-get install nodejs npm"):
        NodeTuio().__enter__()


def test_the_kernels_table_tells_what_waits_at_a_port() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as inbox:
        inbox.bind(("127.0.0.1", 0))
        address = inbox.getsockname()

        def waiting_bytes() -> int:
            (one,) = (one for one in udp_sockets() if one.port == address[1])
            return one.waiting_bytes

        assert waiting_bytes() == 0
        inbox.sendto(b"hello", address)
        assert waiting_bytes() > 0
        inbox.recv(16)
        assert waiting_bytes() == 0
