"""Fingertips for profile 25Dcur: one cursor for each, from the air to the surface and back."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from touchd.model import Cursor, Hover, TouchFrame
from touchd.outputs.screen import Screen
from touchd.outputs.things import AirCursor, Thing

# A hover that is missing in a single frame is followed on; clients would take the gap for two fingers.
_HELD_NS = 50_000_000
_SHORTEST_S = 1e-3


@dataclass(frozen=True, slots=True)
class _Known:
    """A fingertip as last told: which touch or hover it is, and where, in area coordinates."""

    session_id: int | None
    hover_id: int | None
    cursor: AirCursor
    seen_ns: int


class Fingertips:
    """Follows fingertips through hovers and touches, under ids of its own that count up from 1.

    ``full_mm`` is the height that is sent as z = 1.
    """

    def __init__(self, screen: Screen, full_mm: float) -> None:
        self._screen = screen
        self._full_mm = max(full_mm, 1e-3)
        self._known: dict[int, _Known] = {}
        self._speeds: dict[int, float] = {}  # as told, in the client's axes a second
        self._next_id = 1
        self._now_ns = 0

    def of(self, frame: TouchFrame) -> Sequence[Thing]:
        """Return the client's fingertips: live touches, hovers, and hovers that may only be hidden."""
        dt_s = max((frame.t_ns - self._now_ns) / 1e9, _SHORTEST_S)
        self._now_ns = frame.t_ns
        now = {each.cursor.session_id: each for each in self._seen(frame, dt_s)}
        hidden = (self._held(each) for key, each in self._known.items() if key not in now)
        now |= {each.cursor.session_id: each for each in hidden if each is not None}
        self._known = now
        placed = self._screen.view([each.cursor for each in now.values()])
        told = [self._with_accel(cursor, dt_s) for cursor in placed]
        self._speeds = {cursor.session_id: _speed(cursor) for cursor in told}
        return told

    def end_all(self) -> None:
        """Forget every fingertip; later ones get new ids."""
        self._known = {}
        self._speeds = {}
        self._screen.view(())

    def _seen(self, frame: TouchFrame, dt_s: float) -> Iterator[_Known]:
        by_touch: dict[int | None, _Known] = {each.session_id: each for each in self._known.values()}
        by_hover: dict[int | None, _Known] = {each.hover_id: each for each in self._known.values()}
        by_touch.pop(None, None)
        by_hover.pop(None, None)
        for touch in frame.cursors:
            known = by_touch.pop(touch.session_id, None) or by_hover.pop(touch.hover_id, None)
            cursor = self._touching(touch, known, dt_s)
            yield _Known(touch.session_id, None, cursor, frame.t_ns)
        for hover in frame.hovers:
            known = by_hover.pop(hover.hover_id, None) or by_touch.pop(hover.session_id, None)
            yield _Known(None, hover.hover_id, self._hovering(hover, known), frame.t_ns)

    def _touching(self, touch: Cursor, known: _Known | None, dt_s: float) -> AirCursor:
        fallen = 0.0 if known is None else known.cursor.z
        return AirCursor(self._id(known), touch.x, touch.y, 0.0, touch.vx, touch.vy, -fallen / dt_s, 0.0)

    def _hovering(self, hover: Hover, known: _Known | None) -> AirCursor:
        z = min(max(hover.height_mm / self._full_mm, 0.0), 1.0)
        return AirCursor(self._id(known), hover.x, hover.y, z, hover.vx, hover.vy, hover.vz_mm_s / self._full_mm, 0.0)

    def _held(self, known: _Known) -> _Known | None:
        """Return a hover that is not seen now as one that stands still, or None when it has been away for too long."""
        if known.hover_id is None or self._now_ns - known.seen_ns > _HELD_NS:
            return None
        return replace(known, cursor=replace(known.cursor, vx=0.0, vy=0.0, vz=0.0))

    def _id(self, known: _Known | None) -> int:
        if known is not None:
            return known.cursor.session_id
        self._next_id += 1
        return self._next_id - 1

    def _with_accel(self, cursor: AirCursor, dt_s: float) -> AirCursor:
        speed = _speed(cursor)
        return replace(cursor, accel=(speed - self._speeds.get(cursor.session_id, speed)) / dt_s)


def _speed(cursor: AirCursor) -> float:
    return math.hypot(cursor.vx, cursor.vy, cursor.vz)
