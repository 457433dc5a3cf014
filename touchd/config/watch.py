"""Notices that the config file was edited, by any way of saving it."""

from pathlib import Path
from typing import TypeAlias

_Look: TypeAlias = tuple[int, int, int] | None


class ConfigWatch:
    """Compares modification time, inode and size; call :meth:`changed` every 200 ms or so.

    An edit counts when two looks agree, so that a file that is just being written is not read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known = self._last = self._look()

    def changed(self) -> bool:
        """Look at the file; return whether there is an edit that was not told of before."""
        now = self._look()
        settled = now == self._last
        self._last = now
        if settled and now != self._known:
            self._known = now
            return True
        return False

    def _look(self) -> _Look:
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_ino, found.st_size
