"""Random pictures whose neighbouring pixels go together as those of a real sensor do, and a bank of them.

A picture is white noise with its spectrum multiplied by the root of the wanted correlation's own spectrum.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats

_BANK_MARGIN_PX = 64


@dataclass(frozen=True, slots=True)
class Correlation:
    """How alike two pixels at a distance r are: (1 - nugget)·(mix·exp(-r/reach) + (1 - mix)·exp(-(r/width)²)).

    ``nugget`` is the part of the variance that each pixel has to itself. Both terms have a spectrum without
    negative parts, so that every choice of numbers is one that noise can have.
    """

    nugget: float
    mix: float
    reach_px: float
    width_px: float

    def at(self, distance_px: Doubles) -> Doubles:
        """Return the correlation at distances of any shape; 1 at distance 0."""
        exponential = self.mix * np.exp(-distance_px / self.reach_px)
        bell = (1.0 - self.mix) * np.exp(-((distance_px / self.width_px) ** 2))
        shared: Doubles = (1.0 - self.nugget) * (exponential + bell)
        return np.where(distance_px == 0.0, 1.0, shared)


def correlated_noise(
    correlation: Correlation, shape: tuple[int, int], rng: np.random.Generator
) -> Callable[[], Floats]:
    """Return a maker of (H, W) pictures of noise of unit variance; they wrap around at their borders."""
    rows = np.minimum(np.arange(shape[0]), shape[0] - np.arange(shape[0]))
    columns = np.minimum(np.arange(shape[1]), shape[1] - np.arange(shape[1]))
    spectrum = np.fft.rfft2(correlation.at(np.hypot(rows[:, None], columns[None, :]))).real
    gain = np.sqrt(np.maximum(spectrum, 0.0)).astype(np.float32)

    def picture() -> Floats:
        white = rng.standard_normal(shape, np.float32)
        out: Floats = np.fft.irfft2(np.fft.rfft2(white) * gain, s=shape).astype(np.float32)
        return out

    return picture


class NoiseBank:
    """Pictures of noise made once, from which every frame gets a cut-out of its own, flipped at random."""

    def __init__(
        self, correlation: Correlation, size: tuple[int, int], pictures: int, rng: np.random.Generator
    ) -> None:
        self._size = size
        shape = (size[1] + _BANK_MARGIN_PX, size[0] + _BANK_MARGIN_PX)
        make = correlated_noise(correlation, shape, rng)
        self._bank = [make() for _ in range(pictures)]

    def draw(self, rng: np.random.Generator) -> Floats:
        """Return a (H, W) view of unit variance; it belongs to the bank and must not be changed."""
        which, top, left, flips = rng.integers([len(self._bank), _BANK_MARGIN_PX, _BANK_MARGIN_PX, 4]).tolist()
        width, height = self._size
        cut = self._bank[which][top : top + height, left : left + width]
        view: Floats = cut[:: -1 if flips & 1 else 1, :: -1 if flips & 2 else 1]
        return view
