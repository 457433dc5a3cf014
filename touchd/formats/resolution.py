"""How coarse and how noisy depth in whole millimetres really is, measured on a few pictures.

A file of millimetres does not say what camera it came from. Many hold the output of a sensor that quantises
disparity, so that only every sixth or seventh millimetre ever occurs at 1.5 m (a Kinect v1: Z²/345489).
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from touchd.model import Floats, Image16

LEAST_NOISE_MM = 0.3
UNKNOWN_NOISE_MM = 1.0  # where nothing can be measured: about a stereo camera's at 0.7 m
_VALUES = 65536
_SEEN = 16  # a value that occurs this often is no stray
_BIN = 1.1  # depths within 10 % have one step
_KINECT_MM2 = 345489.0
_COARSEST = 3.0  # in steps of a Kinect v1, the coarsest camera that we know


def measure_step_mm(pictures: Sequence[Image16]) -> Floats:
    """Return the spacing of the values that a camera delivers, in mm: a float32 table (65536,) over mm.

    Values that occur at least 16 times are paired with the next such value. A pair counts as neighbours on
    the sensor's own scale where next to nothing lies between them (a tenth of the rarer one: at a finer
    spacing there would be as much of the values between), and where it is no wider than three Kinect steps,
    beyond which it is a hole in the scene. In bins of 10 % of depth the step is the mean of the gaps, without
    those far above the median (values that the scene left out); the mean, since a spacing of 6.5 mm shows as
    gaps of 6 and 7. Between bins it is interpolated along powers of the depth. Beyond them it grows with the
    square of the depth, as disparity makes it, unless it is about 1 mm at the far end, where nothing tells
    quantisation from whole millimetres. It is at least 1 mm everywhere.
    """
    low, high = _neighbours(_histogram(pictures))
    gap, middle = (high - low).astype(np.float64), (high + low) / 2.0
    bins = np.round(np.log(middle) / math.log(_BIN))
    knots_mm, steps_mm = [], []
    for one in np.unique(bins):
        inside = bins == one
        inside &= gap <= 1.25 * np.median(gap[inside]) + 1.0
        knots_mm.append(float(middle[inside].mean()))
        steps_mm.append(float(gap[inside].mean()))
    if not knots_mm:
        return np.ones(_VALUES, np.float32)
    return _spread(np.array(knots_mm), np.array(steps_mm))


def _histogram(pictures: Sequence[Image16]) -> NDArray[np.int64]:
    counts = np.zeros(_VALUES, np.int64)
    for picture in pictures:
        counts += np.bincount(picture.ravel(), minlength=_VALUES)
    counts[0] = 0
    return counts


def _neighbours(counts: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the lower and the upper value of every pair that is adjacent on the sensor's own scale."""
    often = np.flatnonzero(counts >= _SEEN)
    low, high = often[:-1], often[1:]
    up_to = np.cumsum(counts)
    between = up_to[high - 1] - up_to[low]
    rarer = np.minimum(counts[low], counts[high])
    widest = _COARSEST * (high * high) / _KINECT_MM2 + 1.0
    adjacent = (10 * between <= rarer) & (high - low <= widest)
    return low[adjacent], high[adjacent]


def _spread(knots_mm: NDArray[np.float64], steps_mm: NDArray[np.float64]) -> Floats:
    depth_mm = np.maximum(np.arange(_VALUES, dtype=np.float64), 1.0)
    table = np.exp(np.interp(np.log(depth_mm), np.log(knots_mm), np.log(steps_mm)))
    nearer = depth_mm < knots_mm[0]
    table[nearer] = steps_mm[0] * (depth_mm[nearer] / knots_mm[0]) ** 2
    if steps_mm[-1] >= 1.2:
        farther = depth_mm > knots_mm[-1]
        table[farther] = steps_mm[-1] * (depth_mm[farther] / knots_mm[-1]) ** 2
    return np.maximum(table, 1.0).astype(np.float32)


def measure_noise_mm(pictures: Sequence[Image16], step_mm: Floats) -> float | None:
    """Return the standard deviation of a still pixel at the picture's median depth, in mm, at least 0.3.

    From the differences of consecutive pictures, counted in local steps because a triangulating sensor's
    noise grows with its step. The mean absolute difference of Gaussian noise is 2·sigma/√π, and quantising
    does not change it where the true values lie anywhere between two steps: a difference crosses on
    average as many steps as it is wide. (Squares would be inflated by quantising, and a median is 0 where
    most pixels hold still.) Differences beyond 3 steps and 6 times the spread that their median tells are
    motion or outlines, and left out. ``None`` where fewer than two pictures have a pixel in common.
    """
    seen_steps, changes = [], []
    for before, after in pairwise(pictures):
        both = (before > 0) & (after > 0)
        steps = step_mm[np.minimum(before, after)[both]]
        changes.append(np.abs(after[both].astype(np.float32) - before[both].astype(np.float32)) / steps)
        seen_steps.append(steps)
    if not any(change.size for change in changes):
        return None
    change = np.concatenate(changes)
    still = change <= 3.0 + 6.0 * 1.4826 * float(np.median(change))
    in_steps = float(change[still].mean(dtype=np.float64)) * math.sqrt(math.pi) / 2.0
    return max(LEAST_NOISE_MM, in_steps * float(np.median(np.concatenate(seen_steps))))
