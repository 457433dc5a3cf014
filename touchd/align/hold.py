"""Telling a finger that is held still from one that passes by."""

import math
from collections import deque
from dataclasses import dataclass
from enum import StrEnum

from touchd.model import State, TouchFrame

_JITTER = 4.0


class Phase(StrEnum):
    """What is waited for at a point; the words are part of the control protocol."""

    TOUCH = "touch"
    HOLD = "hold"
    LIFT = "lift"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class HoldStep:
    """What one frame brought.

    ``position`` is given once, in the frame in which the hold is complete: the touch's mean place meanwhile, in the
    coordinates of the frames' cursors; ``towards`` is where its finger pointed then, where that is known. DONE is given
    once too, when the finger has gone.
    """

    phase: Phase
    share: float  # of the time that a touch must be held
    position: tuple[float, float] | None = None
    towards: tuple[float, float] | None = None
    why: str | None = None  # what keeps a hold from counting, a sentence for people


class HoldDetector:
    """Waits for exactly one touch that holds still, then for the lifted finger, and then begins anew.

    Still means: of the places in the last ``hold_s`` the mean of the first half and that of the second lie within
    ``still_mm``, and none is farther than ``_JITTER`` times that from the mean of all. So a camera's noise, which at
    1.5 m moves a resting finger by several mm, does not count as motion, but a slow slide does. A touch that moves
    counts from where it came to rest. Time is the frames'.
    """

    def __init__(
        self, size_mm: tuple[float, float], hold_s: float = 0.8, still_mm: float = 2.0, lift_s: float = 0.2
    ) -> None:
        """``size_mm``: the width and height that the cursors' 0..1 stand for."""
        self._size_mm = size_mm
        self._hold_ns = round(hold_s * 1e9)
        self._lift_ns = round(lift_s * 1e9)
        self._still_mm = still_mm
        self._places: deque[tuple[int, float, float]] = deque()
        self._held = False
        self._empty_since_ns: int | None = None

    def feed(self, frame: TouchFrame) -> HoldStep:
        """Take in the next frame."""
        if self._held:
            return self._await_lift(frame)
        if frame.state is not State.TRACKING or len(frame.cursors) != 1:
            self._places.clear()
            return HoldStep(Phase.TOUCH, 0.0, why=_obstacle(frame))
        touch = frame.cursors[0]
        self._places.append((frame.t_ns, touch.x, touch.y))
        while self._spread_mm() > _JITTER * self._still_mm:
            self._places.popleft()
        share = (frame.t_ns - self._places[0][0]) / self._hold_ns
        if share >= 1.0 and self._slid_mm() > self._still_mm:
            self._places.popleft()
            share = 0.99
        if share < 1.0:
            return HoldStep(Phase.HOLD, share)
        position = _mean(tuple(self._places))
        self._held, self._empty_since_ns = True, None
        self._places.clear()
        return HoldStep(Phase.LIFT, 1.0, position, touch.towards)

    def _await_lift(self, frame: TouchFrame) -> HoldStep:
        if frame.state is not State.TRACKING or frame.cursors:
            self._empty_since_ns = None
            return HoldStep(Phase.LIFT, 1.0)
        if self._empty_since_ns is None:
            self._empty_since_ns = frame.t_ns
        if frame.t_ns - self._empty_since_ns < self._lift_ns:
            return HoldStep(Phase.LIFT, 1.0)
        self._held = False
        return HoldStep(Phase.DONE, 1.0)

    def _spread_mm(self) -> float:
        mean = _mean(tuple(self._places))
        return max(self._apart_mm(mean, (x, y)) for _, x, y in self._places)

    def _slid_mm(self) -> float:
        places = tuple(self._places)
        half = len(places) // 2
        return self._apart_mm(_mean(places[:half]), _mean(places[half:])) if half else 0.0

    def _apart_mm(self, a: tuple[float, float], b: tuple[float, float]) -> float:
        width_mm, height_mm = self._size_mm
        return math.hypot((a[0] - b[0]) * width_mm, (a[1] - b[1]) * height_mm)


def _mean(places: tuple[tuple[int, float, float], ...]) -> tuple[float, float]:
    return math.fsum(x for _, x, _ in places) / len(places), math.fsum(y for _, _, y in places) / len(places)


def _obstacle(frame: TouchFrame) -> str | None:
    if frame.state is not State.TRACKING:
        return frame.why or f"touchd is {frame.state.value}"
    if len(frame.cursors) > 1:
        return f"{len(frame.cursors)} touches are seen: use one finger, with the rest of the hand high"
    return None
