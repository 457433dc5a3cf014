"""What makes a sensor read wrongly besides its noise: drift as it warms up, and light that drowns its dots."""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats, Mask, frozen_array

# The same patches stay drowned from frame to frame, but for their rims; the squares add up to 1.
_LASTING, _PASSING = np.float32(0.94), np.float32(0.341)
_MOST_SHARE = 0.9999


@dataclass(frozen=True, slots=True)
class Misreading:
    """How a frame is read wrongly.

    ``off`` (H, W) in the sensor's unit is added to every reading; None: nothing. ``drowned`` is the share of pixels, in
    patches, of which nothing can be read.
    """

    off: Floats | None = None
    drowned: float = 0.0

    def spoil(self, exact: Floats, lost: Mask, luck: Floats, luck_now: Floats) -> None:
        """Change readings that are not rounded yet (H, W), and where there are none.

        ``luck`` and ``luck_now`` (H, W) are noise of unit variance, the unit's own and the frame's.
        """
        if self.off is not None:
            exact += self.off
        if self.drowned > 0.0:
            limit = np.float32(NormalDist().inv_cdf(min(self.drowned, _MOST_SHARE)))
            lost |= _LASTING * luck + _PASSING * luck_now < limit


TRUE_READING = Misreading()


def uneven(size: tuple[int, int], share: float, rng: np.random.Generator) -> Floats:
    """Return a smooth field (H, W) that is 1 in the mean and differs by at most a share of that, drawn at random."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, size[0]), np.linspace(-1.0, 1.0, size[1]))
    bend: Doubles = sum(
        (factor * term for factor, term in zip(rng.normal(size=5).tolist(), (x, y, x * y, x * x, y * y), strict=True)),
        np.zeros_like(x),
    )
    bend -= bend.mean()
    return frozen_array((1.0 + share * bend / np.abs(bend).max()).astype(np.float32))
