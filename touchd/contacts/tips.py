"""Fingertips under way: what is fitted of each, in plain numbers, as there are few of them."""

from dataclasses import dataclass
from math import atan, cos, sin
from typing import NamedTuple

from touchd.contacts.heights import Lay

# What is known of any fingertip before looking, and one over the variances of that.
LIKELY_PITCH_RAD, LIKELY_RADIUS_MM = 0.85, 6.6
PITCH_TRUST, CLEARANCE_TRUST, RADIUS_TRUST = 0.35**-2, 14.0**-2, 0.8**-2


class Guess(NamedTuple):
    """Where a fit may begin.

    ``u``, ``v``: where in the whole picture the ball's centre is seen, in px; ``angle``: of the way back along the
    finger, in the frame of ``lay``, which is how the surface lies there. ``shown``: whether the picture showed it; if
    not, a touch was only expected there.
    """

    u: float
    v: float
    angle: float
    clearance_mm: float
    shown: bool
    lay: Lay


@dataclass(slots=True)
class Tip:
    """A fingertip as far as it is fitted, and what it is likely to be: where a trust is one over a variance."""

    guess: Guess
    u: float
    v: float
    angle: float
    pitch_rad: float
    clearance_mm: float
    radius_mm: float
    likely_pitch_rad: float
    pitch_trust: float
    likely_radius_mm: float
    radius_trust: float

    def copy(self) -> "Tip":
        """Return another one like it; the library's way takes five times as long."""
        return Tip(
            self.guess,
            self.u,
            self.v,
            self.angle,
            self.pitch_rad,
            self.clearance_mm,
            self.radius_mm,
            self.likely_pitch_rad,
            self.pitch_trust,
            self.likely_radius_mm,
            self.radius_trust,
        )

    @property
    def lean(self) -> float:
        """How far (mm) along the finger what is higher by 1 mm is seen."""
        lay = self.guess.lay
        return lay.x_by_z * cos(self.angle) + lay.y_by_z * sin(self.angle)

    @property
    def seen_pitch_rad(self) -> float:
        """Its pitch towards the camera's way of looking."""
        return self.pitch_rad - atan(self.lean)

    @property
    def under_px(self) -> tuple[float, float]:
        """Where the surface under the ball's centre is seen, if it is as high as it was fitted."""
        lay, height_mm = self.guess.lay, self.radius_mm + self.clearance_mm
        return self.u - lay.u_by_z * height_mm, self.v - lay.v_by_z * height_mm

    @property
    def foot_px(self) -> tuple[float, float]:
        """Where the surface under the ball's centre is seen, if it rests."""
        lay = self.guess.lay
        return self.u - lay.u_by_z * self.radius_mm, self.v - lay.v_by_z * self.radius_mm
