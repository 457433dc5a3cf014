"""Pictures without the things that lie there: contact methods then see the surface, and hands beside it and above."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from touchd.hands.lookout import Lookout
from touchd.hands.thing import Shape
from touchd.model import COARSE_PX, Floats, Image16

_SIDE = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class Patch:
    """A rectangle of the whole picture, and from which reading on (H, W) what is seen there is a thing, not a hand."""

    window: tuple[slice, slice]
    from_raw: Image16


def patch_of(shape: Shape, over_mm: float, lookout: Lookout) -> Patch:
    """Return where a thing is to be cleared away, with its edges; what is ``over_mm`` higher than it is a hand."""
    heights = np.zeros(lookout.shape, np.float32)
    heights.ravel()[shape.footprint] = shape.heights_mm + np.float32(over_mm)
    levels = np.asarray(cv2.dilate(heights, _SIDE), np.float32)
    rows, columns = np.flatnonzero(levels.any(axis=1)), np.flatnonzero(levels.any(axis=0))
    window = slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
    from_raw = lookout.raw_at(levels)[window]
    # No reading is as far as this, so that nothing is cleared beside the thing.
    coarse = np.where((levels[window] > 0.0) & np.isfinite(from_raw), np.ceil(from_raw), np.float32(65535.0))
    whole = np.asarray(coarse, np.uint16).repeat(COARSE_PX, axis=0).repeat(COARSE_PX, axis=1)
    top, left = COARSE_PX * window[0].start, COARSE_PX * window[1].start
    return Patch((slice(top, top + whole.shape[0]), slice(left, left + whole.shape[1])), whole)


def cleared(raw: Image16, reference: Floats, patches: Sequence[Patch]) -> Image16:
    """Return a picture (H, W) in which the surface, which reads ``reference`` (H, W), is seen in the things' stead."""
    if not patches:
        return raw
    picture = raw.copy()
    for patch in patches:
        seen = picture[patch.window]
        surface = np.rint(reference[patch.window]).astype(np.uint16)
        np.copyto(seen, surface, where=seen >= patch.from_raw[: seen.shape[0], : seen.shape[1]])
    return picture
