"""A terminal to draw on, or a stream of lines where there is none."""

import os
import select
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import TextIO

from touchd.demo.styles import Line, Span, Style

# Alternate screen, no cursor, no wrapping of long lines; and back.
_ENTER = "\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[2J"
_LEAVE = "\x1b[?7h\x1b[?25h\x1b[?1049l"
_USUAL_SIZE = (80, 24)


class Terminal:
    """Where text goes: straight to the stream's file, so that nothing of it waits in a buffer."""

    def __init__(self, stream: TextIO, environment: Mapping[str, str]) -> None:
        self._file = stream.fileno()
        self.encoding = stream.encoding or "ascii"
        self.is_screen = os.isatty(self._file) and environment.get("TERM", "dumb") != "dumb"
        self._coloured = not environment.get("NO_COLOR")

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows at this moment."""
        with suppress(OSError):
            columns, rows = os.get_terminal_size(self._file)
            if columns > 0 and rows > 0:
                return columns, rows
        return _USUAL_SIZE

    def write(self, text: str) -> None:
        """Write all of a text, waiting for room. Raises OSError, BrokenPipeError among them, if nobody reads it."""
        data = text.encode(self.encoding, "replace")
        while data:
            try:
                data = data[os.write(self._file, data) :]
            except BlockingIOError:  # another program made the file so
                select.select([], [self._file], [])

    def say(self, line: str) -> None:
        """Write a line of text."""
        self.write(line + "\n")

    def paint(self, lines: Sequence[Line]) -> None:
        """Put lines on the screen, from its top, in place of what is there."""
        placed = (f"\x1b[{row};1H{self._codes(line)}\x1b[K" for row, line in enumerate(lines, 1))
        self.write("".join(placed) + "\x1b[J")

    @contextmanager
    def whole_screen(self) -> Iterator[None]:
        """Take the screen, and give it back as it was in any case."""
        try:
            self.write(_ENTER)
            yield
        finally:
            self.write(_LEAVE)

    def _codes(self, line: Line) -> str:
        return "".join(map(self._coded, line))

    def _coded(self, span: Span) -> str:
        if span.style is Style.PLAIN or not self._coloured:
            return span.text
        return f"\x1b[{span.style.value}m{span.text}\x1b[0m"
