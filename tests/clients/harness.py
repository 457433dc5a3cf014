"""Real TUIO clients that keep a log of what they saw."""

import os
import shlex
import shutil
import socket
import subprocess
import threading
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn, Protocol, Self

import pytest
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from pythonosc.osc_server import BlockingOSCUDPServer
from pythontuio import TuioClient, TuioListener

from clients.comparison import ClientLog, Point

PATIENCE_S = 30.0
RESEND_S = 0.1
REDUNDANT = -1
MOST_LATE = 100  # bundles
LOWEST_PORT = 20_000


class Client(Protocol):
    """What every client under test offers, as a context: where to send to, and what it saw."""

    log: ClientLog
    destination: str

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def sync(self) -> None:
        """Wait until all that was sent before has reached the log."""


class Handshake:
    """Sends numbered marks to a client until it reacts to one; datagrams on loopback keep their order."""

    def __init__(self) -> None:
        self._seen = 0
        self._wanted = 0
        self._changed = threading.Condition()

    def seen(self, mark: int) -> None:
        """Take note, on the client's thread, that it reacted to ``mark``."""
        with self._changed:
            self._seen = max(self._seen, mark)
            self._changed.notify_all()

    def run(self, address: tuple[str, int], mark: Mapping[str, Sequence[str]]) -> None:
        """Send the messages of ``mark`` (words by address, with the number added to the first) until seen."""
        self._wanted += 1
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender, self._changed:
            for _ in range(round(PATIENCE_S / RESEND_S)):
                sender.sendto(_mark_bundle(mark, self._wanted), address)
                if self._changed.wait_for(lambda: self._seen >= self._wanted, RESEND_S):
                    return
        raise TimeoutError(f"The client at {address} did not react within {PATIENCE_S} s.")


def _mark_bundle(mark: Mapping[str, Sequence[str]], number: int) -> bytes:
    builder = OscBundleBuilder(IMMEDIATELY)
    for address, words in mark.items():
        for word in words:
            message = OscMessageBuilder(address)
            message.add_arg(word, "s")
            message.add_arg(number, "i")
            builder.add_content(message.build())
    dgram: bytes = builder.build().dgram
    return dgram


class PythonTuio:
    """python-tuio's TuioClient. Marks are objects (2Dobj), which leave its cursors alone."""

    def __init__(self, port: int | None = None) -> None:
        self.log = ClientLog()
        self._handshake = Handshake()
        self._client = TuioClient(("127.0.0.1", 0))
        self._client.add_listener(_Listener(self.log, self._handshake))
        self._client.handle_error = self._note_error
        # TuioClient.start() does this and serves for ever; apart, the port is known before the thread runs.
        BlockingOSCUDPServer.__init__(self._client, ("127.0.0.1", port or 0), self._client)
        self._port = self._client.socket.getsockname()[1]
        self.destination = f"127.0.0.1:{self._port}"
        self._thread = threading.Thread(target=self._client.serve_forever, args=(0.01,), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self.sync()  # shutdown() waits for ever for a server that does not serve yet
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.shutdown()
        self._thread.join(PATIENCE_S)
        self._client.server_close()

    def sync(self) -> None:
        self._handshake.run(("127.0.0.1", self._port), {"/tuio/2Dobj": ("alive", "fseq")})

    def _note_error(self, request: object, sender: object) -> None:
        self.log.faults.append(f"python-tuio could not take {request!r} from {sender!r}.")


class _Listener(TuioListener):  # type: ignore[misc]  # python-tuio has no types
    def __init__(self, log: ClientLog, handshake: Handshake) -> None:
        self._log = log
        self._handshake = handshake

    def add_tuio_cursor(self, cur: Any) -> None:
        self._log.add(cur.session_id, tuple(cur.position))

    def update_tuio_cursor(self, cur: Any) -> None:
        self._log.move(cur.session_id, tuple(cur.position))

    def remove_tuio_cursor(self, cur: Any) -> None:
        self._log.remove(cur.session_id)

    def add_tuio_object(self, obj: Any) -> None:
        self._handshake.seen(obj.session_id)


class OscDump:
    """liblo's ``oscdump -L`` in a process of its own, and a textbook TUIO client that reads its lines."""

    def __init__(self, port: int | None = None) -> None:
        self.log = ClientLog()
        self.lines: list[str] = []  # address, type tags and arguments of each message, as printed
        self._handshake = Handshake()
        self._alive: list[int] = []
        self._sets: dict[int, Point] = {}
        self._live: set[int] = set()
        self._fseq = 0
        self._port = free_udp_port() if port is None else port
        self.destination = f"127.0.0.1:{self._port}"

    def __enter__(self) -> Self:
        self._process = subprocess.Popen([oscdump_path(), "-L", str(self._port)], stdout=subprocess.PIPE, text=True)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        try:
            self.sync()
        except TimeoutError:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait(PATIENCE_S)
        self._thread.join(PATIENCE_S)
        assert self._process.stdout is not None
        self._process.stdout.close()

    def sync(self) -> None:
        self._handshake.run(("127.0.0.1", self._port), {"/mark": ("number",)})

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            _, address, tags, *arguments = shlex.split(line)
            if address == "/mark":
                self._handshake.seen(int(arguments[1]))
            else:
                self.lines.append(line.split(maxsplit=1)[1].strip())
                self._take(tags, arguments)

    def _take(self, tags: str, arguments: list[str]) -> None:
        word, *values = arguments
        if word == "alive":
            self._alive, self._sets = [int(value) for value in values], {}
        elif word == "set" and tags == "sifffff":
            self._sets[int(values[0])] = (float(values[1]), float(values[2]))
        elif word == "fseq":
            self._end_bundle(int(values[0]))
        elif word != "source":
            self.log.faults.append(f"No message of profile 2Dcur: {tags} {arguments}.")

    def _end_bundle(self, fseq: int) -> None:
        """Take the bundle unless it is late: the reference clients forgive a sender that starts again 100 below."""
        if fseq != REDUNDANT:
            if self._fseq - MOST_LATE <= fseq < self._fseq:
                return
            self._fseq = fseq
        for session_id in sorted(self._live - set(self._alive)):
            self.log.remove(session_id)
        for session_id in self._alive:
            if session_id not in self._live:
                self.log.add(session_id, self._sets.get(session_id, (0.0, 0.0)))
            elif session_id in self._sets:
                self.log.move(session_id, self._sets[session_id])
        self._live = set(self._alive)


def oscdump_path() -> str:
    """Return where oscdump is. Without it a test fails in CI and is skipped elsewhere."""
    path = shutil.which("oscdump")
    if path is None:
        missing("oscdump is not installed: apt-get install liblo-tools")
    return path


def missing(remedy: str) -> NoReturn:
    """End a test that lacks a client: it fails in CI and is skipped elsewhere."""
    if os.environ.get("CI") == "true":
        pytest.fail(remedy)
    pytest.skip(remedy)


def free_udp_port() -> int:
    """Return a port that nobody listens on now, that no test was given before, and that is nobody's by chance.

    It lies below those of which the kernel gives one to whoever sends first or asks for any: one of theirs may go to
    another test, or to what is tested, before the client that was to listen on it has started.
    """
    for port in _own_ports():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", port))
            except OSError:
                continue
            return port
    raise OSError(
        f"No UDP port is left between {LOWEST_PORT} and those that the kernel gives away: "
        "run fewer tests at a time, or let those begin higher (net.ipv4.ip_local_port_range)."
    )


@cache
def _own_ports() -> Iterator[int]:
    """Return ports that no other worker of this test run is given."""
    above = int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    return iter(range(LOWEST_PORT + number, above, workers))
