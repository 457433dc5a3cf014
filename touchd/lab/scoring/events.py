"""What a program said of each frame: the events to be scored."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

from touchd.errors import RecordingError
from touchd.formats.folder import reading

Pair: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class SeenHover:
    """What was said of a fingertip in the air: where it is in area coordinates, and how high."""

    x: float
    y: float
    height_mm: float


@dataclass(frozen=True, slots=True)
class SeenHand:
    """What was said of a hand: whose it is, and which ("left" or "right", None: not said)."""

    person: int
    side: str | None


@dataclass(frozen=True, slots=True)
class SeenFrame:
    """What was said of one depth frame: each live cursor's id and place in area coordinates.

    The rest is empty where a program does not say it: the cursors' velocities in area axes a second, the hands that
    they belong to, fingertips in the air, hands, and the outlines of objects in area coordinates.
    """

    index: int  # of the depth frame, from 0
    t_s: float
    tracking: bool
    cursors: Mapping[int, Pair]
    velocities: Mapping[int, Pair] = field(default_factory=dict)
    owners: Mapping[int, int] = field(default_factory=dict)
    hovers: Mapping[int, SeenHover] = field(default_factory=dict)
    hands: Mapping[int, SeenHand] = field(default_factory=dict)
    objects: tuple[tuple[Pair, ...], ...] = ()


def seen_frame(event: Mapping[str, Any]) -> SeenFrame:
    """Return an event in the form of docs/design.md; needed are frame, t, state, and the cursors' id, x, y.

    Raises KeyError, TypeError or ValueError for anything else.
    """
    index, t_s, tracking = int(event["frame"]), float(event["t"]), event["state"] == "tracking"
    cursors = event["cursors"]
    return SeenFrame(
        index=index,
        t_s=t_s,
        tracking=tracking,
        cursors={int(c["id"]): (float(c["x"]), float(c["y"])) for c in cursors},
        velocities={int(c["id"]): (float(c["vx"]), float(c["vy"])) for c in cursors if {"vx", "vy"} <= c.keys()},
        owners={int(c["id"]): int(c["hand"]) for c in cursors if c.get("hand") is not None},
        hovers={
            int(h["id"]): SeenHover(float(h["x"]), float(h["y"]), float(h["height_mm"]))
            for h in event.get("hovers", ())
        },
        hands={int(h["id"]): SeenHand(int(h["person"]), h.get("side")) for h in event.get("hands", ())},
        objects=tuple(tuple((float(x), float(y)) for x, y in o["outline"]) for o in event.get("objects", ())),
    )


def seen_frames(events: Iterable[Mapping[str, Any]]) -> tuple[SeenFrame, ...]:
    """Return events as of :func:`seen_frame`. Raises what it does, and ValueError where frames do not rise."""
    frames = tuple(seen_frame(event) for event in events)
    for before, frame in pairwise(frames):
        if frame.index <= before.index or frame.t_s <= before.t_s:
            raise ValueError(f"frame {frame.index} at {frame.t_s} s comes after frame {before.index} at {before.t_s} s")
    return frames


def read_events(path: Path) -> tuple[SeenFrame, ...]:
    """Return the events in a file of JSON lines. Raises RecordingError."""
    with reading(path):
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    events = []
    for number, line in enumerate(lines, 1):
        try:
            events.append(json.loads(line))
        except ValueError as error:
            raise RecordingError(
                f"{path}, line {number}, is no JSON ({error}): expected is one event a line"
            ) from error
    try:
        frames = seen_frames(events)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise RecordingError(
            f"{path} holds no events ({type(error).__name__}: {error}): expected is a line a depth frame such as "
            '{"frame": 0, "t": 0.0, "state": "tracking", "cursors": [{"id": 1, "x": 0.5, "y": 0.5}]}'
        ) from error
    if not any(frame.tracking for frame in frames):
        raise RecordingError(f'{path} has no frame with state "tracking" in {len(frames)} lines: nothing can be scored')
    return frames
