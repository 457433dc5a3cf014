"""Things on the surface for profile 2Dblb: the rectangle around each, and how it moves."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from touchd.model import TableObject, TouchFrame
from touchd.outputs.screen import Screen, ScreenMap
from touchd.outputs.things import Blob, Thing
from touchd.tracking.filters import OneEuro
from touchd.tracking.settings import TrackingSettings

_SHORTEST_S = 1e-3
_SETTINGS = TrackingSettings()  # a thing that is pushed is smoothed like the finger that pushes it
_REST_MM_S = 20.0  # an outline is coarser than a fingertip
_SHAKE_MM = 8.0  # what lies still is told to have moved from here on: two pixels of a coarse picture at 1 m
_QUARTER = math.pi / 2.0
_TWO_PI = 2.0 * math.pi

Outline = Sequence[tuple[float, float]]
Size = tuple[float, float]  # width and height of the client's screen, mm


@dataclass(frozen=True, slots=True)
class _Rectangle:
    """A rectangle around a thing, in mm on the client's screen; ``angle`` is that of its width, without bounds."""

    x_mm: float
    y_mm: float
    angle: float
    width_mm: float
    height_mm: float

    @property
    def radius_mm(self) -> float:
        """How far its corners are from its centre."""
        return math.hypot(self.width_mm, self.height_mm) / 2.0


@dataclass(frozen=True, slots=True)
class _Track:
    """A thing as last told: its outline, its rectangle, and where the filters have its centre and its angle."""

    outline: Outline  # in area coordinates
    rectangle: _Rectangle
    centre: OneEuro
    angle: OneEuro  # radians, as x
    blob: Blob


class Blobs:
    """Follows the things on the surface, in the coordinates of one client's screen.

    Ids of its own count up from 1: a thing that was out of sight, or lay there before a pause, comes back as another.
    """

    def __init__(self, placement: ScreenMap, max_blobs: int) -> None:
        self._placement = placement
        self._screen = Screen(max_cursors=max_blobs)  # what it gets is placed already
        self._tracks: dict[int, _Track] = {}  # by the object's id
        self._next_id = 1
        self._now_ns = 0

    def of(self, frame: TouchFrame) -> Sequence[Thing]:
        """Return the client's blobs."""
        dt_s = max((frame.t_ns - self._now_ns) / 1e9, _SHORTEST_S)
        self._now_ns = frame.t_ns
        size = self._placement.screen_mm(frame.area_mm)
        things = (thing for thing in frame.objects if thing.outline)
        self._tracks = {thing.object_id: self._followed(thing, size, dt_s) for thing in things}
        return self._screen.view([track.blob for track in self._tracks.values()])

    def end_all(self) -> None:
        """Forget every thing."""
        self._tracks = {}
        self._screen.view(())

    def _followed(self, thing: TableObject, size: Size, dt_s: float) -> _Track:
        last = self._tracks.get(thing.object_id)
        if last is None:
            return self._begun(thing, size)
        rectangle, area = last.rectangle, last.blob.area
        if thing.outline != last.outline:
            outline = self._placed(thing)
            seen = _turned_near(_around(outline, size), rectangle.angle)
            if _is_moving(last.blob) or not _is_as_before(seen, rectangle):
                rectangle, area = seen, _area(outline)
        centre = _filtered(last.centre, rectangle.x_mm, rectangle.y_mm, dt_s, 1.0)
        angle = _filtered(last.angle, rectangle.angle, 0.0, dt_s, rectangle.radius_mm)
        turned = angle.x_mm - last.angle.x_mm
        turn = _unless_at_rest(turned / _TWO_PI / dt_s, abs(turned) * rectangle.radius_mm / dt_s)
        still = _still(last.blob.session_id, rectangle, centre, angle.x_mm, area, size)
        blob = _in_motion(still, last.blob, turn, size, dt_s)
        return _Track(thing.outline, rectangle, centre, angle, blob)

    def _begun(self, thing: TableObject, size: Size) -> _Track:
        outline = self._placed(thing)
        rectangle = _around(outline, size)
        centre, angle = OneEuro(rectangle.x_mm, rectangle.y_mm), OneEuro(rectangle.angle, 0.0)
        blob = _still(self._next_id, rectangle, centre, rectangle.angle, _area(outline), size)
        self._next_id += 1
        return _Track(thing.outline, rectangle, centre, angle, blob)

    def _placed(self, thing: TableObject) -> Outline:
        return [self._placement.point(x, y) for x, y in thing.outline]


def _around(outline: Outline, size: Size) -> _Rectangle:
    """Return the smallest rectangle around an outline in the client's coordinates; its width is the longer side."""
    box = cv2.boxPoints(cv2.minAreaRect(np.array(outline, np.float32) * np.array(size, np.float32))).tolist()
    (ax, ay), (bx, by), (cx, cy), _ = box
    one, other = math.hypot(bx - ax, by - ay), math.hypot(cx - bx, cy - by)
    angle = math.atan2(by - ay, bx - ax) if one >= other else math.atan2(cy - by, cx - bx)
    return _Rectangle((ax + cx) / 2.0, (ay + cy) / 2.0, angle % math.pi, max(one, other), min(one, other))


def _turned_near(rectangle: _Rectangle, angle: float) -> _Rectangle:
    """Return the same rectangle with that one of its sides as its width whose angle is nearest to ``angle``.

    Which side of a square is the longer one changes with the noise; the thing has not turned.
    """
    quarters = round((angle - rectangle.angle) / _QUARTER)
    turned = replace(rectangle, angle=rectangle.angle + quarters * _QUARTER)
    if quarters % 2 == 0:
        return turned
    return replace(turned, width_mm=rectangle.height_mm, height_mm=rectangle.width_mm)


def _is_moving(blob: Blob) -> bool:
    return any((blob.vx, blob.vy, blob.turn))


def _is_as_before(seen: _Rectangle, before: _Rectangle) -> bool:
    """Return whether what differs may be an outline's flicker."""
    off_mm = (
        math.hypot(seen.x_mm - before.x_mm, seen.y_mm - before.y_mm),
        abs(seen.angle - before.angle) * before.radius_mm,
        abs(seen.width_mm - before.width_mm),
        abs(seen.height_mm - before.height_mm),
    )
    return max(off_mm) < _SHAKE_MM


def _area(outline: Outline) -> float:
    """Return an outline's area as a share of the client's screen."""
    following = zip(outline, [*outline[1:], outline[0]], strict=True)
    return abs(math.fsum(ax * by - bx * ay for (ax, ay), (bx, by) in following)) / 2.0


def _filtered(last: OneEuro, x: float, y: float, dt_s: float, mm: float) -> OneEuro:
    """Return the filter's next state, in units of so many mm."""
    return last.moved(x, y, dt_s, _SETTINGS.min_cutoff_hz, _SETTINGS.beta_hz_s_mm * mm)


def _still(session_id: int, rectangle: _Rectangle, centre: OneEuro, angle: float, area: float, size: Size) -> Blob:
    return Blob(
        session_id=session_id,
        x=centre.x_mm / size[0],
        y=centre.y_mm / size[1],
        angle=angle % _TWO_PI,
        width=rectangle.width_mm / size[0],
        height=rectangle.height_mm / size[1],
        area=area,
        vx=0.0,
        vy=0.0,
        turn=0.0,
        accel=0.0,
        turn_accel=0.0,
    )


def _in_motion(blob: Blob, last: Blob, turn: float, size: Size, dt_s: float) -> Blob:
    """Return ``blob`` with the velocities that follow from where it was told to be a frame ago."""
    vx, vy = (blob.x - last.x) / dt_s, (blob.y - last.y) / dt_s
    speed_mm_s = math.hypot(vx * size[0], vy * size[1])
    vx, vy = _unless_at_rest(vx, speed_mm_s), _unless_at_rest(vy, speed_mm_s)
    accel = (math.hypot(vx, vy) - math.hypot(last.vx, last.vy)) / dt_s
    return replace(blob, vx=vx, vy=vy, turn=turn, accel=accel, turn_accel=(turn - last.turn) / dt_s)


def _unless_at_rest(rate: float, speed_mm_s: float) -> float:
    return 0.0 if speed_mm_s < _REST_MM_S else rate
