"""What is wrong with a config file, and how that is told: all at once, each under its line with a caret."""

import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from touchd.errors import ConfigError

KeyPath: TypeAlias = tuple[str | int, ...]  # keys, and positions in lists, from the top of the file

MOST_SHOWN = 20
DRAWN_TO_LINE_END = 1 << 20  # a width for what ends in a later line
_EXCERPT_CHARACTERS = 100
_BEFORE_CARET = 60
_MESSAGE_CHARACTERS = 300
# Unicode categories: control, format (such as reversed writing), surrogate, line and paragraph separator.
_UNSAFE = {"Cc", "Cf", "Cs", "Zl", "Zp"}


@dataclass(frozen=True, slots=True, order=True)
class Mark:
    """A stretch of one line: line and column count from 1, ``width`` is in characters."""

    line: int
    column: int
    width: int = 1


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """One thing that is wrong: where, and a sentence that begins with the key's dotted path if it has one."""

    mark: Mark
    what: str


def config_error(name: str, text: str, problems: Iterable[Problem]) -> ConfigError:
    """Return the error that shows all problems in the order of the file.

    ``name`` is what the file is called in the message, ``text`` its whole content. After ``MOST_SHOWN``
    problems the rest is only counted.
    """
    ordered = sorted(set(problems))
    lines = split_lines(text.removeprefix("\ufeff"))
    shown = [_shown(name, lines, problem) for problem in ordered[:MOST_SHOWN]]
    if len(ordered) > MOST_SHOWN:
        shown.append(f"... and {len(ordered) - MOST_SHOWN} more.")
    count = "1 error" if len(ordered) == 1 else f"{len(ordered)} errors"
    shown.append(f"{count}; the config was not used.")
    return ConfigError("\n".join(shown))


def dotted(path: KeyPath) -> str:
    """Return a path as people write it: ``outputs[0].tuio.to``."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).removeprefix(".")


def split_lines(text: str) -> list[str]:
    """Return the lines as YAML 1.1 counts them, which is not how ``str.splitlines`` does."""
    for line_break in ("\r\n", "\r", "\x85", "\u2028", "\u2029"):
        text = text.replace(line_break, "\n")
    return text.split("\n")


def shorten(text: str, characters: int) -> str:
    """Return ``text``, cut to so many characters where it is longer."""
    return text if len(text) <= characters else text[: characters - 3] + "..."


def _shown(name: str, lines: list[str], problem: Problem) -> str:
    mark = problem.mark
    line = lines[mark.line - 1] if mark.line <= len(lines) else ""
    before = min(mark.column - 1, len(line))
    start = max(0, before - _BEFORE_CARET)
    excerpt = line[start : start + _EXCERPT_CHARACTERS]
    carets = "^" * max(1, min(mark.width, len(excerpt) - (before - start)))
    what = shorten(problem.what, _MESSAGE_CHARACTERS)
    return "\n".join(
        (
            _printable(f"{name}:{mark.line}:{mark.column}: {what}"),
            _printable(f"{mark.line:>6} | {excerpt}").rstrip(),
            f"{'':>6} | {' ' * (before - start)}{carets}",
        )
    )


def _printable(text: str) -> str:
    # A terminal must not obey what a broken file holds, and a lone surrogate cannot be written out at all.
    return "".join(_visible(character) for character in text)


def _visible(character: str) -> str:
    if character == "\t":
        return " "
    return "\N{REPLACEMENT CHARACTER}" if unicodedata.category(character) in _UNSAFE else character
