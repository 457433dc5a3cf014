"""The shell: the layer just above the surface in which the paper looks for contacts, in the sensor's unit per pixel."""

import numpy as np

from touchd.geometry import depth_mm, raw_of_depth
from touchd.model import Shell, Surface, frozen_array
from touchd.surface.settings import ShellSettings

# Fitted on rendered hands at 0.75, 0.82 and 1.5 m (see docs/design.md): thinner, and touches are lost; thicker, and
# the centroid slides up the finger and hovering fingers fire. The paper's own shell was 14 and 30 mm.
AUTO_FAR_MM = 14.0
AUTO_FAR_STEPS = 1.6


def shell_over(surface: Surface, settings: ShellSettings) -> Shell:
    """Return the shell over a surface: ``dmin < raw < dmax``.

    Without ``near_mm``, dmax is the surface's own (the first bin of weight). Without ``far_mm``, the upper boundary
    lies 14 mm + 1.6 effective steps above the surface; the effective step is the root of the squares of the local raw
    step and the local noise. ``delta_raw`` is the paper's literal dmin = dmax − δ. A pixel whose own noise fills the
    shell is left out, like one without a reading.
    """
    sensor = surface.sensor
    height, width = surface.valid.shape
    z_mm = np.where(surface.valid, depth_mm(sensor, surface.reference), np.nan)
    raw = np.clip(np.rint(surface.reference), 0, len(sensor.step_mm) - 1).astype(int)
    step_mm = sensor.step_mm[raw]
    dmax = surface.dmax.astype(np.float64)
    if settings.near_mm is not None:
        dmax = np.ceil(raw_of_depth(sensor, z_mm - settings.near_mm))
    if settings.delta_raw is not None:
        dmin = dmax - settings.delta_raw
    else:
        mm_per_raw = 1.0 if sensor.unit == "mm" else step_mm
        effective_mm = np.hypot(step_mm, surface.noise * mm_per_raw)
        far_mm = AUTO_FAR_MM + AUTO_FAR_STEPS * effective_mm if settings.far_mm is None else settings.far_mm
        dmin = np.floor(raw_of_depth(sensor, z_mm - far_mm))
    usable = surface.valid & np.isfinite(dmin) & np.isfinite(dmax) & (dmax - dmin >= 2.0) & (dmin >= 0.0)
    near_seen = z_mm - depth_mm(sensor, np.where(usable, dmax - 1.0, np.nan))
    far_seen = z_mm - depth_mm(sensor, np.where(usable, dmin + 1.0, np.nan))
    some = usable.any()
    return Shell(
        dmin=frozen_array(np.where(usable, dmin, 0).astype(np.uint16).reshape(height, width)),
        dmax=frozen_array(np.where(usable, dmax, 0).astype(np.uint16).reshape(height, width)),
        near_mm=float(np.nanmedian(near_seen)) if some else 0.0,
        far_mm=float(np.nanmedian(far_seen)) if some else 0.0,
    )
