"""What a fitted fingertip is judged by: how the picture differs from the model, and what is around and behind it."""

from collections.abc import Sequence
from math import cos, log, sin

import cv2
import numpy as np

from touchd.contacts.fit import Fitted, Picture, Quality
from touchd.contacts.heights import as_floats
from touchd.contacts.tips import Tip
from touchd.model import Floats

# Places along and across the finger (mm from the ball's centre) whose heights tell what it is the tip of.
_AROUND_MM = np.array(
    [
        [-25, -25, -25, -15, -15, 25, 25, 25, 35, 35, 35, 50, 50, 50, 65, 65, 65, 85],
        [-12, 0, 12, -15, 15, -12, 0, 12, -15, 0, 15, -20, 0, 20, -20, 0, 20, 0],
        [1] * 18,
    ],
    np.float32,
)
_UNREADABLE_MM = -20.0
_TALL_MM = 40.0
_READABLE = 200  # of 255
_LARGEST_RESIDUAL, _PER_RESIDUAL = np.float32(6.0), np.float32(0.5)


def traits(tips: Sequence[Tip], fitted: Fitted, quality: Quality, picture: Picture) -> Floats:
    """Return the traits (N, T) of fitted tips, each about 1 in size, in the order that a judge is made for."""
    shapes = np.array([_shape(tip, fitted, quality, i) for i, tip in enumerate(tips)], np.float32)
    residuals = np.clip(fitted.residual, -_LARGEST_RESIDUAL, _LARGEST_RESIDUAL) * _PER_RESIDUAL
    residuals *= fitted.known > 0.5
    return np.concatenate([residuals, _surroundings(fitted, picture), shapes], axis=1)


def _surroundings(fitted: Fitted, picture: Picture) -> Floats:
    """Return heights at places around each tip (N, P), where much more than a finger's counts little more."""
    places = np.matmul(np.array(fitted.axes, np.float32), _AROUND_MM)
    u, v = places[:, 0], places[:, 1]
    heights = as_floats(cv2.remap(picture.heights_mm, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT))
    read = cv2.remap(picture.readings, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    np.copyto(heights, _UNREADABLE_MM, where=read <= _READABLE)
    around: Floats = np.tanh(heights / np.float32(_TALL_MM))
    return around


def _shape(tip: Tip, fitted: Fitted, quality: Quality, which: int) -> tuple[float, ...]:
    lay, clearance_mm = tip.guess.lay, tip.clearance_mm
    lean_across = lay.y_by_z * cos(tip.angle) - lay.x_by_z * sin(tip.angle)
    return (
        clearance_mm / 10.0,
        clearance_mm / (6.0 + 3.0 * lay.step_mm),
        clearance_mm / (10.0 + abs(clearance_mm)),
        tip.pitch_rad - 0.85,
        tip.seen_pitch_rad - 0.7,
        tip.radius_mm - 6.5,
        2.0 * tip.lean,
        2.0 * lean_across,
        log(lay.step_mm / 3.0),
        log(lay.pixel_mm / 2.0),
        quality.misfit[which] - 1.0,
        min(quality.core[which], 4.0) - 1.0,
        quality.seen[which] - 0.9,
        tip.guess.clearance_mm / 20.0,
        log(max(fitted.clearance_variance(which), 0.01)),
        float(tip.guess.shown),
        *_way(tip),
    )


def _way(tip: Tip) -> tuple[float, float, float]:
    """Return how far along, across and in turn the fit went from where it began to be looked for."""
    along_mm, across_mm = tip.guess.lay.seen_from(tip.angle, tip.u - tip.guess.u, tip.v - tip.guess.v)
    return along_mm / 10.0, across_mm / 10.0, 2.0 * sin(tip.angle - tip.guess.angle)
