"""Where the control socket is: for the daemon that makes it, and for the commands that look for it."""

import os
import stat
from collections.abc import Mapping
from pathlib import Path

from touchd.control.errors import ControlError, NotRunning
from touchd.state import instance_of, state_folder

SYSTEM_FOLDER = Path("/run")
_SOCKET = "control.sock"


def control_socket_path(env: Mapping[str, str]) -> Path:
    """Return where the daemon of this environment has its control socket.

    Under systemd that is ``control.sock`` in the first ``$RUNTIME_DIRECTORY``. Else a user may run several daemons
    with a state folder each, so the name holds that of the instance; the folder is ``$XDG_RUNTIME_DIR/touchd``, or
    without one ``/tmp/touchd-UID``.
    """
    if env.get("RUNTIME_DIRECTORY"):
        return Path(env["RUNTIME_DIRECTORY"].split(":")[0]) / _SOCKET
    base = env.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "touchd" if base else _fallback_folder()
    return folder / f"control-{instance_of(state_folder(env))}.sock"


def find_control_socket(env: Mapping[str, str], given: Path | None, system_folder: Path = SYSTEM_FOLDER) -> Path:
    """Return the socket of the daemon that a command means: ``given``, else this user's, else the system's.

    Raises NotRunning if there is none, and ControlError if the system has several or the folder is not to be trusted.
    """
    if given is not None:
        return given
    own = control_socket_path(env)
    if own.parent == _fallback_folder() and _is_there(own.parent):
        check_private(own.parent)
    if env.get("RUNTIME_DIRECTORY") or _is_there(own):
        return own
    found = _system_sockets(system_folder)
    if not found:
        raise NotRunning(
            f"no touchd is running here (no socket at {own} or {system_folder / 'touchd' / _SOCKET}); "
            "start it with touchd run"
        )
    if len(found) > 1:
        raise ControlError(f"several touchd run here; choose one with --socket: {', '.join(map(str, found))}")
    return found[0]


def make_folder(folder: Path) -> None:
    """Make the socket's folder if it is not there. Raises ControlError if it cannot be made or trusted."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise ControlError(
            f"{folder}: the control socket's folder cannot be made: {error.strerror}; "
            "name another one with RUNTIME_DIRECTORY"
        ) from error
    if folder == _fallback_folder():
        check_private(folder)


def check_private(folder: Path) -> None:
    """Raise ControlError unless the folder is this user's alone: in /tmp anybody may have made it."""
    found = os.lstat(folder)
    if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077:
        return
    raise ControlError(
        f"{folder}: not used for the control socket, for it is not a folder of user {os.getuid()} alone "
        f"(owner {found.st_uid}, mode {stat.filemode(found.st_mode)}); remove it, or set XDG_RUNTIME_DIR"
    )


def _fallback_folder() -> Path:
    return Path(f"/tmp/touchd-{os.getuid()}")  # noqa: S108  trusted only after check_private


def _system_sockets(system_folder: Path) -> list[Path]:
    """Return the sockets of systemd's touchd.service and of the instances of touchd@.service."""
    folders = [system_folder / "touchd", *sorted(system_folder.glob("touchd-*"))]
    return [folder / _SOCKET for folder in folders if _is_there(folder / _SOCKET)]


def _is_there(path: Path) -> bool:
    """Return whether there is such a file, or one could be but may not be looked at."""
    try:
        os.lstat(path)
    except PermissionError:
        return True
    except OSError:
        return False
    return True
