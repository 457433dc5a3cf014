"""Tables with exact truth, and trackers that are right about them, for the tests of the scoring."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from touchd.lab.scoring import SeenFrame, Truth, seen_frames, truth_of

SIZE_MM = (600.0, 400.0)
FRAME_S = 1 / 30
UP_FRAMES = 4
Event = dict[str, Any]
TipJson = dict[str, Any]


@dataclass(frozen=True)
class Stroke:
    """A touch of one finger: frames of hovering before it, of touching, and its way in mm a frame.

    It hovers for four more frames where it was lifted, and leaps to the next.
    """

    pause: int
    frames: int
    x_mm: float
    step_mm: float = 0.0


def table(fingers: Sequence[Sequence[Stroke]], hover_mm: float = 40.0) -> list[list[TipJson]]:
    """Return the truth of fingers, each in a lane of its own; they hover before, between and after strokes."""
    lanes = [_lane(number, strokes, hover_mm) for number, strokes in enumerate(fingers)]
    length = max(len(lane) for lane in lanes)
    frames: list[list[TipJson]] = [[] for _ in range(length)]
    number = 0
    for lane in lanes:
        for touch in sorted({tip["tip"] for tip in lane}):
            number += 1
            for tip in lane:
                if tip["tip"] == touch:
                    tip["number"] = number
        for at in range(length):
            tip = dict(lane[min(at, len(lane) - 1)])
            tip["tip"] = tip.pop("number")
            frames[at].append(tip)
    return frames


def _lane(finger: int, strokes: Sequence[Stroke], hover_mm: float) -> list[TipJson]:
    lane: list[TipJson] = []
    for touch, stroke in enumerate(strokes):
        for frame in range(-stroke.pause, stroke.frames + UP_FRAMES):
            x_mm = stroke.x_mm + stroke.step_mm * min(max(0, frame), stroke.frames - 1)
            clearance_mm = 0.0 if 0 <= frame < stroke.frames else hover_mm
            lane.append(_tip(touch, finger, x_mm, 50.0 + 100.0 * finger, clearance_mm))
    return lane


def _tip(touch: int, finger: int, x_mm: float, y_mm: float, clearance_mm: float) -> TipJson:
    return {
        "tip": touch,
        "x": x_mm / SIZE_MM[0],
        "y": y_mm / SIZE_MM[1],
        "clearance_mm": clearance_mm,
        "touching": clearance_mm == 0.0,
        "finger": finger,
        "hand": finger // 2,
        "person": 0,
    }


def truth(frames: Sequence[Sequence[TipJson]]) -> Truth:
    return truth_of(frames, SIZE_MM)


def perfect(frames: Sequence[Sequence[TipJson]]) -> list[Event]:
    """Return the events of a tracker that is right about every frame; a touch's id is its number."""
    return [
        {
            "frame": index,
            "t": index * FRAME_S,
            "state": "tracking",
            "cursors": [{"id": tip["tip"], "x": tip["x"], "y": tip["y"]} for tip in tips if tip["touching"]],
        }
        for index, tips in enumerate(frames)
    ]


def seen(events: Iterable[Event]) -> tuple[SeenFrame, ...]:
    return seen_frames(events)


def moved(events: Iterable[Event], dx_mm: float, dy_mm: float) -> list[Event]:
    """Return the events with every cursor moved."""
    dx, dy = dx_mm / SIZE_MM[0], dy_mm / SIZE_MM[1]
    return [
        event | {"cursors": [c | {"x": c["x"] + dx, "y": c["y"] + dy} for c in event["cursors"]]} for event in events
    ]


def late(events: Sequence[Event], frames: int) -> list[Event]:
    """Return the events with every cursor that many frames later."""
    empty: list[Event] = [{"cursors": []}] * frames
    return [now | {"cursors": then["cursors"]} for now, then in zip(events, [*empty, *events], strict=False)]


def renamed(events: Iterable[Event], old: int, new: int, from_frame: int = 0) -> list[Event]:
    """Return the events in which one id is another from a frame on."""
    return [
        event
        | {
            "cursors": [
                c | {"id": new} if c["id"] == old and event["frame"] >= from_frame else c for c in event["cursors"]
            ]
        }
        for event in events
    ]


def without(events: Iterable[Event], gone: int) -> list[Event]:
    """Return the events without one id."""
    return [event | {"cursors": [c for c in event["cursors"] if c["id"] != gone]} for event in events]


def with_cursor(events: Iterable[Event], cursor: Event, frames: range) -> list[Event]:
    """Return the events with one more cursor in some frames."""
    return [event | {"cursors": [*event["cursors"], cursor]} if event["frame"] in frames else event for event in events]
