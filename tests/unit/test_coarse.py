"""Coarse pictures tell how high things stand, however high."""

import numpy as np
import pytest
from touchd.geometry import kinect_v1_sensor, map_surface, raw_of_depth
from touchd.model import COARSE_PX, Surface, SurfaceRows
from touchd.surface.coarse import CoarseHeights

_Z_MM = 900.0


def _flat_surface() -> Surface:
    sensor = kinect_v1_sensor()
    shape = (sensor.size[1], sensor.size[0])
    raw = float(raw_of_depth(sensor, np.array(_Z_MM)))
    valid = np.ones(shape, np.bool_)
    valid[:, :40] = False
    return Surface(
        sensor=sensor,
        reference=np.full(shape, raw, np.float32),
        dmax=np.full(shape, int(raw), np.uint16),
        noise=np.full(shape, 0.2, np.float32),
        valid=valid,
        moved=~valid,
        frames=100,
        made_from="test",
    )


@pytest.mark.parametrize("height_mm", [0.0, 13.0, 60.0, 300.0])
def test_heights_are_right_within_a_raw_step_however_high(height_mm: float) -> None:
    surface = _flat_surface()
    coarse = CoarseHeights(surface, map_surface(surface))
    raw = np.rint(raw_of_depth(surface.sensor, np.full(surface.valid.shape, _Z_MM - height_mm))).astype(np.uint16)
    seen = coarse.over(raw)
    assert seen.heights_mm.shape == (480 // COARSE_PX, 640 // COARSE_PX)
    assert np.abs(seen.heights_mm[seen.readings] - height_mm).max() < 3.0


def test_where_surface_or_picture_has_no_reading_there_is_none() -> None:
    surface = _flat_surface()
    coarse = CoarseHeights(surface, map_surface(surface))
    raw = surface.dmax.copy()
    raw[200:240] = surface.sensor.invalid
    seen = coarse.over(raw)
    assert not seen.readings[:, :10].any()
    assert not seen.readings[50:60].any()
    assert seen.readings[:50, 10:].all()
    assert (seen.heights_mm[~seen.readings] == 0.0).all()


def test_a_surface_that_reads_differently_now_is_followed() -> None:
    surface = _flat_surface()
    coarse = CoarseHeights(surface, map_surface(surface))
    moved = surface.reference - np.float32(5.0)
    coarse.follow(SurfaceRows(slice(64, 128), moved[64:128]))
    seen = coarse.over(np.rint(moved).astype(np.uint16))
    assert np.abs(seen.heights_mm[16:32]).max() < 2.0
    assert np.abs(seen.heights_mm[32:][seen.readings[32:]]).min() > 5.0
