"""The paper's way from a depth picture to contacts: the shell's pixels, low-passed, thresholded, in components."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from cv2.typing import MatLike, Moments

from touchd.contacts.settings import BlobSettings
from touchd.geometry import mm_per_raw
from touchd.model import Floats, Image16, Mask, Shell, Surface, SurfaceRows

# Readings are whole numbers: where the surface is nearer by a fraction of a step, the least of a pixel's readings is a
# whole step nearer once its mean has come so far below the next whole number.
_BELOW_RAW = 0.12


@dataclass(frozen=True, slots=True)
class Blob:
    """A connected group of pixels in the shell, in the picture."""

    u: float  # centroid, px
    v: float
    surface_raw: float  # mean reading of the empty surface under it
    seen_raw: float  # mean reading of what is seen there
    pixels: float
    axis: tuple[float, float]  # unit vector along its long axis, in the picture
    peak: float  # largest share of the low-pass window that lay in the shell, 0..1


class ShellFinder:
    """Finds blobs in the shell over one surface. Pure: the same picture gives the same blobs."""

    def __init__(self, surface: Surface, shell: Shell, settings: BlobSettings, inside: Mask) -> None:
        """``inside`` (H, W): the pixels of the active area with its margin; nothing is looked for elsewhere."""
        usable = (shell.dmax > 0) & inside
        top, bottom, left, right = _bounds(usable)
        self._window = (slice(top, bottom), slice(left, right))
        self._origin = (left, top)
        # cv2.inRange includes its bounds; an empty range where nothing may be found.
        self._low = np.where(usable, shell.dmin + np.uint16(1), np.uint16(65535))[self._window].copy()
        self._high = np.where(usable, shell.dmax - np.uint16(1), np.uint16(0))[self._window].copy()
        self._usable = np.ascontiguousarray(usable[self._window])
        self._reference = surface.reference[self._window].copy()
        # How far the shell's bounds lie from where the surface reads: the far one in mm, the near one in whole steps.
        self._steps = np.floor(self._reference + _BELOW_RAW) - shell.dmax[self._window]
        self._mm_per_raw = np.nan_to_num(mm_per_raw(surface.sensor))
        self._far_mm = (self._reference - shell.dmin[self._window]) * self._mm_of(self._reference)
        self._settings = settings
        # Written anew for each picture; fresh ones would cost page faults at 30 Hz.
        self._in_shell, self._share, self._binary = (np.empty(self._low.shape, np.uint8) for _ in range(3))

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the surface to read differently from now on; the shell goes with them."""
        top, bottom = self._window[0].start, self._window[0].stop
        first, last = max(now.rows.start, top), min(now.rows.stop, bottom)
        if first >= last:
            return
        rows = slice(first - top, last - top)
        reference = now.reference[first - now.rows.start : last - now.rows.start, self._window[1]]
        self._reference[rows] = reference
        dmin = np.rint(reference - self._far_mm[rows] / np.maximum(self._mm_of(reference), 1e-3))
        dmax = np.floor(reference + _BELOW_RAW) - self._steps[rows]
        usable = self._usable[rows] & (dmin >= 0.0)
        self._low[rows] = np.where(usable, dmin + 1.0, 65535.0)
        self._high[rows] = np.where(usable, dmax - 1.0, 0.0)

    def _mm_of(self, reference: Floats) -> Floats:
        return self._mm_per_raw.take(reference.astype(np.int32), mode="clip")

    def find(self, raw: Image16) -> list[Blob]:
        """Return the blobs of one picture (H, W) uint16, in no particular order."""
        if not self._low.size:
            return []
        settings = self._settings
        seen = raw[self._window]
        in_shell = cv2.inRange(seen, self._low, self._high, dst=self._in_shell)
        share = cv2.blur(in_shell, (settings.boxcar_px, settings.boxcar_px), dst=self._share)
        _, binary = cv2.threshold(share, settings.keep_threshold * 255.0, 255, cv2.THRESH_BINARY, dst=self._binary)
        outlines, _ = cv2.findContours(binary, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        blobs = (self._measure(outline, seen, in_shell, share) for outline in outlines)
        return [blob for blob in blobs if blob is not None]

    def _measure(self, outline: MatLike, seen: Image16, in_shell: MatLike, share: MatLike) -> Blob | None:
        moments = cv2.moments(outline)
        if moments["m00"] <= 0.0:
            return None
        left, top, width, height = cv2.boundingRect(outline)
        box = (slice(top, top + height), slice(left, left + width))
        mask = in_shell[box]
        peak = cv2.minMaxLoc(share[box])[1]
        return Blob(
            u=moments["m10"] / moments["m00"] + self._origin[0],
            v=moments["m01"] / moments["m00"] + self._origin[1],
            surface_raw=cv2.mean(self._reference[box], mask)[0],
            seen_raw=cv2.mean(seen[box], mask)[0],
            # A polygon through pixel centres leaves out half of each outline pixel (Pick's theorem).
            pixels=moments["m00"] + len(outline) / 2.0 + 1.0,
            axis=_long_axis(moments),
            peak=peak / 255.0,
        )


def _bounds(usable: Mask) -> tuple[int, int, int, int]:
    rows, columns = np.flatnonzero(usable.any(axis=1)), np.flatnonzero(usable.any(axis=0))
    if not rows.size:
        return 0, 0, 0, 0
    return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1


def _long_axis(moments: Moments) -> tuple[float, float]:
    angle = 0.5 * math.atan2(2.0 * moments["mu11"], moments["mu20"] - moments["mu02"])
    return math.cos(angle), math.sin(angle)
