"""A Kinect v1: true depth in, raw 11-bit shift out, with the errors that were measured on real ones.

The figures were measured on two real recordings of still scenes (150 frames at 1.17 m). A reading is
round(true shift + fixed pattern + noise). The fixed pattern belongs to the projected dots and so wanders over
surfaces as their distance changes.
"""

from dataclasses import dataclass
from math import log1p, sqrt

import cv2
import numpy as np

from touchd.model import Floats, Image16, Mask, Sensor, frozen_array
from touchd.table.boxes import Box, apart
from touchd.table.correlator import Correlator, Window, shadow
from touchd.table.noise import Correlation, NoiseBank, correlated_noise
from touchd.table.render import DepthPicture

RAW_PER_PX = 8.0  # a raw step is an eighth of a pixel of disparity
_BLIND_COLUMNS = 8  # at the right end of each row, where the window runs out of stored picture
_OUTLINE_STEP_RAW = 12.0  # outlines lower than this lose no readings
_SHADOW_MM = 250.0  # what is nearer to the camera than this throws no longer shadow; arms do not come here
_NEIGHBOURS = np.ones((3, 3), np.uint8)
# Chance of no reading 1, 2, ... px inside an outline's near side.
_LOST_INSIDE = (0.23, 0.065, 0.034, 0.02, 0.012)
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

    def __init__(self, sensor: Sensor, table_mm: Floats, model: KinectModel, rng: np.random.Generator) -> None:
        self._sensor = sensor
        self._model = model
        self._correlator = Correlator(model.window)
        self._at_infinity, self._per_inverse_mm = _shift_law(sensor)
        width, height = sensor.size
        shape = (height, width)
        self._u = np.broadcast_to(np.arange(width, dtype=np.float32), shape)
        self._v = np.ascontiguousarray(np.broadcast_to(np.arange(height, dtype=np.float32)[:, None], shape))
        pattern = correlated_noise(model.pattern_correlation, shape, rng)()
        self._pattern = pattern * np.float32(model.pattern_raw)
        self._dots = _dot_weights(model.dot_contrast, shape, rng)
        spread = model.noise_spread * rng.standard_normal(shape, np.float32)
        self._noise = np.float32(model.noise_raw) * np.exp(spread)
        self._bank = NoiseBank(model.noise_correlation, sensor.size, model.bank_pictures, rng)
        limits = self.raw_of_depth(np.array([model.nearest_mm, model.farthest_mm], np.float32))
        self._nearest_raw, self._farthest_raw = limits.tolist()
        self._table_raw = frozen_array(self.raw_of_depth(table_mm))
        self._still = self._table_raw + self._pattern_at(self._table_raw, Box(0, 0, width, height))

    def raw_of_depth(self, depth_mm: Floats) -> Floats:
        """Return the fractional raw value of depths in mm: raw = a - b/Z, the sensor's own law."""
        raw: Floats = np.float32(self._at_infinity) - np.float32(self._per_inverse_mm) / depth_mm
        return raw

    def read(self, picture: DepthPicture, rng: np.random.Generator) -> Image16:
        """Return the raw picture (H, W) that the sensor delivers of true depth, with new noise."""
        exact = self._still.copy()
        lost = np.zeros(exact.shape, np.bool_)
        for box in self._busy(picture):
            self._read_box(picture, box, exact, lost, rng)
        exact += self._noise * self._bank.draw(rng)
        lost |= exact < self._nearest_raw
        lost |= exact > self._farthest_raw
        np.rint(exact, out=exact)
        np.clip(exact, 0, self._sensor.invalid, out=exact)
        raw: Image16 = exact.astype(np.uint16)
        raw[lost] = self._sensor.invalid
        raw[:, -_BLIND_COLUMNS:] = self._sensor.invalid
        anywhere = rng.integers(raw.size, size=rng.binomial(raw.size, self._model.lost_share))
        raw.ravel()[anywhere] = self._sensor.invalid
        return raw

    def _busy(self, picture: DepthPicture) -> list[Box]:
        """Return boxes that do not meet, around all hands, their shadows and their grown outlines."""
        if not picture.seen:
            return []
        around = self._model.window.size_px // 2 + 1
        boxes = [seen.box for seen in picture.seen]
        edges = np.array([(box.left, box.top, box.right - 1, box.bottom - 1) for box in boxes])
        table = self._table_raw[edges[:, [1, 1, 3, 3]], edges[:, [0, 2, 0, 2]]].max(1)
        nearest_mm = np.array([max(seen.nearest_mm, _SHADOW_MM) for seen in picture.seen], np.float32)
        reaches = ((table - self.raw_of_depth(nearest_mm)) / RAW_PER_PX).astype(int) + 1
        grown = (
            box.grown(reach, around, self._sensor.size) for box, reach in zip(boxes, reaches.tolist(), strict=True)
        )
        return apart(grown)

    def _read_box(self, picture: DepthPicture, box: Box, exact: Floats, lost: Mask, rng: np.random.Generator) -> None:
        window = box.window
        true_raw = self.raw_of_depth(picture.depth_mm[window])
        table_raw = self._table_raw[window]
        rise_raw = table_raw - true_raw
        columns = true_raw * np.float32(1.0 / RAW_PER_PX)
        columns += self._u[window]
        lit = ~shadow(columns, int(rise_raw.max() / RAW_PER_PX) + 1)
        matched = self._correlator.match(rise_raw, self._dots[window] * lit)
        seen_raw = table_raw - matched.rise_raw
        exact[window] = seen_raw + self._pattern_at(seen_raw, box)
        lost[window] = matched.lost | _lost_at_outlines(matched.rise_raw, rng)

    def _pattern_at(self, raw: Floats, box: Box) -> Floats:
        """Return the fixed pattern on a surface: that of the dots that light it."""
        window = box.window
        columns = raw * np.float32(1.0 / RAW_PER_PX)
        columns += self._u[window]
        out = np.empty_like(columns)
        rows = self._v[window]
        cv2.remap(self._pattern, columns, rows, cv2.INTER_LINEAR, dst=out, borderMode=cv2.BORDER_WRAP)
        return out


def _shift_law(sensor: Sensor) -> tuple[float, float]:
    """Return a and b of raw = a - b/Z, from two far apart entries of the sensor's table."""
    known = np.flatnonzero(np.isfinite(sensor.to_mm))
    low, high = int(known[0]), int(known[len(known) // 2])
    inverse_low, inverse_high = 1.0 / float(sensor.to_mm[low]), 1.0 / float(sensor.to_mm[high])
    per_inverse_mm = (high - low) / (inverse_low - inverse_high)
    return low + per_inverse_mm * inverse_low, per_inverse_mm


def _dot_weights(contrast: float, shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Return log-normal weights of mean 1 and the given standard deviation."""
    spread = sqrt(log1p(contrast * contrast))
    weights: Floats = np.exp(spread * rng.standard_normal(shape, np.float32) - 0.5 * spread * spread)
    return weights


def _lost_at_outlines(rise_raw: Floats, rng: np.random.Generator) -> Mask:
    """Return which readings of this frame get lost just inside the near side of high outlines."""
    reach = len(_LOST_INSIDE)
    outline = (rise_raw - cv2.erode(rise_raw, _NEIGHBOURS) > _OUTLINE_STEP_RAW).astype(np.uint8)
    close = outline.copy()
    for _ in range(reach - 1):
        cv2.dilate(outline, _NEIGHBOURS, dst=outline)
        close += outline
    above = cv2.dilate(rise_raw, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) - rise_raw
    near = np.flatnonzero((close > 0) & (above < _OUTLINE_STEP_RAW))
    chances = np.array((0.0, *reversed(_LOST_INSIDE)), np.float32)[close.ravel()[near]]
    lost = np.zeros(rise_raw.shape, np.bool_)
    lost.ravel()[near[rng.random(near.size, np.float32) < chances]] = True
    return lost
