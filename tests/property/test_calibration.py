"""Calibration against the plain thing: a full histogram per pixel over all raw values."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from touchd.geometry import KINECT_INVALID, kinect_v1_sensor
from touchd.model import Surface
from touchd.surface.calibrate import BINS_EACH_SIDE, Calibration
from touchd.surface.settings import CalibrationSettings

SHAPE = (3, 4)
SENSOR = replace(kinect_v1_sensor(), size=(SHAPE[1], SHAPE[0]))


def calibrated(frames: NDArray[np.uint16]) -> Surface:
    calibration = Calibration(SENSOR, CalibrationSettings(frames=len(frames)), "a test")
    for raw in frames:
        calibration.add(raw)
    assert calibration.complete
    return calibration.surface_so_far()


def naive_dmax(readings: list[int], least: int) -> int:
    counts = np.bincount(readings, minlength=2048)
    return int(np.flatnonzero(counts > least)[0])


# All readings of a pixel lie within one window of each other, with holes, as over a still surface.
still_scenes = st.integers(5, 60).flatmap(
    lambda count: st.tuples(
        arrays(np.uint16, SHAPE, elements=st.integers(300, 900)),
        arrays(np.uint16, (count, *SHAPE), elements=st.integers(0, BINS_EACH_SIDE)),
        arrays(np.bool_, (count, *SHAPE), elements=st.sampled_from([True, True, True, True, False])),
    )
)


@settings(deadline=None)
@given(still_scenes)
def test_dmax_is_the_first_bin_of_weight_of_the_full_histogram(
    scene: tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.bool_]],
) -> None:
    base, deviations, has_reading = scene
    frames = np.where(has_reading, base + deviations, KINECT_INVALID).astype(np.uint16)
    surface = calibrated(frames)
    least = max(1, round(CalibrationSettings().min_share * len(frames)))
    for v, u in np.ndindex(SHAPE):
        readings = [int(r) for r in frames[:, v, u] if r != KINECT_INVALID]
        enough = len(readings) >= len(frames) / 2 and bool(np.any(np.bincount(readings, minlength=1) > least))
        assert bool(surface.valid[v, u]) == enough
        if enough:
            assert surface.dmax[v, u] == naive_dmax(readings, least)
            np.testing.assert_allclose(surface.reference[v, u], np.mean(readings), atol=1e-3)
            np.testing.assert_allclose(surface.noise[v, u], np.std(readings), atol=5e-3)


@settings(deadline=None, max_examples=30)
@given(still_scenes)
def test_the_order_of_frames_over_a_still_surface_does_not_matter(
    scene: tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.bool_]],
) -> None:
    base, deviations, has_reading = scene
    frames = np.where(has_reading, base + deviations, KINECT_INVALID).astype(np.uint16)
    one, other = calibrated(frames), calibrated(frames[::-1])
    np.testing.assert_array_equal(one.valid, other.valid)
    np.testing.assert_array_equal(one.dmax[one.valid], other.dmax[one.valid])
