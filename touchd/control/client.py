"""A command's end of the control socket."""

import grp
import json
import pwd
import socket
import stat
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from touchd.control.errors import ControlError, NotRunning, Refused
from touchd.status.data import Status, status_from_json

_MOST_BYTES = 1 << 20  # of one reply


def request(
    path: Path, command: str, arguments: Mapping[str, object] | None = None, patience_s: float = 10.0
) -> Generator[Any]:
    """Ask the daemon at a socket for something and yield the objects it answers with, as they come.

    ``patience_s``: how long it may be silent. Raises NotRunning if nobody answers, ControlError if the socket cannot
    be used, Refused with the daemon's reason and exit code if it says no. To give up, close the iterator.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(patience_s)
        try:
            _connect(connection, path)
            with suppress(BrokenPipeError):  # turned away before it asked: why can still be read
                connection.sendall(json.dumps({"command": command, **(arguments or {})}).encode("ascii") + b"\n")
            with connection.makefile("rb") as answers:
                yield from _replies(path, answers)
        except TimeoutError:
            raise NotRunning(f"touchd at {path} has not answered for {patience_s:g} s; restart it") from None
        except ConnectionResetError:
            raise NotRunning(f"touchd at {path} went away before it had answered; is it being restarted?") from None


def fetch_status(path: Path) -> Status:
    """Return the status of the daemon at a socket. Raises what :func:`request` does, and StateError."""
    *_, content = request(path, "status")
    return status_from_json(content)


def _connect(connection: socket.socket, path: Path) -> None:
    start = "start it with touchd run"
    try:
        connection.connect(str(path))
    except FileNotFoundError:
        raise NotRunning(f"no touchd is running here (no socket at {path}); {start}") from None
    except ConnectionRefusedError:
        raise NotRunning(f"no touchd is running here (nobody listens at {path}); {start}") from None
    except PermissionError:
        raise ControlError(_may_not(path)) from None
    except TimeoutError:
        raise
    except OSError as error:
        raise ControlError(f"{path}: cannot be used as touchd's socket: {error.strerror or error}") from error


def _may_not(path: Path) -> str:
    """Return a sentence that says who may use the socket, as far as that can be seen."""
    for place in (path, *path.parents):
        with suppress(OSError):
            found = place.stat()
            break
    said = f"{path}: permission denied; it is open to user {_name(found.st_uid, _user)}"
    if not found.st_mode & stat.S_IRWXG:
        return f"{said} alone: use sudo"
    group = _name(found.st_gid, _group)
    return f"{said} and to group {group}: become a member of group {group} and log in again, or use sudo"


def _user(uid: int) -> str:
    return pwd.getpwuid(uid).pw_name


def _group(gid: int) -> str:
    return grp.getgrgid(gid).gr_name


def _name(number: int, look_up: Callable[[int], str]) -> str:
    try:
        return look_up(number)
    except KeyError:
        return str(number)


def _replies(path: Path, answers: IO[bytes]) -> Iterator[Any]:
    while True:
        line = answers.readline(_MOST_BYTES)
        if not line.endswith(b"\n"):
            raise NotRunning(f"touchd at {path} went away before it had answered; is it being restarted?")
        try:
            reply = json.loads(line)
        except ValueError:
            reply = None
        if not isinstance(reply, dict):
            raise ControlError(f"{path}: what answers there is not touchd; check --socket")
        if "error" in reply:
            raise Refused(str(reply["error"]), int(reply.get("exit_code", 70)))
        yield reply.get("progress", reply.get("result"))
        if reply.get("done"):
            return
