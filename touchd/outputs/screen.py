"""Where the area lies on a client's screen, and which cursors that client gets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from touchd.model import Cursor
from touchd.outputs.tuio import MAX_CURSORS

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class ScreenMap:
    """From area coordinates to a client's: first the axes are swapped, then flipped, then mapped to ``box``.

    ``box`` is left, top, right and bottom of the area on the client's screen, in 0..1 of its width and height. It may
    reach beyond the screen: then the client gets a part of the area.
    """

    box: Box = (0.0, 0.0, 1.0, 1.0)
    swap_axes: bool = False
    flip_x: bool = False
    flip_y: bool = False

    def place(self, cursor: Cursor) -> Cursor:
        """Return ``cursor`` in the client's coordinates, which may lie outside 0..1."""
        left, top, right, bottom = self.box
        x, y, vx, vy = cursor.x, cursor.y, cursor.vx, cursor.vy
        if self.swap_axes:
            x, y, vx, vy = y, x, vy, vx
        if self.flip_x:
            x, vx = 1.0 - x, -vx
        if self.flip_y:
            y, vy = 1.0 - y, -vy
        across, down = right - left, bottom - top
        placed_vx, placed_vy = vx * across, vy * down
        return replace(
            cursor,
            x=left + x * across,
            y=top + y * down,
            vx=placed_vx,
            vy=placed_vy,
            accel=cursor.accel * _stretch(math.hypot(vx, vy), math.hypot(placed_vx, placed_vy), across, down),
        )


def _stretch(speed: float, placed_speed: float, across: float, down: float) -> float:
    """Return by how much lengths grow along the way of a cursor; at rest, the mean of both axes."""
    return placed_speed / speed if speed > 0.0 else math.sqrt(across * down)


class Screen:
    """One client's view of the cursors.

    A cursor is judged once, when it first appears: it belongs to the client if it lies on its screen and there are
    fewer than ``max_cursors`` others. It then stays to its end, held at the edge where it strays, and one that was
    refused stays refused: nothing appears in mid-stroke.
    """

    def __init__(self, placement: ScreenMap | None = None, max_cursors: int = MAX_CURSORS) -> None:
        self._placement = placement or ScreenMap()
        self._plain = self._placement == ScreenMap()
        self._max_cursors = max_cursors
        self._shown: frozenset[int] = frozenset()
        self._refused: frozenset[int] = frozenset()

    def view(self, cursors: Sequence[Cursor]) -> list[Cursor]:
        """Return the client's cursors in its coordinates, the oldest first. Call it once for each frame."""
        shown = [cursor for cursor in cursors if cursor.session_id in self._shown]
        for cursor in sorted(cursors, key=lambda cursor: cursor.session_id):
            known = cursor.session_id in self._shown or cursor.session_id in self._refused
            if not known and len(shown) < self._max_cursors and self._is_on_screen(cursor):
                shown.append(cursor)
        self._shown = frozenset(cursor.session_id for cursor in shown)
        self._refused = frozenset(cursor.session_id for cursor in cursors) - self._shown
        shown.sort(key=lambda cursor: cursor.session_id)
        return shown if self._plain else [_held(self._placement.place(cursor)) for cursor in shown]

    def _is_on_screen(self, cursor: Cursor) -> bool:
        placed = self._placement.place(cursor)
        return 0.0 <= placed.x <= 1.0 and 0.0 <= placed.y <= 1.0


def _held(cursor: Cursor) -> Cursor:
    return replace(cursor, x=min(max(cursor.x, 0.0), 1.0), y=min(max(cursor.y, 0.0), 1.0))
