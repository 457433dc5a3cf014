"""What a depth sensor shows of a fingertip: a bank of small height pictures, made once per surface.

A fingertip is a ball swept back and up along the finger, a little thicker on the way. Its height over the surface
is known in closed form; the sensor's window then blurs it and makes its outline grow. The bank holds the blurred
heights at fixed places around the tip, for every combination of a few scales, radii, pitches and clearances, and how
they change with each of the six unknowns, so that fitting one only has to look them up.
"""

from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from touchd.geometry import Doubles
from touchd.model import Floats, Mask, Sensor, frozen_array

RADII_MM = (3.6, 4.3, 5.0, 5.8, 6.6, 7.4, 8.4)
PITCHES_RAD = (0.08, 0.24, 0.4, 0.56, 0.72, 0.88, 1.04, 1.2)
CLEARANCES_MM = (0.0, 4.0, 8.0, 13.0, 20.0, 30.0)
UNKNOWNS = 6  # along, across (mm), turn (rad), pitch (rad), clearance (mm), radius (mm)

_TAPER = 0.03  # a finger's radius grows by this much for each mm of the way back
_SUBPIXELS = 3
_ROWS, _COLUMNS = 13, 11
_AROUND_MM, _BEHIND_MM = 7.0, 15.0  # how far the places reach, before the window's half is added
_ASIDE = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])  # along, across
# A window that holds two surfaces: how much more the nearer one counts, and how far apart (in raw steps, one
# standard deviation) matches still merge. Fitted on heights around moving fingertips with exact truth.
_NEAR_WEIGHT = 2.1
_BUMP_RAW = 5.0
_VOTES = 8
# What a sample differs by from the model: a share of a raw step (noise, pattern and rounding, as averaged by the
# fit), real fingers' shapes, and the wobble of the sensor's outlines.
_STEPS = 0.3
_MODEL_MM = 0.4
_OUTLINE_PX = 0.75
# Fingers bend, so that their height is known less well beyond the last joint; a coarse sensor needs it nonetheless.
_STRAIGHT_MM = 12.0
_BEND_MM, _LEAST_BEND = 1.0, 0.6  # per mm of the way, in raw steps of so many mm, and at least
_CORE_MM = 5.5


@dataclass(frozen=True, slots=True)
class PatchBank:
    """Templates over a grid of S places around the tip, T of them; all arrays are float32.

    ``scales_mm`` (K,): sizes of a pixel on the surface. ``places_mm`` (K, 2, S): the places along and across the
    finger, along growing towards the hand; ``core`` (K, S) bool: those on the finger's middle. ``templates``
    (T, 8, S): of each place its height times its weight, the weight (one over what a sample may differ, in mm), and
    how the height changes per unit of each of the six unknowns, times the weight. ``middles`` (T, 3): pitch, clearance
    and radius of each template. Templates are in the order of scale, radius, pitch and clearance.
    """

    scales_mm: Floats
    places_mm: Floats
    core: Mask
    templates: Floats
    middles: Floats


def make_bank(sensor: Sensor, scales_mm: Floats, steps_mm: Floats) -> PatchBank:
    """Return the bank for pixels of these sizes (K,) on the surface, where a raw step has these sizes (K,)."""
    window_px = 2 * round(sensor.fatten_px) + 1
    parts = [_of_one_scale(float(m), float(step), window_px) for m, step in zip(scales_mm, steps_mm, strict=True)]
    along, across, heights, slopes, noise = (np.stack(list(column)) for column in zip(*parts, strict=True))
    weights = 1.0 / noise.reshape(-1, 1, along.shape[1])
    rows = [np.ones_like(weights), np.moveaxis(slopes.reshape(-1, along.shape[1], UNKNOWNS), 2, 1)]
    templates = np.concatenate([heights.reshape(weights.shape), *rows], axis=1) * weights
    shapes = [(pitch, clearance, radius) for radius, pitch, clearance in product(RADII_MM, PITCHES_RAD, CLEARANCES_MM)]
    return PatchBank(
        scales_mm=frozen_array(np.asarray(scales_mm, np.float32)),
        places_mm=frozen_array(np.stack([along, across], 1).astype(np.float32)),
        core=frozen_array(np.abs(across) < _CORE_MM),
        templates=frozen_array(np.ascontiguousarray(templates, np.float32)),
        middles=frozen_array(np.tile(np.array(shapes, np.float32), (len(parts), 1))),
    )


def _of_one_scale(pixel_mm: float, step_mm: float, window_px: int) -> tuple[Doubles, Doubles, Floats, Floats, Floats]:
    """Return places (S,) along and across, heights (R, P, C, S), slopes (R, P, C, S, 6) and noise (R, P, C, S)."""
    half = 0.5 * window_px * pixel_mm
    rows = np.linspace(-_AROUND_MM - half, _BEHIND_MM + half, _ROWS)
    columns = np.linspace(-_AROUND_MM - half, _AROUND_MM + half, _COLUMNS)
    along, across = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
    delta = _OUTLINE_PX * pixel_mm
    seen = _seen_around(along, across, delta, pixel_mm, step_mm, window_px)
    heights = seen[..., 0, :]
    by_along = (seen[..., 1, :] - seen[..., 2, :]) / (2.0 * delta)
    by_across = (seen[..., 3, :] - seen[..., 4, :]) / (2.0 * delta)
    slopes = np.empty((*heights.shape, UNKNOWNS), np.float32)
    # Moving the tip by +1 moves the picture under a fixed place by -1.
    slopes[..., 0] = -by_along
    slopes[..., 1] = -by_across
    slopes[..., 2] = by_along * across - by_across * along
    slopes[..., 3] = np.gradient(heights, np.array(PITCHES_RAD), axis=1)
    slopes[..., 4] = np.gradient(heights, np.array(CLEARANCES_MM), axis=2)
    slopes[..., 5] = np.gradient(heights, np.array(RADII_MM), axis=0)
    way = np.maximum(along, 0.0) / np.cos(np.array(PITCHES_RAD))[:, None]
    bend = max(_BEND_MM / step_mm, _LEAST_BEND) * np.maximum(way - _STRAIGHT_MM, 0.0)[None, :, None]
    aside = seen[..., 1:, :] - heights[..., None, :]
    noise = np.sqrt((_STEPS * step_mm) ** 2 + _MODEL_MM**2 + bend**2 + np.mean(aside * aside, axis=-2))
    return along, across, heights, slopes, noise.astype(np.float32)


def _seen_around(
    along: Doubles, across: Doubles, delta_mm: float, pixel_mm: float, step_mm: float, window_px: int
) -> Floats:
    """Return what is read (R, P, C, 5, S) at places and at four others around each, ``delta_mm`` away."""
    fine_mm = pixel_mm / _SUBPIXELS
    margin = (0.5 * window_px + 2.0) * pixel_mm
    a_axis = np.arange(along.min() - margin, along.max() + margin, fine_mm)
    b_axis = np.arange(across.min() - margin, across.max() + margin, fine_mm)
    a, b = np.meshgrid(a_axis, b_axis, indexing="ij")
    v = (along + delta_mm * _ASIDE[:, :1] - a_axis[0]) / fine_mm
    u = (across + delta_mm * _ASIDE[:, 1:] - b_axis[0]) / fine_mm
    clearances = np.array(CLEARANCES_MM, np.float32)[:, None, None]
    seen = np.empty((len(RADII_MM), len(PITCHES_RAD), len(clearances), len(_ASIDE), along.size), np.float32)
    for (i, radius), (j, pitch) in product(enumerate(RADII_MM), enumerate(PITCHES_RAD)):
        powers = _mean_powers(finger_height(a, b, radius, pitch), window_px * _SUBPIXELS)
        f, h, h2, h3 = (
            np.asarray(cv2.remap(mean, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR), np.float32)
            for mean in powers
        )
        # The powers' means of a finger that is higher by c, from those of one at rest and its share f of the window.
        c = clearances
        first, second = h + c * f, h2 + c * (2.0 * h + c * f)
        third = h3 + c * (3.0 * h2 + c * (3.0 * h + c * f))
        seen[i, j] = reading(first, second, third, _BUMP_RAW * step_mm)
    return seen


def _mean_powers(heights_mm: Doubles, window: int) -> list[Floats]:
    """Return the means over windows of the heights' powers 0 (how much of it is finger), 1, 2 and 3."""
    heights = heights_mm.astype(np.float32)
    powers = ((heights > 0.0).astype(np.float32), heights, heights**2, heights**3)
    size = (window, window)
    means = (cv2.boxFilter(power, cv2.CV_32F, size, borderType=cv2.BORDER_REPLICATE) for power in powers)
    return [np.asarray(mean, np.float32) for mean in means]


def finger_height(along_mm: Doubles, across_mm: Doubles, radius_mm: float, pitch_rad: float) -> Doubles:
    """Return the height over the surface, seen from above, of a finger whose tip's ball rests on it at the origin.

    A ball of radius r rolls from (0, 0, r) along (cos pitch, 0, sin pitch). Over a place (a, b) the ball that reaches
    highest has its centre where a - s·cos = -R·sin with R² = r² - b²; before the tip it is the first ball, s = 0.
    Zero beside the finger.
    """
    cos, sin = np.cos(pitch_rad), np.sin(pitch_rad)
    room = radius_mm**2 - across_mm**2
    for _ in range(3):  # the radius grows with s, which hangs on the radius
        half = np.sqrt(np.maximum(room, 0.0))
        way = np.maximum((along_mm + half * sin) / cos, 0.0)
        room = (radius_mm + _TAPER * way) ** 2 - across_mm**2
    rest = room - (along_mm - way * cos) ** 2
    return np.where(rest > 0.0, radius_mm + way * sin + np.sqrt(np.maximum(rest, 0.0)), 0.0)


def reading(first: Floats, second: Floats, third: Floats, bump_mm: float) -> Floats:
    """Return what a sensor reads of windows whose heights have these mean powers.

    A window over two surfaces matches both, in the shares of its places that see them; their values and shares follow
    from the mean, variance and skewness within the window. The reading is the mode of the two matches' sum, found by
    mean shift from its mean.
    """
    variance = np.maximum(second - first * first, 1e-4)
    lean = (third - first * (3.0 * variance + first * first)) / (2.0 * variance)
    half = np.sqrt(lean * lean + variance)
    low, high = first + lean - half, first + lean + half
    share = 0.5 - 0.5 * lean / half
    share = _NEAR_WEIGHT * share / (1.0 + (_NEAR_WEIGHT - 1.0) * share)
    read = low + share * (high - low)
    for _ in range(_VOTES):
        near = share * np.exp(-0.5 * ((read - high) / bump_mm) ** 2)
        far = (1.0 - share) * np.exp(-0.5 * ((read - low) / bump_mm) ** 2)
        read = (near * high + far * low) / np.maximum(near + far, 1e-30)
    return np.asarray(read, np.float32)
