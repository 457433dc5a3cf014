"""What a depth sensor shows of a fingertip: a bank of small height pictures, made once per surface.

A fingertip is a ball swept back and up along the finger, a little thicker on the way. Its height over the surface
is known in closed form; the sensor's window then blurs it and makes its outline grow. The bank holds the blurred
heights at fixed places around the tip, for every combination of a few scales, radii, pitches and clearances, and how
they change with each of the six unknowns, so that fitting one only has to look them up.
"""

from dataclasses import dataclass
from itertools import product
from math import atan, ceil
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.contacts.heights import HIGHEST_MM
from touchd.geometry import Doubles
from touchd.model import Floats, Mask, Sensor, frozen_array

Shorts: TypeAlias = NDArray[np.int16]

RADII_MM = (3.8, 4.8, 5.8, 6.8, 8.0)
CLEARANCES_MM = (0.0, 4.0, 8.0, 13.0, 20.0, 30.0)
UNKNOWNS = 6  # along, across (mm), turn (rad), pitch (rad), clearance (mm), radius (mm)

_LEAN_STEP, _STEEPEST_LEAN = 0.25, 0.75
# Pitches as the camera sees them, beside its own way of looking.
_SEEN_PITCHES_RAD = (-0.6, -0.4, -0.2, 0.0, 0.17, 0.34, 0.5, 0.66, 0.8, 0.93, 1.05, 1.15, 1.24, 1.32, 1.39)
_PITCH_MARGIN_RAD, _STEEPEST_RAD = 0.1, 1.5
_TAPER = 0.03  # a finger's radius grows by this much for each mm of the way back
_STEEPEST_COS = 0.05
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
_LARGEST = np.iinfo(np.int16).max


@dataclass(frozen=True, slots=True)
class PatchBank:
    """Templates over a grid of S places around the tip, T of them; all arrays are float32, but the templates int16.

    ``scales_mm`` (K,): sizes of a pixel on the surface. ``places_mm`` (K, 2, S): the places along and across the
    finger, along growing towards the hand; ``core`` (K, S) bool: those on the finger's middle. ``leans`` (L,): how far
    along the finger (mm) what is higher by 1 mm is seen. ``pitches_rad``: for each lean the pitches that there are
    templates for. ``templates`` (T, 8, S): of each place its height times its weight, the weight (one over what a
    sample may differ, in mm), and how the height changes per unit of each of the six unknowns, times the weight; all in
    ``units`` (8, 1). ``middles`` (T, 3): pitch, clearance and radius of each template. Templates are in the order of
    scale, lean, pitch, radius and clearance.
    """

    scales_mm: Floats
    places_mm: Floats
    core: Mask
    leans: tuple[float, ...]
    pitches_rad: tuple[tuple[float, ...], ...]
    templates: Shorts
    units: Floats
    middles: Floats


@dataclass(frozen=True, slots=True)
class _Grid:
    """Where a pixel size is looked at: places (S,) in mm along and across a finger, and what the sensor is like."""

    along: Doubles
    across: Doubles
    pixel_mm: float
    step_mm: float
    window_px: int

    @classmethod
    def of(cls, pixel_mm: float, step_mm: float, window_px: int) -> "_Grid":
        half = 0.5 * window_px * pixel_mm
        rows = np.linspace(-_AROUND_MM - half, _BEHIND_MM + half, _ROWS)
        columns = np.linspace(-_AROUND_MM - half, _AROUND_MM + half, _COLUMNS)
        along, across = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
        return cls(along, across, pixel_mm, step_mm, window_px)


def make_bank(sensor: Sensor, scales_mm: Floats, steps_mm: Floats, steepest_lean: float) -> PatchBank:
    """Return the bank for pixels of these sizes (K,) on the surface, where a raw step has these sizes (K,).

    ``steepest_lean``: how far at most (mm) what is higher by 1 mm is seen elsewhere, in any direction.
    """
    window_px = 2 * round(sensor.fatten_px) + 1
    grids = [_Grid.of(float(m), float(step), window_px) for m, step in zip(scales_mm, steps_mm, strict=True)]
    count = ceil(min(steepest_lean, _STEEPEST_LEAN) / _LEAN_STEP - 0.5)
    leans = tuple(_LEAN_STEP * k for k in range(-count, count + 1))
    pitches = tuple(_pitches(lean) for lean in leans)
    parts = [_templates(grid, lean, some) for grid in grids for lean, some in zip(leans, pitches, strict=True)]
    shapes = [
        (pitch, clearance, radius)
        for some in pitches
        for pitch, radius, clearance in product(some, RADII_MM, CLEARANCES_MM)
    ]
    templates, units = _in_units(parts)
    across = np.stack([grid.across for grid in grids])
    places = np.stack([np.stack([grid.along for grid in grids]), across], 1)
    return PatchBank(
        scales_mm=frozen_array(np.asarray(scales_mm, np.float32)),
        places_mm=frozen_array(places.astype(np.float32)),
        core=frozen_array(np.abs(across) < _CORE_MM),
        leans=leans,
        pitches_rad=pitches,
        templates=frozen_array(templates),
        units=frozen_array(units),
        middles=frozen_array(np.tile(np.array(shapes, np.float32), (len(grids), 1))),
    )


def _pitches(lean: float) -> tuple[float, ...]:
    """Return the pitches to have templates for: the denser the steeper they look to the camera."""
    turn = atan(lean)
    return tuple(seen + turn for seen in _SEEN_PITCHES_RAD if -_PITCH_MARGIN_RAD < seen + turn < _STEEPEST_RAD)


def _in_units(parts: list[Floats]) -> tuple[Shorts, Floats]:
    """Return templates (T, 8, S) as whole numbers, and what one is worth in each of the eight (8, 1).

    They take half the room of floats, as half-precision ones do, and are floats again in less than half of their time.
    """
    units = np.max([np.abs(part).max(axis=(0, 2)) for part in parts], axis=0)[:, None] / np.float32(_LARGEST)
    return np.concatenate([np.rint(part / units).astype(np.int16) for part in parts]), units


def _templates(grid: _Grid, lean: float, pitches: tuple[float, ...]) -> Floats:
    """Return the templates (P * R * C, 8, S) for one lean, in the order of pitch, radius and clearance."""
    along, across, delta = grid.along, grid.across, _OUTLINE_PX * grid.pixel_mm
    seen = np.stack([_seen_around(grid, lean, pitch, _ASIDE * delta) for pitch in pitches])
    heights = seen[..., 0, :]
    by_along = (seen[..., 1, :] - seen[..., 2, :]) / (2.0 * delta)
    by_across = (seen[..., 3, :] - seen[..., 4, :]) / (2.0 * delta)
    # Moving the tip by +1 moves the picture under a fixed place by -1.
    slopes = (
        -by_along,
        -by_across,
        by_along * across - by_across * along,
        np.gradient(heights, np.array(pitches), axis=0),
        np.gradient(heights, np.array(CLEARANCES_MM), axis=2),
        np.gradient(heights, np.array(RADII_MM), axis=1),
    )
    steepness = np.maximum(np.cos(pitches) + lean * np.sin(pitches), _STEEPEST_COS)
    way = np.maximum(along, 0.0) / steepness[:, None]
    bend = max(_BEND_MM / grid.step_mm, _LEAST_BEND) * np.maximum(way - _STRAIGHT_MM, 0.0)
    aside = np.mean((seen[..., 1:, :] - heights[..., None, :]) ** 2, axis=-2)
    known = (_STEPS * grid.step_mm) ** 2 + _MODEL_MM**2 + bend**2
    noise = np.sqrt(known[:, None, None] + aside)
    rows = np.stack([heights, np.ones_like(heights), *slopes], axis=-2) / noise[..., None, :]
    return np.ascontiguousarray(rows.reshape(-1, UNKNOWNS + 2, along.size), np.float32)


def _seen_around(grid: _Grid, lean: float, pitch: float, aside_mm: Doubles) -> Floats:
    """Return what is read (R, C, A, S) at places, each moved ``aside_mm`` (A, 2) along and across."""
    fine_mm = grid.pixel_mm / _SUBPIXELS
    margin = (0.5 * grid.window_px + 2.0) * grid.pixel_mm
    a_axis = np.arange(grid.along.min() - margin, grid.along.max() + margin, fine_mm)
    b_axis = np.arange(grid.across.min() - margin, grid.across.max() + margin, fine_mm)
    a, b = np.meshgrid(a_axis, b_axis, indexing="ij")
    v = ((grid.along + aside_mm[:, :1] - a_axis[0]) / fine_mm).astype(np.float32)
    u = ((grid.across + aside_mm[:, 1:] - b_axis[0]) / fine_mm).astype(np.float32)
    c = np.array(CLEARANCES_MM, np.float32)[:, None, None]
    seen = np.empty((len(RADII_MM), len(CLEARANCES_MM), len(aside_mm), grid.along.size), np.float32)
    for i, radius in enumerate(RADII_MM):
        powers = _mean_powers(seen_height(a, b, radius, pitch, lean), grid.window_px * _SUBPIXELS)
        f, h, h2, h3 = (np.asarray(cv2.remap(mean, u, v, cv2.INTER_LINEAR), np.float32) for mean in powers)
        # The powers' means of a finger that is higher by c, from those of one at rest and its share f of the window.
        first, second = h + c * f, h2 + c * (2.0 * h + c * f)
        third = h3 + c * (3.0 * h2 + c * (3.0 * h + c * f))
        seen[i] = reading(first, second, third, _BUMP_RAW * grid.step_mm)
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


def seen_height(along_mm: Doubles, across_mm: Doubles, radius_mm: float, pitch_rad: float, lean: float) -> Doubles:
    """Return the height over the surface of what a camera sees, that looks at it at an angle along the finger.

    What is higher by 1 mm is seen ``lean`` mm farther along; places are relative to where the ball's centre is seen.
    Turned so that the camera looks from above, the finger is one of another pitch.
    """
    scale = np.hypot(1.0, lean)
    pitch = min(pitch_rad - np.arctan(lean), np.arccos(_STEEPEST_COS))
    over = finger_height(along_mm / scale, across_mm, radius_mm, pitch)
    height = radius_mm + (lean * along_mm / scale + over - radius_mm) / scale
    return np.where(over > 0.0, np.clip(height, 0.0, HIGHEST_MM), 0.0)


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
