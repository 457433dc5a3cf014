"""What a program said of each frame: the events to be scored."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from touchd.errors import RecordingError
from touchd.formats.folder import reading


@dataclass(frozen=True, slots=True)
class SeenFrame:
    """What was said of one depth frame: each live cursor's id and place in area coordinates."""

    index: int  # of the depth frame, from 0
    t_s: float
    tracking: bool
    cursors: Mapping[int, tuple[float, float]]


def seen_frames(events: Iterable[Mapping[str, Any]]) -> tuple[SeenFrame, ...]:
    """Return events in the form of docs/design.md; needed of each: frame, t, state, and the cursors' id, x, y.

    Raises KeyError, TypeError or ValueError for anything else, and where frames do not rise.
    """
    frames = tuple(
        SeenFrame(
            index=int(event["frame"]),
            t_s=float(event["t"]),
            tracking=event["state"] == "tracking",
            cursors={int(c["id"]): (float(c["x"]), float(c["y"])) for c in event["cursors"]},
        )
        for event in events
    )
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
