"""The computer as the doctor sees it: the one way to everything outside, so that tests can make up another one."""

import importlib.util
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from touchd.sources.kinect.devices import UsbPresence, look_at_usb


def _may_read_and_write(path: Path) -> bool:
    return os.access(path, os.R_OK | os.W_OK)


def _is_installed(module: str) -> bool:
    return importlib.util.find_spec(module) is not None


@dataclass(frozen=True, slots=True)
class Computer:
    """A computer. ``root`` is where its /sys, /proc, /dev and so on are; nothing is written there."""

    env: Mapping[str, str]
    root: Path = Path("/")
    look: Callable[[], UsbPresence] = look_at_usb
    may_use: Callable[[Path], bool] = _may_read_and_write
    load: Callable[[str], object] = import_module
    is_installed: Callable[[str], bool] = _is_installed
    now_s: Callable[[], float] = time.time
    uid: int = field(default_factory=os.getuid)
    groups: frozenset[int] = field(default_factory=lambda: frozenset((os.getegid(), *os.getgroups())))
    pid: int = field(default_factory=os.getpid)

    def at(self, path: str) -> Path:
        """Return where the file with this absolute path is."""
        return self.root / path.lstrip("/")

    def read(self, path: str) -> str | None:
        """Return a text file's content without white space around it; None if it cannot be read."""
        return read_text(self.at(path))

    def exists(self, path: str) -> bool:
        """Return whether there is such a file, as far as this user may see."""
        return os.path.lexists(self.at(path))

    def names(self, path: str) -> list[str]:
        """Return what is in a folder, in order; nothing if it cannot be read."""
        return names_in(self.at(path))

    def number(self, path: str) -> int | None:
        """Return the whole number in a file; None if there is none."""
        return as_number(self.read(path))

    def group_id(self, name: str) -> int | None:
        """Return the id of a group by its name; None if there is no such group."""
        return next((as_number(entry[2]) for entry in self._entries("/etc/group") if entry[0] == name), None)

    def owning_group(self, path: str) -> int | None:
        """Return the id of the group that a file belongs to; None if there is no such file."""
        try:
            return self.at(path).stat().st_gid
        except OSError:
            return None

    def is_member(self, user: str, group: str) -> bool:
        """Return whether a user is listed as a group's member, which holds from the next login on."""
        return any(entry[0] == group and user in entry[3].split(",") for entry in self._entries("/etc/group"))

    def has_user(self, name: str) -> bool:
        """Return whether there is such a user."""
        return any(entry[0] == name for entry in self._entries("/etc/passwd"))

    def _entries(self, path: str) -> list[list[str]]:
        entries = (line.split(":") for line in (self.read(path) or "").splitlines())
        return [entry for entry in entries if len(entry) >= 4]


def read_text(path: Path) -> str | None:
    """Return a text file's content without white space around it; None if it cannot be read."""
    try:
        return path.read_text("utf-8", "replace").strip()
    except OSError:
        return None


def names_in(folder: Path) -> list[str]:
    """Return what is in a folder, in order; nothing if it cannot be read."""
    try:
        return sorted(os.listdir(folder))  # noqa: PTH208  names are wanted
    except OSError:
        return []


def link_name(path: Path) -> str | None:
    """Return the last part of where a symbolic link leads; None if it is none."""
    try:
        return path.readlink().name
    except OSError:
        return None


def as_number(text: str | None, base: int = 10) -> int | None:
    """Return the whole number that a text spells; None if it spells none."""
    try:
        return None if text is None else int(text, base)
    except ValueError:
        return None
