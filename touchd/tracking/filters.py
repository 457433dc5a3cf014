"""The one-euro filter: calm at rest, quick in motion."""

import math
from dataclasses import dataclass

# The speed that steers the cutoff is itself smoothed; at 30 Hz this lets it follow within two frames.
_SPEED_CUTOFF_HZ = 5.0


def smoothing(cutoff_hz: float, dt_s: float) -> float:
    """Return the weight of a new value in an exponential filter with a cutoff, after ``dt_s`` seconds."""
    step = 2.0 * math.pi * cutoff_hz * dt_s
    return step / (step + 1.0)


@dataclass(frozen=True, slots=True)
class OneEuro:
    """A filtered position in mm, its filtered speed in mm/s; :meth:`moved` gives the next one.

    G. Casiez, N. Roussel, D. Vogel, "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive
    Systems", CHI 2012: cutoff = min_cutoff + beta·|speed|. Both axes share the cutoff, so that a straight stroke
    stays straight.
    """

    x_mm: float
    y_mm: float
    vx_mm_s: float = 0.0
    vy_mm_s: float = 0.0

    def moved(self, x_mm: float, y_mm: float, dt_s: float, min_cutoff_hz: float, beta_hz_s_mm: float) -> "OneEuro":
        """Return the filter's state after seeing a position ``dt_s`` > 0 seconds later."""
        weight = smoothing(_SPEED_CUTOFF_HZ, dt_s)
        vx = self.vx_mm_s + weight * ((x_mm - self.x_mm) / dt_s - self.vx_mm_s)
        vy = self.vy_mm_s + weight * ((y_mm - self.y_mm) / dt_s - self.vy_mm_s)
        weight = smoothing(min_cutoff_hz + beta_hz_s_mm * math.hypot(vx, vy), dt_s)
        return OneEuro(self.x_mm + weight * (x_mm - self.x_mm), self.y_mm + weight * (y_mm - self.y_mm), vx, vy)
