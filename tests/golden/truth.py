"""Compares the events of a replay with a recording's truth.json."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Event = dict[str, Any]


@dataclass(frozen=True)
class Score:
    touches: int  # touching episodes in the truth
    found: int  # of which a cursor was near at some time
    splits: int  # further cursors near an episode that had one
    false_cursors: int  # cursors that were never near a fingertip in or near touch
    errors_mm: list[float]  # of each frame in which a fingertip touched
    late_frames: list[int]  # from first touching to first cursor


NEAR_MM = 20.0
# A finger this low may already, or still, be reported as touching.
LOW_MM = 12.0


def read_events(path: Path) -> list[Event]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def score(events: list[Event], truth: list[list[dict[str, Any]]], size_mm: tuple[float, float]) -> Score:
    ids_of_tip: dict[int, list[int]] = {}
    first_touching: dict[int, int] = {}
    first_cursor: dict[int, int] = {}
    explained: set[int] = set()
    errors: list[float] = []
    for event, tips in zip(events, truth, strict=True):
        for tip in tips:
            distances = {c["id"]: _distance_mm(c, tip, size_mm) for c in event["cursors"]}
            near = {i: d for i, d in distances.items() if d < NEAR_MM}
            if tip["clearance_mm"] < LOW_MM:
                explained |= near.keys()
            if not tip["touching"]:
                continue
            first_touching.setdefault(tip["tip"], event["frame"])
            for session_id in near:
                first_cursor.setdefault(tip["tip"], event["frame"])
                if session_id not in ids_of_tip.setdefault(tip["tip"], []):
                    ids_of_tip[tip["tip"]].append(session_id)
            if near:
                errors.append(min(near.values()))
    all_ids = {c["id"] for event in events for c in event["cursors"]}
    return Score(
        touches=len(first_touching),
        found=len(ids_of_tip),
        splits=sum(len(ids) - 1 for ids in ids_of_tip.values()),
        false_cursors=len(all_ids - explained),
        errors_mm=errors,
        late_frames=[first_cursor[tip] - frame for tip, frame in first_touching.items() if tip in first_cursor],
    )


def _distance_mm(cursor: Event, tip: dict[str, Any], size_mm: tuple[float, float]) -> float:
    return float(np.hypot((cursor["x"] - tip["x"]) * size_mm[0], (cursor["y"] - tip["y"]) * size_mm[1]))
