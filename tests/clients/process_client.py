"""Real TUIO clients that run in processes of their own.

A child takes its UDP port as argument and writes one JSON list a line, as soon as it knows: ``["ready"]`` or
``["missing", remedy]`` first, then ``["add", session id, x, y]``, ``["move", session id, x, y]``, ``["remove",
session id]`` (x, y in 0..1, y down) and ``["fault", sentence]``. Each line on its standard input is a number, which it
returns as ``["pong", number]`` when all events of what it read from its port are out. It ends when that input ends.
Its standard error comes the same way: what is no JSON list is a complaint of the client.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from clients.comparison import ClientLog
from clients.harness import PATIENCE_S, free_udp_port, missing

FOLDER = Path(__file__).parent
LOOK_AGAIN_S = 0.001


@dataclass(frozen=True, slots=True)
class UdpSocket:
    """A line of the kernel's table of UDP sockets."""

    port: int
    inode: int
    waiting_bytes: int  # in the receive queue
    dropped: int  # datagrams that found the receive queue full


def udp_sockets() -> list[UdpSocket]:
    """Return this computer's UDP sockets, from /proc/net/udp and /proc/net/udp6 (see proc(5))."""
    found = []
    for table in (Path("/proc/net/udp"), Path("/proc/net/udp6")):
        for line in table.read_text().splitlines()[1:] if table.exists() else ():
            words = line.split()
            found.append(
                UdpSocket(
                    port=int(words[1].rpartition(":")[2], 16),
                    inode=int(words[9]),
                    waiting_bytes=int(words[4].partition(":")[2], 16),
                    dropped=int(words[12]),
                )
            )
    return found


class ProcessClient(ABC):
    """A child process that is a TUIO client; nothing but what is under test is sent to its port."""

    def __init__(self, port: int | None = None) -> None:
        self.log = ClientLog()
        self.port = free_udp_port() if port is None else port
        self.destination = f"127.0.0.1:{self.port}"
        self._said: list[str] = []  # what is no event, before it was ready
        self._ready = self._ended = False
        self._remedy: str | None = None
        self._pinged = self._ponged = 0
        self._inode = 0
        self._changed = threading.Condition()

    @abstractmethod
    def command(self) -> list[str]:
        """Return the child's command; the port is added."""

    def __enter__(self) -> Self:
        command = [*self.command(), str(self.port)]
        self._folder = tempfile.TemporaryDirectory()
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=_environment(self._folder.name),
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        try:
            self._await_start()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait(PATIENCE_S)
        self._thread.join(PATIENCE_S)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        self._folder.cleanup()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def dropped(self) -> int:
        """How many datagrams the kernel dropped so far because the client did not read fast enough."""
        return self._socket().dropped

    def sync(self) -> None:
        """Wait until all that was sent before has reached the log; the client is sent nothing for it."""
        limit = time.monotonic() + PATIENCE_S
        while self._socket().waiting_bytes:
            if time.monotonic() > limit:
                raise TimeoutError(f"{self} does not read its UDP port {self.port}.")
            time.sleep(LOOK_AGAIN_S)
        self._pinged += 1
        assert self._process.stdin is not None
        self._process.stdin.write(f"{self._pinged}\n")
        self._process.stdin.flush()
        self._wait_for(lambda: self._ponged >= self._pinged, "answered no ping")

    def __str__(self) -> str:
        return f"The client {type(self).__name__}"

    def _await_start(self) -> None:
        self._wait_for(lambda: self._ready or self._remedy is not None, "did not become ready")
        if self._remedy is not None:
            missing(self._remedy)
        own = {str(entry.readlink()) for entry in Path(f"/proc/{self.pid}/fd").iterdir()}
        inodes = [one.inode for one in udp_sockets() if one.port == self.port and f"socket:[{one.inode}]" in own]
        if not inodes:
            raise OSError(f"{self} does not listen on UDP port {self.port}; it said: {self._said}.")
        self._inode = inodes[0]

    def _socket(self) -> UdpSocket:
        for one in udp_sockets():
            if one.inode == self._inode:
                return one
        raise OSError(f"{self} has closed its UDP port {self.port}; its faults: {self.log.faults}.")

    def _wait_for(self, happened: Callable[[], bool], otherwise: str) -> None:
        with self._changed:
            self._changed.wait_for(lambda: happened() or self._ended, PATIENCE_S)
            if happened():
                return
            said = self._said + self.log.faults
        if self._ended:
            raise OSError(f"{self} ended with code {self._process.wait(PATIENCE_S)}; it said: {said}.")
        raise TimeoutError(f"{self} {otherwise} within {PATIENCE_S} s; it said: {said}.")

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with self._changed:
                self._take(line.rstrip())
                self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _take(self, line: str) -> None:
        match _message(line):
            case ["ready"]:
                self._ready = True
            case ["missing", str(remedy)]:
                self._remedy = remedy
            case ["pong", int(number)]:
                self._ponged = number
            case ["add", int(session_id), x, y]:
                self.log.add(session_id, (float(x), float(y)))
            case ["move", int(session_id), x, y]:
                self.log.move(session_id, (float(x), float(y)))
            case ["remove", int(session_id)]:
                self.log.remove(session_id)
            case ["fault", str(sentence)]:
                self.log.faults.append(sentence)
            case _ if self._ready:
                self.log.faults.append(line)
            case _:  # of the computer it starts on, such as a missing input device
                self._said.append(line)


def _message(line: str) -> Any:
    try:
        return json.loads(line)
    except ValueError:
        return None


def _environment(folder: str) -> dict[str, str]:
    """Return the child's environment, in which it finds no settings of the user's and leaves none."""
    kivy = {
        "KIVY_HOME": folder,
        "KIVY_NO_ARGS": "1",
        "KIVY_NO_FILELOG": "1",
        "KIVY_LOG_MODE": "PYTHON",  # leaves the logging module as it is, which writes warnings to stderr
    }
    qt = {"QT_QPA_PLATFORM": "offscreen", "QT_FORCE_STDERR_LOGGING": "1"}
    return {**os.environ, "XDG_RUNTIME_DIR": folder, "XDG_CACHE_HOME": folder, **kivy, **qt}


class QtTouch(ProcessClient):
    """Qt 6's TuioTouch plugin, with a window over the whole of an offscreen screen."""

    def command(self) -> list[str]:
        return [sys.executable, str(FOLDER / "qt_client.py")]


class KivyTuio(ProcessClient):
    """Kivy's TUIO provider on oscpy, without a window."""

    def command(self) -> list[str]:
        return [sys.executable, str(FOLDER / "kivy_client.py")]


class NodeTuio(ProcessClient):
    """npm's tuio-client in Node, fed by osc-js from UDP."""

    def command(self) -> list[str]:
        node = shutil.which("node")
        if node is None:
            missing("node is not installed: apt-get install nodejs npm")
        return [node, str(FOLDER / "node" / "client.mjs")]
