from dataclasses import replace

import numpy as np
import pytest
from touchd.errors import CalibrationError
from touchd.geometry import KINECT_INVALID, kinect_v1_sensor, millimetre_sensor
from touchd.model import Intrinsics, Sensor, Surface
from touchd.surface.calibrate import Calibration
from touchd.surface.settings import CalibrationSettings, ShellSettings
from touchd.surface.shell import shell_over

SIZE = (8, 6)
SENSOR = replace(kinect_v1_sensor(), size=SIZE)
MM_SENSOR = millimetre_sensor("depth-mm", SIZE, Intrinsics(500.0, 500.0, 3.5, 2.5), noise_mm=1.1)


def picture(value: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint16]]:
    return np.full((SIZE[1], SIZE[0]), value, np.uint16)


def surface_of(values: list[int], sensor: Sensor = SENSOR) -> Surface:
    calibration = Calibration(sensor, CalibrationSettings(frames=len(values)), "a test")
    for value in values:
        calibration.add(picture(value))
    return calibration.surface_so_far()


def test_a_value_that_flickers_by_once_is_not_yet_the_surface() -> None:
    assert np.all(surface_of([700] * 98 + [697] + [701]).dmax == 700)


def test_a_value_that_comes_back_is_part_of_the_surface() -> None:
    assert np.all(surface_of([700] * 96 + [699] * 4).dmax == 699)


def test_a_hand_that_leaves_in_the_first_half_does_not_become_the_surface() -> None:
    surface = surface_of([600] * 20 + [700] * 80)
    assert np.all(np.abs(surface.reference - 700) < 0.01)
    assert np.all(surface.moved)
    assert not surface.valid.any()


def test_a_hand_that_flies_by_is_neither_surface_nor_masked() -> None:
    surface = surface_of([700] * 50 + [600] * 5 + [700] * 45)
    assert surface.valid.all()
    assert np.all(surface.dmax == 700)


def test_pixels_that_mostly_have_no_reading_are_masked() -> None:
    assert not surface_of([700] * 40 + [KINECT_INVALID] * 60).valid.any()


def test_a_picture_without_any_reading_gives_a_surface_without_any_valid_pixel() -> None:
    assert not surface_of([KINECT_INVALID] * 10).valid.any()


def test_a_frame_of_another_size_is_refused_with_both_sizes() -> None:
    calibration = Calibration(SENSOR, CalibrationSettings(), "a test")
    with pytest.raises(CalibrationError, match="a frame of 4x2 px came from a camera of 8x6 px"):
        calibration.add(np.zeros((2, 4), np.uint16))


def test_a_calibration_without_frames_is_refused() -> None:
    with pytest.raises(CalibrationError, match="no frame was seen"):
        Calibration(SENSOR, CalibrationSettings(), "a test").surface_so_far()


@pytest.mark.parametrize(("raw", "far_mm"), [(628, (14.5, 17.0)), (859, (19.0, 25.0))])
def test_the_automatic_shell_ends_about_16_mm_up_at_0_75_m_and_24_mm_at_1_5_m(
    raw: int, far_mm: tuple[float, float]
) -> None:
    shell = shell_over(surface_of([raw] * 100), ShellSettings())
    assert far_mm[0] <= shell.far_mm <= far_mm[1]


def test_the_shell_s_boundaries_in_millimetres_hold_for_raw_shift_and_for_millimetres() -> None:
    for sensor, value in ((SENSOR, 628), (MM_SENSOR, 750)):
        shell = shell_over(surface_of([value] * 100, sensor), ShellSettings(near_mm=3.0, far_mm=14.0))
        step_mm = float(sensor.step_mm[value])
        assert 3.0 <= shell.near_mm <= 3.0 + step_mm
        assert 14.0 - step_mm <= shell.far_mm <= 14.0


def test_delta_raw_is_the_paper_s_literal_thickness() -> None:
    shell = shell_over(surface_of([700] * 100), ShellSettings(delta_raw=4))
    assert np.all(shell.dmax == 700)
    assert np.all(shell.dmin == 696)


def test_nothing_is_ever_inside_the_shell_where_the_surface_is_not_known() -> None:
    shell = shell_over(surface_of([KINECT_INVALID] * 10), ShellSettings())
    assert not shell.dmax.any()
    assert not shell.dmin.any()


def test_a_sensor_in_millimetres_with_coarse_steps_gets_wide_bins() -> None:
    coarse = millimetre_sensor("depth-mm", SIZE, MM_SENSOR.intrinsics, noise_mm=1.4, step_mm=6.5)
    values = [1500, 1506, 1500, 1513, 1500, 1494, 1487] * 20
    surface = surface_of(values, coarse)
    assert surface.valid.all()
    assert np.all(surface.dmax <= 1487)
    assert np.all(surface.dmax >= 1480)
