"""Where fits begin: at the ends of outlines, and where a touch was expected that has no end near it."""

from bisect import bisect_left
from collections.abc import Sequence

import cv2
import numpy as np

from touchd.contacts.candidates import Ends
from touchd.contacts.heights import Box, Heights, as_floats
from touchd.contacts.method import Expected, Place
from touchd.contacts.neighbours import distinct, paired
from touchd.contacts.tips import Guess
from touchd.geometry import AreaMap, distort_pixel
from touchd.model import Floats

# A steep finger covers its own tip. What stands higher is hardly one near the surface, unless it was and touched.
_HIGHEST_MM, _HIGHEST_LIVE_MM = 75.0, 110.0
_RADIUS_MM = 6.3  # of an ordinary finger
_THICK_MM = 13.0
_BEHIND_MM, _RISES_MM = 6.0, 5.0  # a finger rises by this much over that way
_TALLEST_CLEARANCE_MM = 40.0
_RING_MM = 8.0
_RING = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], 1).astype(np.float32)
# Four spread hands have up to 60 ends and 41 guesses, and eight fit around a table. Pictures full of noise have
# hundreds, and every one of them takes time.
_MOST_ENDS, _MOST_GUESSES = 200, 96
_OWN_MM = 35.0  # an end so near may be that of an expected touch, if it is no other's


class Starts:
    """Turns places of the picture into first guesses of fingertips, over one surface."""

    def __init__(self, heights: Heights, place: Place, ahead_px: Sequence[float], pixel_mm: float) -> None:
        """``ahead_px`` (levels,): where along a finger the outline at each level lies, from the ball's centre."""
        self._heights = heights
        self._intrinsics = place.surface.sensor.intrinsics
        self._ahead_px = np.array(ahead_px, np.float32)
        self._pixel_mm = pixel_mm
        self.relocate(place.area)

    def relocate(self, area: AreaMap) -> None:
        """Take the area to lie so from now on."""
        self._size_mm = area.size_mm
        self._to_ideal: list[list[float]] = np.linalg.inv(np.array(area.to_area)).tolist()

    def guesses(
        self, ends: Ends, expected: Sequence[Expected], smooth: Floats, box: Box, apart_px: float
    ) -> list[Guess]:
        """Return first guesses, of which no two that the picture shows are nearer than ``apart_px``.

        ``smooth`` (H, W) are the heights in mm of the box, in which the ends are given. However many there are, only
        the 96 best guesses that the picture shows are made.
        """
        centres = (ends.points - ends.back * self._ahead_px[ends.level, None]).tolist()
        kept = distinct(centres, ends.rank.tolist(), apart_px, _MOST_ENDS)
        places, backs = [centres[i] for i in kept], ends.back[kept].tolist()
        shown = len(places)
        wanted = [self._wanted_px(x_mm, y_mm, box) for x_mm, y_mm in expected]
        pairs = paired(wanted, places, _OWN_MM / self._pixel_mm)
        missing = [place for i, place in enumerate(wanted) if i not in pairs]
        if missing:
            places, backs = places + missing, backs + self._uphill(missing, smooth)
        live = {*pairs.values(), *range(shown, len(places))}
        near = [
            (i, tall_mm)
            for i, tall_mm in enumerate(self._tall_mm(places, backs, smooth))
            if 0.0 < tall_mm < (_HIGHEST_LIVE_MM if i in live else _HIGHEST_MM)
        ]
        begins = bisect_left(near, (shown,))  # of those that only were expected
        return [
            self._guess(places[i], backs[i], tall_mm, box, i < shown)
            for i, tall_mm in near[: min(begins, _MOST_GUESSES)] + near[begins:]
        ]

    def _guess(self, place: list[float], back: list[float], tall_mm: float, box: Box, shown: bool) -> Guess:
        u, v = place[0] + box.left, place[1] + box.top
        lay = self._heights.lay(u, v)
        clearance_mm = min(max(tall_mm - _THICK_MM, 0.0), _TALLEST_CLEARANCE_MM)
        return Guess(u, v, lay.angle_of(*back), clearance_mm, shown, lay)

    def _tall_mm(self, places: list[list[float]], backs: list[list[float]], smooth: Floats) -> list[float]:
        """Return how high it stands at places, or a little behind them less than fingers rise over that way."""
        if not places:
            return []
        far = _BEHIND_MM / self._pixel_mm
        behind = [(u + x * far, v + y * far) for (u, v), (x, y) in zip(places, backs, strict=True)]
        seen: list[list[float]] = _sampled(smooth, np.array([places, behind], np.float32)).tolist()
        return [max(here, back - _RISES_MM) for here, back in zip(*seen, strict=True)]

    def place_px(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Return where in the picture a place of the area is seen."""
        x, y = x_mm / self._size_mm[0], y_mm / self._size_mm[1]
        u, v, scale = (a * x + b * y + c for a, b, c in self._to_ideal)
        return distort_pixel(self._intrinsics, u / scale, v / scale)

    def _wanted_px(self, x_mm: float, y_mm: float, box: Box) -> list[float]:
        """Return where in the box the ball's centre of an expected touch should be seen."""
        u, v = self.place_px(x_mm, y_mm)
        lay = self._heights.lay(u, v)
        return [u + lay.u_by_z * _RADIUS_MM - box.left, v + lay.v_by_z * _RADIUS_MM - box.top]

    def _uphill(self, places: list[list[float]], smooth: Floats) -> list[list[float]]:
        """Return unit vectors towards where the heights around rise: the way back along a finger."""
        ring = np.array(places, np.float32)[:, None] + _RING * np.float32(_RING_MM / self._pixel_mm)
        rise = _sampled(smooth, ring) @ _RING
        uphill: list[list[float]] = (rise / (np.hypot(rise[:, :1], rise[:, 1:]) + np.float32(1e-6))).tolist()
        return uphill


def _sampled(heights: Floats, pixels: Floats) -> Floats:
    """Return heights (M, N) at pixels (M, N, 2)."""
    seen = cv2.remap(heights, pixels, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)  # type: ignore[call-overload]
    return as_floats(seen)
