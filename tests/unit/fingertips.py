"""Fingertips as a picture shows them, for tests of what is made of them."""

import numpy as np
from touchd.contacts.company import Standing
from touchd.contacts.heights import Lay
from touchd.contacts.judge import Opinion
from touchd.contacts.steady import Seen

PIXEL_MM, STEP_MM = 1.3, 1.6
LAY = Lay(0.77, 0.0, 0.0, 0.77, 0.0, 0.0, 0.0, 0.0, PIXEL_MM, STEP_MM)
IMPRESSION = np.zeros(64, np.float32)


def seen_at(u: float, v: float, odds: float = 1.0, clearance_mm: float = 4.0, finger_odds: float = 3.0) -> Seen:
    """A fingertip at a pixel, of which the picture and the average say the same."""
    opinion = Opinion(odds, finger_odds, clearance_mm, 0.0, 0.0, IMPRESSION)
    return Seen(u, v, u + 1.0, v + 1.0, 3.1, 6.5, clearance_mm, odds, finger_odds, shown=True, lay=LAY, opinion=opinion)


def standing_at(
    x_mm: float, y_mm: float, odds: float = 1.0, clearance_mm: float = 4.0, finger_odds: float = 3.0
) -> Standing:
    """The same at a place of the area, pointing along x; pixels are ``PIXEL_MM`` wide."""
    seen = seen_at(x_mm / PIXEL_MM, y_mm / PIXEL_MM, odds, clearance_mm, finger_odds)
    return Standing(seen, (x_mm, y_mm), (x_mm, y_mm), (1.0, 0.0))
