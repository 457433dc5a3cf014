"""Places where the surface shows again below what lay on it, however little of that is left there."""

import cv2
import numpy as np

from touchd.model import Floats, Image16, Mask

_TALL_RAW = 2.5  # what is flatter cannot be told from the surface below it by one pixel
_ALIKE_SHARE = 0.35  # of its height: what reads so near to the surface below it, is that
_BARE_S, _EVERY_S = 0.5, 0.2
_AROUND = np.ones((3, 3), np.uint8)


class Bared:
    """Watches the pixels at which coarse pictures are sampled.

    Where a hand was beside a thing that was learned, or a thing was pushed, bits of a layer stay that are no thing:
    too small to be told from the outline of one by their size, but not by what is seen there.
    """

    def __init__(self, readable: Mask, unit_raw: float) -> None:
        """``readable``: for each raw value whether it is a reading. ``unit_raw``: what noise may make of a reading."""
        self._readable = readable
        self._tall_raw = _TALL_RAW * unit_raw
        self._seconds = np.zeros((1, 1), np.float32)
        self._since_s = 0.0

    def step(self, seen: Image16, reference: Floats, by: Floats, tallest: Floats, seconds: float) -> Mask | None:
        """Return where the surface has been seen for long enough without what lies on it; None for nowhere.

        All are (rows, columns): the picture, how the surface reads with all that lies on it, ``by`` how much farther
        for that, and ``tallest`` how much of it there is at most around that pixel. ``seconds`` have passed since the
        last picture. The rim of what still lies there is left.
        """
        told: Mask = self._readable.take(seen, mode="clip") & np.greater(tallest, self._tall_raw)
        bare = told & np.less(np.abs(seen - (reference - by)), np.float32(_ALIKE_SHARE) * tallest)
        self._since_s += seconds
        if not bare.any():
            self._seconds = np.zeros(seen.shape, np.float32)
            return None
        self._seconds = (self._seconds + np.float32(seconds)) * bare
        long = np.greater(self._seconds, _BARE_S)
        if self._since_s < _EVERY_S or not long.any():
            return None
        self._since_s = 0.0
        rim = np.greater(cv2.dilate((told & ~bare).view(np.uint8), _AROUND), 0)
        found: Mask = long & ~rim
        return found if found.any() else None
