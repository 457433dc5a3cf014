from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from touchd.formats.png_folder import write_png_folder
from touchd.formats.recording import open_recording
from touchd.formats.resolution import measure_noise_mm, measure_step_mm
from touchd.model import Frame, Image16

KINECT_MM2 = 345489.0


def kinect_in_mm(depth_mm: NDArray[np.float64]) -> list[Image16]:
    """Five pictures of a Kinect v1 (noise 0.22, fixed pattern 0.4 raw) in whole millimetres."""
    rng = np.random.default_rng(7)
    ideal = 1089.41 - KINECT_MM2 / depth_mm + rng.normal(0, 0.4, depth_mm.shape)
    shifts = [np.round(ideal + rng.normal(0, 0.22, depth_mm.shape)) for _ in range(5)]
    return [np.round(KINECT_MM2 / (1089.41 - shift)).astype(np.uint16) for shift in shifts]


def slope_mm(near_mm: float, far_mm: float) -> NDArray[np.float64]:
    return np.linspace(near_mm, far_mm, 480 * 640).reshape(480, 640)


def test_the_step_of_a_kinect_in_millimetres_is_found_at_every_depth_it_saw() -> None:
    step_mm = measure_step_mm(kinect_in_mm(slope_mm(600, 4000)))
    for depth_mm in range(700, 4000, 100):
        assert step_mm[depth_mm] == pytest.approx(depth_mm**2 / KINECT_MM2, rel=0.05)


def test_the_step_is_carried_by_the_square_of_depth_to_where_nothing_was_seen() -> None:
    seen = np.where(np.arange(640) < 320, 800.0, 2500.0) + np.linspace(0, 60, 480)[:, np.newaxis]
    step_mm = measure_step_mm(kinect_in_mm(seen))
    for depth_mm in (700, 1500, 4000):
        assert step_mm[depth_mm] == pytest.approx(depth_mm**2 / KINECT_MM2, rel=0.12)
    assert step_mm[400] == 1.0


def test_the_noise_of_a_kinect_in_millimetres_is_found_though_most_pixels_hold_still() -> None:
    pictures = kinect_in_mm(slope_mm(1400, 1600))
    assert np.median(np.abs(pictures[1].astype(int) - pictures[0])) == 0
    noise_mm = measure_noise_mm(pictures, measure_step_mm(pictures))
    assert noise_mm == pytest.approx(0.22 * 1500**2 / KINECT_MM2, rel=0.05)


@pytest.mark.parametrize("far_mm", [702.0, 1300.0])
def test_a_gaussian_camera_in_whole_millimetres_has_a_step_of_one_and_its_own_noise(far_mm: float) -> None:
    rng = np.random.default_rng(5)
    scene = slope_mm(700, far_mm)
    pictures = [np.round(scene + rng.normal(0, 1.1, scene.shape)).astype(np.uint16) for _ in range(5)]
    step_mm = measure_step_mm(pictures)
    assert (step_mm == 1.0).all()
    assert measure_noise_mm(pictures, step_mm) == pytest.approx(1.1, rel=0.03)


def test_a_hand_that_passes_does_not_count_as_noise() -> None:
    pictures = kinect_in_mm(slope_mm(1400, 1600))
    step_mm = measure_step_mm(pictures)
    still = measure_noise_mm(pictures, step_mm)
    pictures[2][100:200, 100:300] -= 200
    assert measure_noise_mm(pictures, step_mm) == pytest.approx(still, rel=0.02)


def test_a_camera_that_never_wavers_has_the_least_noise_and_a_step_of_one() -> None:
    pictures = [np.full((480, 640), 800, np.uint16)] * 3
    step_mm = measure_step_mm(pictures)
    assert (step_mm == 1.0).all()
    assert measure_noise_mm(pictures, step_mm) == 0.3


def test_objects_at_far_apart_depths_are_no_step() -> None:
    pictures = [np.where(np.arange(640) < 320, 700, 760).astype(np.uint16)[np.newaxis].repeat(480, axis=0)]
    assert (measure_step_mm(pictures) == 1.0).all()


def test_neither_stray_values_nor_missing_readings_hide_the_step() -> None:
    pictures = kinect_in_mm(slope_mm(1400, 1600))
    pictures[0][200, :400] = np.random.default_rng(9).integers(1400, 1600, 400)
    pictures[0][300, :200] = 0
    pictures[0][301, :200] = 1
    step_mm = measure_step_mm(pictures)
    for depth_mm in (1000, 1500, 2000):
        assert step_mm[depth_mm] == pytest.approx(depth_mm**2 / KINECT_MM2, rel=0.05)


def test_depths_that_the_scene_leaves_out_do_not_widen_the_step() -> None:
    pictures = kinect_in_mm(slope_mm(1400, 1600))
    values = np.unique(pictures[0])
    for picture in pictures:
        picture[np.isin(picture, values[3::5])] = 0
    assert measure_step_mm(pictures)[1500] == pytest.approx(6.51, rel=0.03)


def test_a_sparsely_seen_depth_does_not_look_coarse() -> None:
    rng = np.random.default_rng(11)
    picture = np.round(slope_mm(700, 800)).astype(np.uint16)
    picture[:40] = rng.integers(2500, 4500, (40, 640))
    assert (measure_step_mm([picture]) == 1.0).all()


def test_step_and_noise_are_measured_on_the_first_five_pictures_alone(tmp_path: Path) -> None:
    pictures = kinect_in_mm(slope_mm(1400, 1600))
    wild = np.random.default_rng(3).integers(1400, 1600, (480, 640)).astype(np.uint16)
    write_png_folder(tmp_path, (Frame(i, i * 33_000_000, p) for i, p in enumerate([*pictures, wild])))
    sensor = open_recording(tmp_path).sensor
    assert abs(float(sensor.step_mm[1500]) - 6.51) < 0.2
    assert abs(sensor.noise - 0.22 * 6.51) < 0.15
