"""The daemon's end of the control socket: on threads of its own, and bounded in all that a client may cost."""

import logging
import os
import socket
import threading
import time
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from touchd.control.errors import ControlError
from touchd.control.paths import make_folder
from touchd.control.protocol import Answerer, Controls, encoded, error_reply
from touchd.errors import AlreadyRunning, ExitCode

log = logging.getLogger(__name__)

_MODE = 0o660
_PAUSE_S = 0.1  # after the system refused a connection, for want of file handles
_PROBE_S = 1.0
_LONGEST_PATH = 107  # bytes: what Linux has room for in sockaddr_un, less the closing zero


@dataclass(frozen=True, slots=True)
class Limits:
    """What clients may take: how many at a time, how much they may say, and how long that and listening may last."""

    clients: int = 8
    request_bytes: int = 4096
    request_s: float = 2.0
    reply_s: float = 2.0


class ControlServer:
    """Answers requests at a socket: ``start`` makes it, ``stop`` removes it.

    Whatever a client sends or leaves undone costs its own thread's time alone.
    """

    def __init__(self, path: Path, controls: Controls, limits: Limits | None = None) -> None:
        self._path = path
        self._answerer = Answerer(controls)
        self._limits = limits or Limits()
        self._stopping = threading.Event()
        self._clients: dict[socket.socket, threading.Thread] = {}
        self._changing = threading.Lock()
        self._listener: socket.socket | None = None
        self._inode: int | None = None
        self._thread = threading.Thread(target=self._accept, name="control", daemon=True)

    @property
    def path(self) -> Path:
        """The socket."""
        return self._path

    def start(self) -> None:
        """Make the socket and begin to answer.

        A socket that nobody listens at is replaced. Raises AlreadyRunning if somebody does, and ControlError if it
        cannot be made.
        """
        make_folder(self._path.parent)
        self._refuse_live_or_remove()
        self._listener = self._bound()
        self._inode = os.lstat(self._path).st_ino
        self._thread.start()

    def stop(self) -> None:
        """Remove the socket, tell clients that are waiting, and end within the time that they have for a reply."""
        self._stopping.set()
        if self._listener is None:
            return
        with suppress(OSError):
            if os.lstat(self._path).st_ino == self._inode:
                self._path.unlink()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes accept()
        self._thread.join(self._limits.reply_s)
        self._listener.close()
        with self._changing:
            clients = dict(self._clients)
        for client in clients:
            with suppress(OSError):
                client.shutdown(socket.SHUT_RD)
        deadline_s = time.monotonic() + self._limits.reply_s
        for thread in clients.values():
            thread.join(max(0.0, deadline_s - time.monotonic()))

    def _refuse_live_or_remove(self) -> None:
        if len(os.fsencode(self._path)) > _LONGEST_PATH:
            raise ControlError(
                f"{self._path}: too long for a socket's path ({len(os.fsencode(self._path))} bytes, at most "
                f"{_LONGEST_PATH}); name a shorter folder with RUNTIME_DIRECTORY"
            )
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
            probe.settimeout(_PROBE_S)
            try:
                probe.connect(str(self._path))
            except FileNotFoundError:
                return
            except ConnectionRefusedError:
                if not self._path.is_socket():
                    raise ControlError(f"{self._path}: is in the way of the control socket; remove it") from None
            except (TimeoutError, OSError) as error:
                raise self._cannot_make(error) from error
            else:
                raise AlreadyRunning(f"{self._path}: another touchd answers at this control socket; stop it first")
        with suppress(FileNotFoundError):
            self._path.unlink()

    def _bound(self) -> socket.socket:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            listener.bind(str(self._path))
            # Before listen(), so that at no time anybody else can connect.
            self._path.chmod(_MODE)
            listener.listen(self._limits.clients)
        except OSError as error:
            listener.close()
            raise self._cannot_make(error) from error
        return listener

    def _cannot_make(self, error: OSError) -> ControlError:
        return ControlError(
            f"{self._path}: the control socket cannot be made: {error.strerror or error}; check the folder's owner, or "
            "name another one with RUNTIME_DIRECTORY"
        )

    def _accept(self) -> None:
        assert self._listener is not None  # noqa: S101  for the type checker: start() has made it
        while not self._stopping.is_set():
            try:
                client, _ = self._listener.accept()
            except OSError:
                self._stopping.wait(_PAUSE_S)
                continue
            self._admit(client)

    def _admit(self, client: socket.socket) -> None:
        thread = threading.Thread(target=self._serve, args=(client,), name="control client", daemon=True)
        with self._changing:
            full = len(self._clients) >= self._limits.clients
            if not full:
                self._clients[client] = thread
        if full:
            self._turn_away(client)
            return
        try:
            thread.start()
        except RuntimeError:  # the system has no more threads for us
            with self._changing:
                self._clients.pop(client)
            self._turn_away(client)

    def _turn_away(self, client: socket.socket) -> None:
        client.setblocking(False)
        with closing(client), suppress(OSError):
            client.sendall(encoded(error_reply("touchd has too many clients at once; try again", ExitCode.TRY_AGAIN)))

    def _serve(self, client: socket.socket) -> None:
        try:
            with closing(client):
                line = self._read_request(client)
                if line is not None:
                    self._answer(client, line)
        except OSError as error:
            log.debug("a client of the control socket went away: %s", error)
        except Exception:
            log.exception("a client of the control socket could not be served")
        finally:
            with self._changing:
                self._clients.pop(client)

    def _read_request(self, client: socket.socket) -> bytes | None:
        """Return what a client sends up to the first line end, None if it sends nothing in time."""
        deadline_s = time.monotonic() + self._limits.request_s
        received = b""
        while b"\n" not in received and len(received) <= self._limits.request_bytes:
            client.settimeout(max(1e-3, deadline_s - time.monotonic()))
            more = client.recv(self._limits.request_bytes)
            if not more:
                return received or None
            received += more
        return received.partition(b"\n")[0]

    def _answer(self, client: socket.socket, line: bytes) -> None:
        client.settimeout(self._limits.reply_s)
        if len(line) > self._limits.request_bytes:
            message = f"a request has at most {self._limits.request_bytes} bytes"
            client.sendall(encoded(error_reply(message, ExitCode.USAGE)))
            return
        with closing(self._answerer.replies(line)) as replies:
            for reply in replies:
                client.sendall(encoded(reply))
                if self._stopping.is_set() and not reply["done"]:
                    client.sendall(encoded(error_reply("touchd is stopping", ExitCode.TRY_AGAIN)))
                    return
