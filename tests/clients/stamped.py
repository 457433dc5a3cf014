"""Scripts of contacts as recordings that the real daemon can play: pads of a finger's size stamped on a flat table."""

import random
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from touchd.formats.libfreenect import write_libfreenect
from touchd.geometry import ZeroPlane
from touchd.model import Frame

Pixel = tuple[float, float]
Cell = tuple[int, int]

EMPTY_FRAMES = 12
FRAME_NS = 33_333_000
TABLE_RAW, PAD_RAW = 700, 696  # 0.89 m from the camera, and 9 mm above it
PAD_RADIUS_PX = 7
COLUMNS, ROWS, CELL_PX = 12, 7, 48
EDGE_PX = (44.0, 72.0)  # where the first cell begins

CONFIG = f"""\
source: {{kind: recording, path: recording}}
calibration: {{frames: {EMPTY_FRAMES}}}
area: {{corners_px: [[30, 60], [630, 60], [630, 420], [30, 420]], size_mm: [924, 554]}}
touch: {{method: shell}}
"""


def write_stamped(
    folder: Path, script: Sequence[Sequence[Pixel]], stall_after: int | None = None, stall_ns: int = 0
) -> Path:
    """Write an empty table and then a frame for each list of pads (u, v), px; return the path of its config.

    The camera stalls for ``stall_ns`` after that many of the frames with pads.
    """
    late_from = len(script) if stall_after is None else stall_after
    frames = (
        replace(frame, t_ns=frame.t_ns + stall_ns * (frame.index >= EMPTY_FRAMES + late_from))
        for frame in _frames(script)
    )
    write_libfreenect(folder / "recording", frames, ZeroPlane())
    config = folder / "touchd.yaml"
    config.write_text(CONFIG)
    return config


def _frames(script: Iterable[Sequence[Pixel]]) -> Iterator[Frame]:
    pictures = [*[()] * EMPTY_FRAMES, *script]
    for index, pads in enumerate(pictures):
        raw = np.full((480, 640), TABLE_RAW, np.uint16)
        for u, v in pads:
            cv2.circle(raw, (round(16 * u), round(16 * v)), 16 * PAD_RADIUS_PX, PAD_RAW, cv2.FILLED, shift=4)
        yield Frame(index, index * FRAME_NS, raw)


def crowd(most: int, frames: int, seed: int) -> list[list[Pixel]]:
    """Return ``most`` pads, each in a cell of its own, that drift and rest; at last all lift.

    Every ninth frame a sixth of them lift, and in the next as many land elsewhere. As touchd holds a touch for a moment
    after its contact has gone, the old cursors end in the frame in which the new ones begin.
    """
    chance = random.Random(seed)
    free = [(column, row) for row in range(ROWS) for column in range(COLUMNS)]
    chance.shuffle(free)
    live: dict[Cell, Pixel] = {free.pop(): (0.0, 0.0) for _ in range(most)}
    lifted: list[Cell] = []
    script = []
    for index in range(1, frames + 1):
        live |= {free.pop(): (0.0, 0.0) for _ in lifted}
        free, lifted = [*lifted, *free], []
        if index % 9 == 0:
            lifted = chance.sample(sorted(live), max(1, most // 6))
        live = {cell: _drifted(at, chance) for cell, at in live.items() if cell not in lifted}
        script.append([_pixel(cell, at) for cell, at in live.items()])
    return [*script, *[[]] * 8]


def _drifted(at: Pixel, chance: random.Random) -> Pixel:
    step = chance.choice((0.0, 1.5))
    return (
        min(max(at[0] + chance.uniform(-step, step), -8.0), 8.0),
        min(max(at[1] + chance.uniform(-step, step), -8.0), 8.0),
    )


def _pixel(cell: Cell, at: Pixel) -> Pixel:
    return EDGE_PX[0] + CELL_PX * (cell[0] + 0.5) + at[0], EDGE_PX[1] + CELL_PX * (cell[1] + 0.5) + at[1]
