"""Events as JSON Lines, one object a frame: straight to a file, or through a queue that makes nobody wait."""

import io
import json
import os
import threading
from collections import deque
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from touchd.errors import OutputError
from touchd.model import TouchFrame
from touchd.outputs.output import OutputStatus


class EventWriter:
    """Writes event lines to a path, each at once and as a whole. Use it as a context, or close it."""

    def __init__(self, path: Path, mode: Literal["w", "a"] = "w") -> None:
        """Open ``path``: ``w`` starts the file anew, ``a`` adds to it.

        :raises OutputError: when it cannot be opened for writing.
        """
        self._path = path
        try:
            self._file = io.FileIO(path, mode)
        except OSError as error:
            raise OutputError(
                f"Cannot open {path} to write events: {error.strerror}; choose a path that can be written."
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write(self, frame: TouchFrame) -> None:
        """Write the frame's line. After a failure the file ends with the last whole line.

        :raises OutputError: when the system refuses, for example because the disk is full.
        :raises ValueError: when the frame has a number that is not finite, which JSON has no word for.
        """
        line = json.dumps(frame.as_event(), separators=(",", ":"), allow_nan=False).encode("ascii") + b"\n"
        done = 0
        try:
            while done < len(line):
                done += os.write(self._file.fileno(), line[done:])
        except OSError as error:
            self._take_back(done)
            raise self._failure(error) from error

    def close(self) -> None:
        """Close the file.

        :raises OutputError: when the system only now says that it could not write.
        """
        try:
            self._file.close()
        except OSError as error:
            raise self._failure(error) from error

    def _take_back(self, written: int) -> None:
        with suppress(OSError):  # a pipe has no way back
            self._file.truncate(self._file.seek(-written, os.SEEK_CUR))

    def _failure(self, error: OSError) -> OutputError:
        return OutputError(f"Cannot write events to {self._path}: {error.strerror}; make room or choose another path.")


class QueuedEventWriter:
    """An output that appends event lines to a file from a thread of its own.

    Frames wait in a queue of ``capacity``; when it is full a new one is dropped and counted. A line that the
    system refuses is counted too and not tried again, but the next one is; for it a file that could not be
    opened is opened anew. ``drain_s`` is how long :meth:`close` waits for what is in the queue.
    """

    def __init__(self, path: Path, capacity: int = 256, drain_s: float = 2.0) -> None:
        self._path = path
        self._capacity = capacity
        self._drain_s = drain_s
        self._waiting: deque[TouchFrame] = deque()
        self._changed = threading.Condition()
        self._closing = False
        self._sent = self._failed = self._dropped = 0
        self._last_error: str | None = None
        self._thread = threading.Thread(target=self._run, name=f"events to {path}", daemon=True)

    @property
    def dropped(self) -> int:
        """How many frames found the queue full or the output closed."""
        return self._dropped

    @property
    def last_error(self) -> str | None:
        """What the last failure was."""
        return self._last_error

    def start(self) -> None:
        """Start the thread, which opens the file."""
        self._thread.start()

    def publish(self, frame: TouchFrame, _now_ns: int) -> None:
        """Queue the frame's line."""
        with self._changed:
            if self._closing or len(self._waiting) >= self._capacity:
                self._dropped += 1
                return
            self._waiting.append(frame)
            self._changed.notify_all()

    def tick(self, now_ns: int) -> None:
        """Do nothing: a time without frames has no events."""

    def close(self) -> None:
        """Write what is in the queue and close the file, in at most ``drain_s``."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(self._drain_s)

    def status(self) -> OutputStatus:
        """Return the counters, in lines."""
        return OutputStatus(f"events to {self._path}", self._sent, self._failed, self._dropped, self._last_error)

    def _run(self) -> None:
        writer: EventWriter | None = None
        while (frame := self._next()) is not None:
            try:
                writer = writer or EventWriter(self._path, "a")
                writer.write(frame)
            except (OutputError, ValueError) as error:
                self._note_failure(error)
            else:
                self._sent += 1
        if writer is not None:
            try:
                writer.close()
            except OutputError as error:
                self._note_failure(error)

    def _next(self) -> TouchFrame | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closing)
            return self._waiting.popleft() if self._waiting else None

    def _note_failure(self, error: Exception) -> None:
        self._failed += 1
        self._last_error = str(error)
