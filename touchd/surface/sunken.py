"""Places that read farther than the surface, for so long that no hand can be why: what was learned there is gone."""

import cv2
import numpy as np

from touchd.geometry import SurfaceMap
from touchd.model import COARSE_PX, CoarsePicture, Mask, Surface
from touchd.surface.sight import COARSER, thing_mm

_GONE_S = 4.0
_CELL_PX = 2 * COARSE_PX
_CHUNK, _AROUND = np.ones((3, 3), np.uint8), np.ones((5, 5), np.uint8)


class Sunken:
    """Watches one surface for what was taken away that lay on it when it was learned."""

    def __init__(self, surface: Surface, surface_map: SurfaceMap) -> None:
        self._shape = surface.valid.shape
        self._below_mm = -thing_mm(surface, surface_map)
        self._highest_mm = float(self._below_mm.max(initial=-np.inf))
        self._seconds = np.zeros(self._below_mm.shape, np.float32)

    def step(self, coarse: CoarsePicture, seconds: float) -> Mask | None:
        """Return where (H, W) the surface is to be learned from what is seen; None for nowhere, as it mostly is.

        ``seconds`` have passed since the last picture.
        """
        heights = coarse.heights_mm[COARSER]
        if heights.min(initial=0.0) > self._highest_mm:
            return None
        low = np.less(heights, self._below_mm)
        self._seconds += np.float32(seconds)
        self._seconds *= low
        chunk = cv2.erode(np.greater(self._seconds, _GONE_S).view(np.uint8), _CHUNK)
        if not chunk.any():
            return None
        gone = np.greater(cv2.dilate(chunk, _AROUND), 0) & low
        self._seconds[gone] = -_GONE_S  # it takes a while to be learned
        mask = np.zeros(self._shape, np.bool_)
        cells = np.kron(gone, np.ones((_CELL_PX, _CELL_PX), np.bool_))[: self._shape[0], : self._shape[1]]
        mask[: cells.shape[0], : cells.shape[1]] = cells
        return mask
