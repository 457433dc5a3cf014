"""Baseline: a single picture of the empty surface, as the simplest programs keep it."""

from dataclasses import replace

import numpy as np

from touchd.model import Frame, Surface, frozen_array


def single_snapshot(surface: Surface, first: Frame) -> Surface:
    """Return the surface as the first frame shows it; what is nearer by two steps stands above it, one being noise."""
    valid = np.isfinite(surface.sensor.to_mm[first.raw])
    return replace(
        surface,
        reference=frozen_array(first.raw.astype(np.float32)),
        dmax=frozen_array(np.where(valid, first.raw, 1).astype(np.uint16) - np.uint16(1)),
        noise=frozen_array(np.zeros_like(surface.noise)),
        valid=frozen_array(valid),
        moved=frozen_array(np.zeros_like(surface.moved)),
        frames=1,
    )
