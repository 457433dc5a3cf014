"""A stereo camera (RealSense type): depth in whole millimetres with Gaussian noise.

Measured on such a camera over a table at 0.5 to 0.9 m: temporal standard deviation 1.1 mm (median), Gaussian; a plane
ripples by 2.5 mm; 0.08 % of the readings are invalid. Both errors grow with the square of the distance, as
triangulation's do. The ripple is bound to the picture. How noise goes together in space was not measured: the
window's size is taken for it.
"""

from dataclasses import dataclass

import numpy as np

from touchd.geometry import millimetre_sensor
from touchd.model import Floats, Image16, Intrinsics, Sensor
from touchd.table.backdrop import Backdrop
from touchd.table.correlator import Window
from touchd.table.matcher import BlockMatcher, ShiftLaw, dot_weights
from touchd.table.misreading import Misreading
from touchd.table.noise import Correlation, NoiseBank, correlated_noise
from touchd.table.render import DepthPicture

_MEASURED_AT_MM = 700.0  # the middle of the measured distances
_WINDOW = Window(size_px=7, bump_raw=5.0, near_weight=1.4)
_NOISE_CORRELATION = Correlation(0.1, 0.3, 1.5, 3.0)
_RIPPLE_CORRELATION = Correlation(0.02, 0.3, 8.0, 14.0)


@dataclass(frozen=True, slots=True)
class StereoModel:
    """The measured figures at 0.7 m; change them to ask what another camera would do."""

    window: Window = _WINDOW
    noise_mm: float = 1.1
    noise_spread: float = 0.25  # standard deviation of its logarithm over the pixels
    ripple_mm: float = 2.5
    noise_correlation: Correlation = _NOISE_CORRELATION
    ripple_correlation: Correlation = _RIPPLE_CORRELATION
    dot_contrast: float = 0.8
    lost_share: float = 0.0008
    baseline_mm: float = 50.0
    nearest_mm: float = 280.0
    farthest_mm: float = 6000.0
    bank_pictures: int = 16


def stereo_sensor(intrinsics: Intrinsics, size: tuple[int, int], model: StereoModel | None = None) -> Sensor:
    """Return the Sensor of the camera: millimetres, its noise as at the distance where it was measured."""
    return millimetre_sensor("stereo", size, intrinsics, (model or StereoModel()).noise_mm)


class Stereo:
    """Reads depth pictures of one table as one particular camera would."""

    def __init__(self, sensor: Sensor, empty: Backdrop, model: StereoModel, rng: np.random.Generator) -> None:
        self._model = model
        width, height = sensor.size
        shape = (height, width)
        self._law = ShiftLaw(0.0, 8.0 * sensor.intrinsics.fx * model.baseline_mm)
        self._ripple = correlated_noise(model.ripple_correlation, shape, rng)() * np.float32(model.ripple_mm)
        self._matcher = BlockMatcher(self._law, empty, model.window, dot_weights(model.dot_contrast, shape, rng))
        spread = model.noise_spread * rng.standard_normal(shape, np.float32)
        self._noise = np.float32(model.noise_mm) * np.exp(spread)
        self._bank = NoiseBank(model.noise_correlation, sensor.size, model.bank_pictures, rng)
        self._luck = self._bank.draw(rng)
        self._empty = self._matcher.empty()
        self._still = self._law.depth_mm(self._empty.raw)
        self._still_growth = _growth(self._still)

    def read(self, picture: DepthPicture, rng: np.random.Generator, wrong: Misreading) -> Image16:
        """Return the picture (H, W) in mm that the camera delivers of true depth, with new noise; 0: no reading."""
        exact, growth = self._still.copy(), self._still_growth.copy()
        luck = self._bank.draw(rng)
        lost = self._empty.lost_now(self._luck, luck)
        for found in self._matcher.changes(picture):
            window = found.box.window
            exact[window] = self._law.depth_mm(found.raw)
            growth[window] = _growth(exact[window])
            lost[window] = found.lost_now(self._luck, luck)
        error = self._noise * self._bank.draw(rng)
        error += self._ripple
        error *= growth
        exact += error
        wrong.spoil(exact, lost, self._luck, luck)
        lost |= (exact < self._model.nearest_mm) | (exact > self._model.farthest_mm)
        np.rint(exact, out=exact)
        exact[lost] = 0.0
        raw: Image16 = exact.astype(np.uint16)
        anywhere = rng.integers(raw.size, size=rng.binomial(raw.size, self._model.lost_share))
        raw.ravel()[anywhere] = 0
        return raw


def _growth(depth_mm: Floats) -> Floats:
    """Return by how much errors are larger than where they were measured."""
    shares = depth_mm * np.float32(1.0 / _MEASURED_AT_MM)
    grown: Floats = np.minimum(shares * shares, np.float32(100.0))
    return grown
