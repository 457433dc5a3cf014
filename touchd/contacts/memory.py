"""What was seen of each finger before: its pitch and thickness hardly change from frame to frame, nor where it ends."""

from collections.abc import Sequence
from math import pi, tau

from touchd.contacts.tips import LIKELY_PITCH_RAD, LIKELY_RADIUS_MM, PITCH_TRUST, RADIUS_TRUST, Guess, Tip

_PITCH_RAD, _RADIUS_MM = 0.8, 6.6  # where the fit of a finger begins that was not seen before
_FARTHEST_MM = 35.0  # that a finger moves in a frame
# One over the variance of pitch and radius given those of the frame before, and how much of the way back to any
# finger's an estimate goes in each frame, so that no error feeds itself for long.
_PITCH_TRUST, _RADIUS_TRUST = 0.1**-2, 0.5**-2
_PITCH_FORGOTTEN, _RADIUS_FORGOTTEN = 0.03, 0.25


class Memory:
    """Remembers one frame's fingertips for the next."""

    def __init__(self) -> None:
        self._seen: Sequence[Tip] = ()

    def keep(self, tips: Sequence[Tip]) -> None:
        """Remember what came out of fits."""
        self._seen = tips

    def begin(self, guess: Guess) -> Tip:
        """Return where to begin a fit: as far from its guess as that of the same finger ended from its own."""
        before = self._same(guess)
        if before is None:
            shape = (_PITCH_RAD, guess.clearance_mm, _RADIUS_MM)
            prior = (LIKELY_PITCH_RAD, PITCH_TRUST, LIKELY_RADIUS_MM, RADIUS_TRUST)
            return Tip(guess, guess.u, guess.v, guess.angle, *shape, *prior)
        then = before.guess
        pitch_rad = before.pitch_rad + _PITCH_FORGOTTEN * (LIKELY_PITCH_RAD - before.pitch_rad)
        radius_mm = before.radius_mm + _RADIUS_FORGOTTEN * (LIKELY_RADIUS_MM - before.radius_mm)
        return Tip(
            guess,
            guess.u + before.u - then.u,
            guess.v + before.v - then.v,
            guess.angle + (before.angle - then.angle + pi) % tau - pi,
            pitch_rad,
            guess.clearance_mm + before.clearance_mm - then.clearance_mm,
            radius_mm,
            pitch_rad,
            _PITCH_TRUST,
            radius_mm,
            _RADIUS_TRUST,
        )

    def _same(self, guess: Guess) -> Tip | None:
        """Return what was the same finger in the last frame."""
        nearest, least = None, (_FARTHEST_MM / guess.lay.pixel_mm) ** 2
        for tip in self._seen:
            distance = (guess.u - tip.guess.u) ** 2 + (guess.v - tip.guess.v) ** 2
            if distance < least:
                nearest, least = tip, distance
        return nearest
