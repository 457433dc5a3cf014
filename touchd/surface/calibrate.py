"""The paper's calibration: a histogram of small deviations per pixel, over a few hundred frames of the empty surface.

A. D. Wilson, "Using a Depth Camera as a Touch Sensor", ITS 2010: depth noise is not normal (most pixels hold one
value, others vacillate between two), so the nearest depth that the empty surface shows is read off a histogram,
going from least depth to greatest, at the first bin of any weight.
"""

import numpy as np
from numpy.typing import NDArray

from touchd.errors import CalibrationError
from touchd.model import Frame, Image16, Mask, Sensor, Surface, frozen_array
from touchd.surface.settings import CalibrationSettings

BINS_EACH_SIDE = 10
# A pixel of which more than this share of the readings lay outside its histogram saw something move.
MOVED_SHARE = 0.10
# A pixel needs a reading in at least this share of the frames to be part of the surface.
READING_SHARE = 0.5


def bin_width_raw(sensor: Sensor, raw: Image16) -> int:
    """Return the width of a histogram bin for a sensor that looks at a scene: its step or noise, whichever is more.

    One raw step for a Kinect; wider for a sensor in mm whose true resolution is coarser than a millimetre.
    """
    readings = raw[raw != sensor.invalid]
    if sensor.unit == "shift" or not readings.size:
        return 1
    step_mm = sensor.step_mm[int(np.median(readings))]
    return max(1, round(max(float(step_mm), sensor.noise)))


class Calibration:
    """A calibration under way: feed it frames with :meth:`add` until it is :attr:`complete`.

    The snapshot that deviations are counted from is each pixel's first reading. Where later readings outvote it
    (something stood there at first), the pixel starts anew: a majority vote that needs no stored frames.
    Memory: 21 counters of 16 bits a pixel.
    """

    def __init__(self, sensor: Sensor, settings: CalibrationSettings, made_from: str) -> None:
        width, height = sensor.size
        self._sensor = sensor
        self._settings = settings
        self._made_from = made_from
        self._bin_width = 1
        self._frames = 0
        self._snapshot = np.zeros((height, width), np.int32)
        self._counts = np.zeros((2 * BINS_EACH_SIDE + 1, height, width), np.uint16)
        self._votes = np.zeros((height, width), np.int32)
        self._outside = np.zeros((height, width), np.uint16)
        self._moving = np.zeros((height, width), np.bool_)

    @property
    def why(self) -> str:
        """How far it is."""
        return f"frame {self._frames} of {self._settings.frames}"

    @property
    def frames(self) -> int:
        """How many frames were added so far."""
        return self._frames

    @property
    def moving(self) -> Mask:
        """The pixels (H, W) whose reading in the last frame lay outside their histogram."""
        return self._moving

    @property
    def complete(self) -> bool:
        """Whether all frames that the settings ask for were added."""
        return self._frames >= self._settings.frames

    def add(self, raw: Image16) -> None:
        """Count one frame (H, W) uint16. Raises CalibrationError for a picture of another size."""
        if raw.shape != self._snapshot.shape:
            raise CalibrationError(
                f"calibration: a frame of {raw.shape[1]}x{raw.shape[0]} px came from a camera of "
                f"{self._sensor.size[0]}x{self._sensor.size[1]} px; check the source"
            )
        if self._frames == 0:
            self._bin_width = bin_width_raw(self._sensor, raw)
        self._frames += 1
        readable = np.isfinite(self._sensor.to_mm[raw])
        new = readable & (self._votes == 0) & (self._counts[BINS_EACH_SIDE] == 0)
        self._snapshot[new] = raw[new]
        bins = self._bin_of(raw)
        outside = readable & (np.abs(bins) > BINS_EACH_SIDE)
        inside = readable & ~outside
        self._votes += inside
        self._votes -= outside
        self._outside += outside
        self._moving = outside
        self._restart(self._votes < 0, raw, bins)
        bins[~readable] = BINS_EACH_SIDE + 1
        for index, counts in enumerate(self._counts):
            np.add(counts, bins == index - BINS_EACH_SIDE, out=counts)

    def _bin_of(self, raw: Image16) -> NDArray[np.int32]:
        deviation = raw.astype(np.int32) - self._snapshot
        if self._bin_width == 1:
            return deviation
        return (deviation + self._bin_width // 2) // np.int32(self._bin_width)

    def _restart(self, outvoted: NDArray[np.bool_], raw: Image16, bins: NDArray[np.int32]) -> None:
        if not outvoted.any():
            return
        self._counts[:, outvoted] = 0
        self._snapshot[outvoted] = raw[outvoted]
        self._votes[outvoted] = 1
        bins[outvoted] = 0

    @property
    def surface(self) -> Surface | None:
        """The surface, once all frames were added."""
        return self.surface_so_far() if self.complete else None

    @property
    def gave_up(self) -> bool:
        """Never: it takes the frames as they come."""
        return False

    def take(self, frame: Frame) -> None:
        """Count one frame. Raises CalibrationError for a picture of another size."""
        self.add(frame.raw)

    def surface_so_far(self) -> Surface:
        """Return the surface as the frames so far show it. Raises CalibrationError if there were none."""
        if self._frames == 0:
            raise CalibrationError("calibration: no frame was seen; check the source")
        total = self._counts.sum(axis=0, dtype=np.int32)
        mean, deviation = self._moments(total)
        least = max(1, round(self._settings.min_share * self._frames))
        weighty = self._counts > least
        first = weighty.argmax(axis=0).astype(np.int32) - BINS_EACH_SIDE
        nearest = self._snapshot + first * self._bin_width - self._bin_width // 2
        moved = self._outside > np.maximum(MOVED_SHARE * self._frames, 1)
        seen = (total >= READING_SHARE * self._frames) & weighty.any(axis=0)
        return Surface(
            sensor=self._sensor,
            reference=frozen_array((self._snapshot + mean * self._bin_width).astype(np.float32)),
            dmax=frozen_array(np.clip(nearest, 0, 65535).astype(np.uint16)),
            noise=frozen_array((deviation * self._bin_width).astype(np.float32)),
            valid=frozen_array(seen & ~moved),
            moved=frozen_array(moved),
            frames=self._frames,
            made_from=self._made_from,
        )

    def _moments(self, total: NDArray[np.int32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        mean = np.zeros(total.shape, np.float32)
        square = np.zeros(total.shape, np.float32)
        for index, counts in enumerate(self._counts):
            offset = np.float32(index - BINS_EACH_SIDE)
            mean += offset * counts
            square += offset * offset * counts
        many = np.maximum(total, 1).astype(np.float32)
        mean /= many
        return mean, np.sqrt(np.maximum(square / many - mean * mean, 0.0))
