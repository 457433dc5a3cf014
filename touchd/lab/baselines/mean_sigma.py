"""Baseline: each pixel's depth noise taken as normal, with mean and standard deviation."""

from dataclasses import replace

import numpy as np

from touchd.model import Frame, Surface, frozen_array

_SIGMAS = 3.0


def mean_less_sigmas(surface: Surface, _first: Frame) -> Surface:
    """Return the surface whose nearest reading is held to be its mean less three standard deviations."""
    nearest = np.ceil(np.where(surface.valid, surface.reference - _SIGMAS * surface.noise, 0.0))
    return replace(surface, dmax=frozen_array(np.clip(nearest, 0, 65535).astype(np.uint16)))
