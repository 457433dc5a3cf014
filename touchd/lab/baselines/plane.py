"""Baseline: the surface as one plane through the whole picture."""

from dataclasses import replace

import numpy as np

from touchd.geometry import Doubles, depth_mm, raw_of_depth
from touchd.model import Frame, Surface, frozen_array

_SIGMAS = 5.0  # with three, the sensor's fixed pattern alone makes hundreds of false touches a minute
_ROUNDS = 5
_CLOSE_SIGMAS = 4.0


def plane_through(surface: Surface, _first: Frame) -> Surface:
    """Return the plane that fits the surface best; what is nearer by five times the misfit stands above it.

    A plane in space is a linear function of the pixel in inverse depth, 1/Z = a·u + b·v + c, for a lens without
    distortion. It is fitted by least squares, five times over, each time to what lies within 4 standard deviations.
    """
    height, width = surface.valid.shape
    v, u = np.mgrid[0:height, 0:width].astype(np.float64)
    z_mm = np.where(surface.valid, depth_mm(surface.sensor, surface.reference), np.nan)
    plane_mm, misfit_mm = _fit(u, v, z_mm)
    nearest = np.ceil(raw_of_depth(surface.sensor, plane_mm - _SIGMAS * misfit_mm))
    reference = raw_of_depth(surface.sensor, plane_mm)
    usable = surface.valid & np.isfinite(nearest) & np.isfinite(reference) & (nearest > 0)
    return replace(
        surface,
        reference=frozen_array(np.where(usable, reference, 0.0).astype(np.float32)),
        dmax=frozen_array(np.where(usable, nearest, 0.0).astype(np.uint16)),
        valid=frozen_array(usable),
    )


def _fit(u: Doubles, v: Doubles, z_mm: Doubles) -> tuple[Doubles, float]:
    """Return the plane's depth (H, W) and the standard deviation from it of what is close to it."""
    columns = np.stack([u.ravel(), v.ravel(), np.ones(u.size)], axis=1)
    seen = z_mm.ravel()
    close = np.isfinite(seen)
    plane_mm, misfit_mm = seen, 0.0
    for _ in range(_ROUNDS):
        factors, *_ = np.linalg.lstsq(columns[close], 1.0 / seen[close], rcond=None)
        plane_mm = 1.0 / (columns @ factors)
        misfit_mm = float(np.std((seen - plane_mm)[close]))
        close = np.isfinite(seen) & (np.abs(seen - plane_mm) <= _CLOSE_SIGMAS * max(misfit_mm, 0.1))
    return plane_mm.reshape(z_mm.shape), misfit_mm
