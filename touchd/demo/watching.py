"""Looking over the daemon's shoulder: which frames come, what is seen in them, and what is above the table."""

from collections.abc import Iterator
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.model import AreaCorners, Floats, Frame, Mask, Sensor, State, Surface
from touchd.sources.source import Source

_GRID = (160, 112)  # places looked at, along the area's width and height
_RISEN_MM = 15.0
_NEIGHBOURS = np.ones((3, 3), np.uint8)  # lost readings are filled in from them


class WatchedSource:
    """Another source's frames, of which the last is remembered and the missing ones are counted."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self.last: Frame | None = None
        self.left_out = 0

    @property
    def sensor(self) -> Sensor:
        """The camera."""
        return self._source.sensor

    @property
    def identified(self) -> bool:
        """Whether the camera is known."""
        return self._source.identified

    @property
    def name(self) -> str:
        """What the source calls itself."""
        return self._source.name

    @property
    def waiting(self) -> str | None:
        """What the source waits for."""
        return self._source.waiting

    @property
    def reconnects(self) -> int:
        """How often the source was found again."""
        return self._source.reconnects

    @property
    def packet_loss(self) -> float | None:
        """Which share of the source's packets was lost lately."""
        return self._source.packet_loss

    def frames(self) -> Iterator[Frame]:
        """Yield the source's frames."""
        due = 0
        for frame in self._source.frames():
            self.left_out += frame.index - due
            due = frame.index + 1
            self.last = frame
            yield frame

    def show(self, state: State) -> None:
        """Pass on how the daemon fares."""
        self._source.show(state)

    def close(self) -> None:
        """Close the source."""
        self._source.close()


class Relief:
    """Where something is above the surface, at a grid of places over the area."""

    def __init__(self, sensor: Sensor, area: AreaCorners) -> None:
        self._to_mm = sensor.to_mm
        self._pixels = _grid_pixels(area, sensor.size)
        self._surface: Surface | None = None
        self._surface_mm: Floats = np.zeros(self._pixels.shape, np.float32)

    def risen(self, frame: Frame | None, surface: Surface | None) -> Mask:
        """Return where a frame shows something above the surface, (H, W) over the area; nowhere if one is missing."""
        if frame is None or surface is None:
            return np.zeros(self._pixels.shape, np.bool_)
        if surface is not self._surface:
            self._surface = surface
            reference = np.rint(surface.reference.ravel()[self._pixels]).astype(np.intp)
            self._surface_mm = self._to_mm[np.clip(reference, 0, len(self._to_mm) - 1)]
        heights_mm = self._surface_mm - self._to_mm[frame.raw.ravel()[self._pixels]]
        above = (heights_mm > _RISEN_MM).astype(np.uint8)  # 0 where there is no reading
        closed: Mask = cv2.morphologyEx(above, cv2.MORPH_CLOSE, _NEIGHBOURS) > 0
        return closed


def _grid_pixels(area: AreaCorners, size: tuple[int, int]) -> NDArray[np.intp]:
    """Return the index in the flattened picture of each place of the grid (H, W)."""
    columns, rows = _GRID
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    to_pixels = cv2.getPerspectiveTransform(unit, np.array(area.corners_px, np.float32))
    places = [((i + 0.5) / columns, (j + 0.5) / rows) for j, i in product(range(rows), range(columns))]
    pixels = cv2.perspectiveTransform(np.array([places], np.float64), to_pixels)[0]
    u, v = np.clip(np.rint(pixels), 0, np.array(size) - 1).astype(np.intp).T
    flat: NDArray[np.intp] = (v * size[0] + u).reshape(rows, columns)
    return flat
