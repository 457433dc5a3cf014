"""What was seen of each finger before: its pitch and thickness hardly change from frame to frame."""

import numpy as np

from touchd.contacts.fit import PRIOR_MEAN, PRIOR_TRUST
from touchd.model import Floats

_FARTHEST_MM = 35.0  # that a finger moves in a frame
# Of pitch and radius: the standard deviation given that of the frame before, and how much of the way back to any
# finger's an estimate goes in each frame, so that no error feeds itself for long.
_SD = (0.12, 0.5)
_FORGOTTEN = (0.1, 0.25)


class Memory:
    """Remembers the shapes of one frame's fingertips for the next."""

    def __init__(self) -> None:
        self._centres_px = np.zeros((0, 2), np.float32)
        self._shape = np.zeros((0, 3), np.float32)

    def keep(self, centres_px: Floats, shape: Floats) -> None:
        """Remember fingertips: where their balls' centres are seen (N, 2), and their shapes (N, 3)."""
        self._centres_px, self._shape = centres_px, shape

    def recall(self, centres_px: Floats, pixel_mm: float) -> tuple[Floats, Floats]:
        """Return the shapes (N, 3) that fingertips at some places should have, and how far to trust that (N, 3).

        The clearance is never remembered: it may change within a frame.
        """
        likely = np.tile(PRIOR_MEAN, (len(centres_px), 1))
        trust = np.tile(PRIOR_TRUST, (len(centres_px), 1))
        if len(self._shape) and len(centres_px):
            apart = centres_px[:, None] - self._centres_px[None]
            distance = np.hypot(apart[..., 0], apart[..., 1])
            nearest = np.argmin(distance, axis=1)
            known = distance[np.arange(len(nearest)), nearest] < _FARTHEST_MM / pixel_mm
            for column, sd, forgotten in zip((0, 2), _SD, _FORGOTTEN, strict=True):
                remembered = self._shape[nearest[known], column]
                likely[known, column] = remembered + forgotten * (PRIOR_MEAN[column] - remembered)
                trust[known, column] = sd**-2
        return likely, trust
