"""Lines of styled text, and the signs that a terminal's encoding allows."""

import codecs
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias


class Style(Enum):
    """How text looks; the values are the terminal's own codes (ECMA-48, select graphic rendition)."""

    PLAIN = ""
    BOLD = "1"
    DIM = "2"
    HAND = "36"
    TOUCH = "1;33"
    GOOD = "1;32"
    BAD = "1;31"


@dataclass(frozen=True, slots=True)
class Span:
    """Text in one style; each of its characters takes one column."""

    text: str
    style: Style = Style.PLAIN


Line: TypeAlias = tuple[Span, ...]


@dataclass(frozen=True, slots=True)
class Signs:
    """The signs that pictures are made of. ``dots``: whether eight dots in a character can be drawn (braille)."""

    horizontal: str
    vertical: str
    corners: tuple[tuple[str, str], tuple[str, str]]
    touch: str
    arrow: str
    more: str
    dots: bool


_UNICODE = Signs("─", "│", (("┌", "┐"), ("└", "┘")), "●", "→", "…", dots=True)
_ASCII = Signs("-", "|", (("+", "+"), ("+", "+")), "O", "->", "..", dots=False)


def signs_for(encoding: str) -> Signs:
    """Return the signs for a terminal of this encoding: all of Unicode's, or ASCII where it is unknown or narrow."""
    try:
        name = codecs.lookup(encoding).name
    except LookupError:
        return _ASCII
    return _UNICODE if name == "utf-8" else _ASCII


def text_of(line: Line) -> str:
    """Return a line's bare text."""
    return "".join(span.text for span in line)


def cut(line: Line, columns: int) -> Line:
    """Return a line's first columns."""
    kept: list[Span] = []
    for span in line:
        text = span.text[:columns]
        columns -= len(text)
        if text:
            kept.append(Span(text, span.style))
    return tuple(kept)
