"""Which processes have a USB device open, or hold a socket: what only /proc tells."""

import os
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath

from touchd.doctor.computer import Computer, names_in, read_text

_OF_INTEREST = ("/dev/bus/usb/", "socket:[")


@dataclass(frozen=True, slots=True)
class Process:
    """A running process."""

    pid: int
    name: str
    is_touchd: bool

    def __str__(self) -> str:
        return f"{self.name} (pid {self.pid})"


@dataclass(frozen=True, slots=True)
class OpenFiles:
    """Who has what open. ``complete`` is false where processes of other users could not be looked into."""

    by_link: Mapping[str, tuple[Process, ...]]
    complete: bool

    def holders(self, link: str) -> tuple[Process, ...]:
        """Return who has a file, or "socket:[inode]", open."""
        return self.by_link.get(link, ())


def look_at_processes(computer: Computer) -> OpenFiles:
    """Look through all processes but this one."""
    found: dict[str, list[Process]] = defaultdict(list)
    complete = True
    folder = computer.at("/proc")
    for pid in (int(name) for name in names_in(folder) if name.isdigit() and int(name) != computer.pid):
        links = _links(folder / str(pid) / "fd")
        complete = complete and links is not None
        for link in links or ():
            found[link].append(_process(folder / str(pid), pid))
    return OpenFiles({link: tuple(processes) for link, processes in found.items()}, complete)


def _links(folder: Path) -> set[str] | None:
    """Return what of interest a process has open; None if that may not be seen."""
    try:
        paths = [entry.path for entry in os.scandir(folder)]
        return {link for path in paths if (link := _target(path)).startswith(_OF_INTEREST)}
    except PermissionError:
        return None
    except OSError:
        return set()  # it ended in this very moment


def _target(path: str) -> str:
    try:
        return str(Path(path).readlink())
    except FileNotFoundError:
        return ""  # it was closed in this very moment


def _process(folder: Path, pid: int) -> Process:
    words = (read_text(folder / "cmdline") or "").split("\0")
    is_touchd = any(PurePath(word).name == "touchd" for word in words)
    return Process(pid, "touchd" if is_touchd else read_text(folder / "comm") or "a process", is_touchd)
