"""Where the area lies on a client's screen, and what of a frame that client gets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import TypeVar

from touchd.model import Cursor
from touchd.outputs.profiles import MAX_CURSORS
from touchd.outputs.things import AirCursor, Blob, Thing

Box = tuple[float, float, float, float]
T = TypeVar("T", Cursor, AirCursor, Blob)

_OLDEST_FIRST = attrgetter("session_id")


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

    def point(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the area lies in the client's coordinates."""
        left, top, right, bottom = self.box
        if self.swap_axes:
            x, y = y, x
        if self.flip_x:
            x = 1.0 - x
        if self.flip_y:
            y = 1.0 - y
        return left + x * (right - left), top + y * (bottom - top)

    def screen_mm(self, area_mm: tuple[float, float]) -> tuple[float, float]:
        """Return how wide and high the client's screen is where the area has this width and height, in mm."""
        left, top, right, bottom = self.box
        width, height = reversed(area_mm) if self.swap_axes else area_mm
        return width / (right - left), height / (bottom - top)

    def place(self, thing: T) -> T:
        """Return ``thing`` in the client's coordinates, which may lie outside 0..1."""
        left, top, right, bottom = self.box
        vx, vy = (thing.vy, thing.vx) if self.swap_axes else (thing.vx, thing.vy)
        across, down = right - left, bottom - top
        x, y = self.point(thing.x, thing.y)
        placed_vx = -vx * across if self.flip_x else vx * across
        placed_vy = -vy * down if self.flip_y else vy * down
        accel = thing.accel * _stretch(math.hypot(vx, vy), math.hypot(placed_vx, placed_vy), across, down)
        return replace(thing, x=x, y=y, vx=placed_vx, vy=placed_vy, accel=accel)


def _stretch(speed: float, placed_speed: float, across: float, down: float) -> float:
    """Return by how much lengths grow along the way of a cursor; at rest, the mean of both axes."""
    return placed_speed / speed if speed > 0.0 else math.sqrt(across * down)


class Screen:
    """One client's view of the cursors, fingertips or blobs; of one kind of them, as their ids tell them apart.

    Each is judged once, when it first appears: it belongs to the client if it lies on its screen and there are
    fewer than ``max_cursors`` others. It then stays to its end, held at the edge where it strays, and one that was
    refused stays refused: nothing appears in mid-stroke.
    """

    def __init__(self, placement: ScreenMap | None = None, max_cursors: int = MAX_CURSORS) -> None:
        self._placement = placement or ScreenMap()
        self._plain = self._placement == ScreenMap()
        self._max_cursors = max_cursors
        self._shown: frozenset[int] = frozenset()
        self._refused: frozenset[int] = frozenset()

    def view(self, things: Sequence[T]) -> list[T]:
        """Return what of a frame the client gets, in its coordinates, the oldest first. Call it once for each frame."""
        shown = [thing for thing in things if thing.session_id in self._shown]
        for thing in sorted(things, key=_OLDEST_FIRST):
            known = thing.session_id in self._shown or thing.session_id in self._refused
            if not known and len(shown) < self._max_cursors and self._is_on_screen(thing):
                shown.append(thing)
        self._shown = frozenset(thing.session_id for thing in shown)
        self._refused = frozenset(thing.session_id for thing in things) - self._shown
        shown.sort(key=_OLDEST_FIRST)
        return shown if self._plain else [_held(self._placement.place(thing)) for thing in shown]

    def _is_on_screen(self, thing: Thing) -> bool:
        x, y = self._placement.point(thing.x, thing.y)
        return 0.0 <= x <= 1.0 and 0.0 <= y <= 1.0


def _held(thing: T) -> T:
    return replace(thing, x=min(max(thing.x, 0.0), 1.0), y=min(max(thing.y, 0.0), 1.0))
