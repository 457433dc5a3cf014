"""The area in characters: what is above it in dots, touches as marks with their ids."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from touchd.demo.styles import Line, Signs, Span, Style
from touchd.model import Cursor, Mask

# Which bit of a braille character (U+2800 on) stands for its dot in this row and column.
_BRAILLE_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_BRAILLE = 0x2800
_DOTS_HIGH, _DOTS_WIDE = _BRAILLE_BITS.shape
_HALF_FULL = 4  # dots


def area_cells(risen: Mask, cursors: Sequence[Cursor], size: tuple[int, int], signs: Signs) -> list[Line]:
    """Return rows of characters, ``size`` (columns, rows) in all, of the area.

    ``risen`` (H, W) is true where something is above it.
    """
    columns, rows = size
    cells = [[(sign, Style.HAND) for sign in row] for row in _hands(risen, size, signs)]
    places = [(_cell(cursor.x, columns), _cell(cursor.y, rows), cursor) for cursor in cursors]
    taken = {(column, row) for column, row, _ in places}
    for column, row, cursor in places:
        cells[row][column] = (signs.touch, Style.TOUCH)
        label = str(cursor.session_id)
        begin = _label_begin(column, row, len(label), columns, taken)
        if begin is not None:
            for place, sign in enumerate(label, begin):
                cells[row][place] = (sign, Style.TOUCH)
                taken.add((place, row))
    return [_line(row) for row in cells]


def _hands(risen: Mask, size: tuple[int, int], signs: Signs) -> list[str]:
    columns, rows = size
    dots = _resampled(risen, columns * _DOTS_WIDE, rows * _DOTS_HIGH)
    blocks = dots.reshape(rows, _DOTS_HIGH, columns, _DOTS_WIDE).transpose(0, 2, 1, 3)
    if signs.dots:
        codes = (blocks * _BRAILLE_BITS).sum((2, 3))
        return ["".join(chr(_BRAILLE + code) if code else " " for code in row) for row in codes.tolist()]
    full = blocks.sum((2, 3)) >= _HALF_FULL
    return ["".join("#" if cell else " " for cell in row) for row in full.tolist()]


def _resampled(picture: Mask, width: int, height: int) -> Mask:
    rows, columns = (_nearest(old, new) for old, new in zip(picture.shape, (height, width), strict=True))
    return picture[np.ix_(rows, columns)]


def _nearest(old: int, new: int) -> NDArray[np.intp]:
    return ((np.arange(new) + 0.5) * old / new).astype(np.intp)


def _cell(share: float, cells: int) -> int:
    return min(max(int(share * cells), 0), cells - 1)


def _label_begin(column: int, row: int, length: int, columns: int, taken: set[tuple[int, int]]) -> int | None:
    """Return where a label right of a mark, or else left of it, covers no other one; None if it would."""
    for begin in (column + 1, column - length):
        span = range(begin, begin + length)
        if begin >= 0 and span.stop <= columns and not any((place, row) in taken for place in span):
            return begin
    return None


def _line(cells: Sequence[tuple[str, Style]]) -> Line:
    return tuple(
        Span("".join(sign for sign, _ in run), style) for style, run in groupby(cells, key=lambda cell: cell[1])
    )
