"""Tables that a Kinect reads differently from frame to frame, as it warms up or is knocked: added before rounding."""

from collections.abc import Callable

import numpy as np
from touchd.model import Floats, Image16
from touchd.table.boxes import Box
from touchd.table.render import DepthPicture
from touchd.table.sensor_kinect import KinectV1
from touchd.table.table import Table

SHAPE = (480, 640)


class ShiftingKinect:
    """A Kinect whose readings are farther by ``shift`` (raw), a number or (H, W)."""

    def __init__(self, reader: KinectV1) -> None:
        self._reader = reader
        self._still = reader._still
        self._pattern_at = reader._pattern_at
        self.shift: Floats = np.zeros(SHAPE, np.float32)
        reader._pattern_at = self._shifted_pattern  # type: ignore[method-assign]

    def read(self, picture: DepthPicture, rng: np.random.Generator) -> Image16:
        self._reader._still = self._still + self.shift
        return self._reader.read(picture, rng)

    def _shifted_pattern(self, raw: Floats, box: Box) -> Floats:
        shifted: Floats = self._pattern_at(raw, box) + self.shift[box.window]
        return shifted


def shifting(table: Table) -> Callable[[Floats | float], None]:
    """Make a table shift, and return what sets by how much from the next frame on."""
    assert isinstance(table._reader, KinectV1)
    kinect = ShiftingKinect(table._reader)
    table._reader = kinect

    def shift(raw: Floats | float) -> None:
        kinect.shift = np.broadcast_to(np.asarray(raw, np.float32), SHAPE)

    return shift


def gradient(raw: float) -> Floats:
    """Return a shift that grows by so many raw steps from left to right, and is 0 in the middle."""
    across = np.linspace(-0.5 * raw, 0.5 * raw, SHAPE[1], dtype=np.float32)
    return np.broadcast_to(across, SHAPE)


def uneven(raw: float) -> Floats:
    """Return a drift of so many raw steps, which is a third more in one corner than in the opposite one."""
    y, x = np.mgrid[-1.0 : 1.0 : SHAPE[0] * 1j, -1.0 : 1.0 : SHAPE[1] * 1j]
    drift: Floats = (raw * (1.0 + 0.1 * x + 0.06 * y + 0.05 * x * x)).astype(np.float32)
    return drift
