"""What was seen of each finger before: its pitch and thickness hardly change from frame to frame, nor where it ends."""

import numpy as np

from touchd.contacts.fit import ANGLE, PITCH, PRIOR_MEAN, PRIOR_TRUST, RADIUS
from touchd.model import Floats

_FARTHEST_MM = 35.0  # that a finger moves in a frame
# Of pitch and radius: the standard deviation given that of the frame before, and how much of the way back to any
# finger's an estimate goes in each frame, so that no error feeds itself for long.
_REMEMBERED = [PITCH, RADIUS]
_TRUST = np.array([0.12, 0.5], np.float32) ** -2
_FORGOTTEN = np.array([0.1, 0.25], np.float32)
_ANY = PRIOR_MEAN[[0, 2]]


class Memory:
    """Remembers one frame's fingertips for the next: where their fits began and ended."""

    def __init__(self) -> None:
        self._began = np.zeros((0, 6), np.float32)
        self._ended = self._began

    def keep(self, began: Floats, ended: Floats) -> None:
        """Remember fits: the first guesses (N, 6) and what came out of them (N, 6), in px of the whole picture."""
        self._began, self._ended = began, ended

    def recall(self, began: Floats, pixel_mm: float) -> tuple[Floats, Floats, Floats]:
        """Return where to begin instead of first guesses, what is likely, and how far to trust it: (N, 6) each.

        A fit begins as far from its guess as the same finger's ended from its own. Only pitch and radius are trusted;
        the clearance may change within a frame.
        """
        likely = began.copy()
        likely[:, PITCH:] = PRIOR_MEAN
        trust = np.tile(PRIOR_TRUST, (len(began), 1))
        known, seen = self._nearest(began, (_FARTHEST_MM / pixel_mm) ** 2)
        if not known:
            return began, likely, trust
        moved = self._ended[seen] - self._began[seen]
        moved[:, ANGLE] = (moved[:, ANGLE] + np.pi) % (2.0 * np.pi) - np.pi
        start = began.copy()
        start[known] += moved
        remembered = self._ended[seen][:, _REMEMBERED]
        rows = np.array(known)[:, None]
        start[rows, _REMEMBERED] = likely[rows, _REMEMBERED] = remembered + _FORGOTTEN * (_ANY - remembered)
        trust[rows, _REMEMBERED] = _TRUST
        return start, likely, trust

    def _nearest(self, began: Floats, limit: float) -> tuple[list[int], list[int]]:
        """Return which guesses have a remembered one near them, and which one is nearest."""
        known, seen = [], []
        places = self._began[:, :2].tolist()
        if places:
            for i, (u, v) in enumerate(began[:, :2].tolist()):
                distance, nearest = min(((u - x) ** 2 + (v - y) ** 2, k) for k, (x, y) in enumerate(places))
                if distance < limit:
                    known.append(i)
                    seen.append(nearest)
        return known, seen
