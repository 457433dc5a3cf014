"""A Kinect v1: true depth in, raw 11-bit shift out, with the errors that were measured on real ones.

The figures were measured on two real recordings of still scenes (150 frames at 1.17 m). A reading is
round(true shift + fixed pattern + noise). The fixed pattern belongs to the projected dots and so wanders over
surfaces as their distance changes.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from touchd.model import Floats, Image16, Sensor
from touchd.table.backdrop import Backdrop
from touchd.table.boxes import Box
from touchd.table.correlator import Window
from touchd.table.matcher import RAW_PER_PX, BlockMatcher, ShiftLaw, dot_weights
from touchd.table.misreading import Misreading
from touchd.table.noise import Correlation, NoiseBank, correlated_noise
from touchd.table.render import DepthPicture

_BLIND_COLUMNS = 8  # at the right end of each row, where the window runs out of stored picture
_WINDOW = Window()
# .42 .29 .22 .17 .08 at 1 2 3 4 6 px, once the pixels' different spreads have diluted it.
_NOISE_CORRELATION = Correlation(0.059, 0.645, 0.863, 5.51)
# .83 .68 .39 at 1 2 4 px.
_PATTERN_CORRELATION = Correlation(0.034, 0.448, 3.22, 4.78)


@dataclass(frozen=True, slots=True)
class KinectModel:
    """The measured figures, in raw steps; change them to ask what another unit would do."""

    window: Window = _WINDOW
    noise_raw: float = 0.22  # median over the pixels of the standard deviation over time
    noise_spread: float = 0.45  # standard deviation of its logarithm
    noise_correlation: Correlation = _NOISE_CORRELATION
    pattern_raw: float = 0.42
    pattern_correlation: Correlation = _PATTERN_CORRELATION
    dot_contrast: float = 1.2  # standard deviation over mean of the dots' weight: makes outlines uneven
    lost_share: float = 0.0015  # of all readings, anywhere
    nearest_mm: float = 450.0
    farthest_mm: float = 9000.0
    bank_pictures: int = 16


class KinectV1:
    """Reads depth pictures of one table as one particular unit would."""

    def __init__(self, sensor: Sensor, empty: Backdrop, model: KinectModel, rng: np.random.Generator) -> None:
        self._sensor = sensor
        self._model = model
        law = _shift_law(sensor)
        width, height = sensor.size
        shape = (height, width)
        self._u = np.broadcast_to(np.arange(width, dtype=np.float32), shape)
        self._v = np.ascontiguousarray(np.broadcast_to(np.arange(height, dtype=np.float32)[:, None], shape))
        pattern = correlated_noise(model.pattern_correlation, shape, rng)()
        self._pattern = pattern * np.float32(model.pattern_raw)
        self._matcher = BlockMatcher(law, empty, model.window, dot_weights(model.dot_contrast, shape, rng))
        spread = model.noise_spread * rng.standard_normal(shape, np.float32)
        self._noise = np.float32(model.noise_raw) * np.exp(spread)
        self._bank = NoiseBank(model.noise_correlation, sensor.size, model.bank_pictures, rng)
        limits = law.raw(np.array([model.nearest_mm, model.farthest_mm], np.float32))
        self._nearest_raw, self._farthest_raw = limits.tolist()
        self._luck = self._bank.draw(rng)
        self._empty = self._matcher.empty()
        self._still = self._empty.raw + self._pattern_at(self._empty.raw, self._empty.box)
        self.raw_of_depth = law.raw

    def read(self, picture: DepthPicture, rng: np.random.Generator, wrong: Misreading) -> Image16:
        """Return the raw picture (H, W) that the sensor delivers of true depth, with new noise."""
        exact = self._still.copy()
        luck = self._bank.draw(rng)
        lost = self._empty.lost_now(self._luck, luck)
        for found in self._matcher.changes(picture):
            window = found.box.window
            exact[window] = found.raw + self._pattern_at(found.raw, found.box)
            lost[window] = found.lost_now(self._luck, luck)
        exact += self._noise * self._bank.draw(rng)
        wrong.spoil(exact, lost, self._luck, luck)
        lost |= exact < self._nearest_raw
        lost |= exact > self._farthest_raw
        np.rint(exact, out=exact)
        # In one pass each; numpy's clip takes longer.
        np.maximum(exact, np.float32(0.0), out=exact)
        np.minimum(exact, np.float32(self._sensor.invalid), out=exact)
        raw: Image16 = exact.astype(np.uint16)
        np.copyto(raw, self._sensor.invalid, where=lost)
        raw[:, -_BLIND_COLUMNS:] = self._sensor.invalid
        anywhere = rng.integers(raw.size, size=rng.binomial(raw.size, self._model.lost_share))
        raw.ravel()[anywhere] = self._sensor.invalid
        return raw

    def _pattern_at(self, raw: Floats, box: Box) -> Floats:
        """Return the fixed pattern on a surface: that of the dots that light it."""
        window = box.window
        columns = raw * np.float32(1.0 / RAW_PER_PX)
        columns += self._u[window]
        out = np.empty_like(columns)
        rows = self._v[window]
        cv2.remap(self._pattern, columns, rows, cv2.INTER_LINEAR, dst=out, borderMode=cv2.BORDER_WRAP)
        return out


def _shift_law(sensor: Sensor) -> ShiftLaw:
    """Return the law behind the sensor's table, from two far apart entries."""
    known = np.flatnonzero(np.isfinite(sensor.to_mm))
    low, high = int(known[0]), int(known[len(known) // 2])
    inverse_low, inverse_high = 1.0 / float(sensor.to_mm[low]), 1.0 / float(sensor.to_mm[high])
    per_inverse_mm = (high - low) / (inverse_low - inverse_high)
    return ShiftLaw(low + per_inverse_mm * inverse_low, per_inverse_mm)
