"""What the renderer knows of a living surface: knocked cameras, wrong readings, things that lean, arms that rest."""

from math import cos, radians, sin, tan

import numpy as np
import pytest
from touchd.geometry import KINECT_SIZE, rays
from touchd.table.anatomy import Build
from touchd.table.body import Sleeve, with_arm
from touchd.table.misreading import Misreading, uneven
from touchd.table.postures import WRITING, Aim, pose
from touchd.table.render import DepthRenderer
from touchd.table.scene import Block, Capsule, Hand, TableCamera
from touchd.table.sensor_stereo import StereoModel
from touchd.table.table import SensorModel, Table

CAMERA = TableCamera(900.0, 8.0, -5.0)
KNOCKED = TableCamera(900.0, 8.0, -5.0, knocked_deg=(0.5, -0.3))


def test_a_knock_turns_the_camera_on_the_spot() -> None:
    assert np.allclose(KNOCKED.eye_mm(), CAMERA.eye_mm())
    axes = KNOCKED.axes()
    assert np.allclose(axes @ axes.T, np.eye(3))


def test_what_was_in_the_middle_is_to_the_left_after_a_turn_to_the_right_and_above_after_one_down() -> None:
    u, v = TableCamera(900.0, knocked_deg=(0.5, 0.0)).pixels(np.zeros(3)).tolist()
    assert (u, v) == pytest.approx((319.5 - 575.8 * tan(radians(0.5)), 239.5))
    u, v = TableCamera(900.0, knocked_deg=(0.0, 0.5)).pixels(np.zeros(3)).tolist()
    assert (u, v) == pytest.approx((319.5, 239.5 - 575.8 * tan(radians(0.5))))


def test_the_table_under_a_knocked_camera_is_still_the_same_table() -> None:
    depth = DepthRenderer(KNOCKED, KINECT_SIZE).table_mm.astype(np.float64)
    u, v = np.meshgrid(np.arange(0.0, 640.0, 91.0), np.arange(0.0, 480.0, 91.0))
    points = rays(KNOCKED.intrinsics, np.stack([u, v], -1)) * depth[::91, ::91, None]
    on_table = (points - KNOCKED.origin_mm()) @ KNOCKED.axes().T
    assert np.abs(on_table[..., 2]).max() < 0.01


def test_hands_are_seen_where_a_knocked_camera_sees_their_place() -> None:
    ball = Capsule((60.0, -40.0, 30.0), (60.0, -40.0, 31.0), 15.0, 15.0)
    renderer = DepthRenderer(KNOCKED, KINECT_SIZE)
    rise = renderer.table_mm - renderer.render([Hand((ball,), ())]).depth_mm
    rows, columns = np.nonzero(rise > 20.0)
    assert (columns.mean(), rows.mean()) == pytest.approx(KNOCKED.pixels(np.array([60.0, -40.0, 30.0])), abs=1.0)


def test_a_block_that_leans_back_keeps_its_base_and_its_size() -> None:
    block = Block((10.0, 20.0, 5.0), (300.0, 6.0, 200.0), 30.0, -20.0)
    corners = block.corners_mm()
    low, high = corners[corners[:, 2].argsort()][:4], corners[corners[:, 2].argsort()][4:]
    assert np.allclose(low.mean(0), [10.0, 20.0, 5.0])
    back = np.array([sin(radians(30.0)), -cos(radians(30.0)), 0.0])  # away from where the second side points
    rise = high.mean(0) - low.mean(0)
    assert np.allclose(rise, 200.0 * (cos(radians(20.0)) * np.array([0.0, 0.0, 1.0]) + sin(radians(20.0)) * back))


@pytest.mark.parametrize("model", [None, StereoModel()])
def test_readings_are_off_by_what_they_are_said_to_be(model: SensorModel | None) -> None:
    table = Table(CAMERA, 3, model)
    off = np.full((480, 640), 4.0, np.float32)
    right, wrong = (
        table.render((), 0, 5, misreading).raw.astype(np.float64) for misreading in (Misreading(), Misreading(off))
    )
    both = (right != table.sensor.invalid) & (wrong != table.sensor.invalid)
    assert float((wrong - right)[both].mean()) == pytest.approx(4.0, abs=0.02)


def test_readings_get_drowned_in_patches_that_stay_and_none_is_left_in_glaring_light() -> None:
    table = Table(CAMERA, 3)
    half, next_half, glare = (
        table.render((), 0, index, Misreading(drowned=share)).raw == table.sensor.invalid
        for index, share in ((5, 0.5), (6, 0.5), (7, 0.998))
    )
    assert half.mean() == pytest.approx(0.5, abs=0.08)
    assert (half == next_half).mean() > 0.8
    assert (half[:, 1:] == half[:, :-1]).mean() > 0.6
    assert glare.mean() > 0.99


def test_a_frame_with_nothing_wrong_is_the_frame_as_it_was() -> None:
    table = Table(CAMERA, 3)
    assert np.array_equal(table.render((), 0, 5).raw, table.render((), 0, 5, Misreading()).raw)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_uneven_field_is_one_in_the_mean_and_differs_by_the_share_that_is_given(seed: int) -> None:
    field = uneven(KINECT_SIZE, 0.15, np.random.default_rng(seed))
    assert field.shape == (480, 640)
    assert float(field.mean()) == pytest.approx(1.0, abs=1e-3)
    assert float(np.abs(field - 1.0).max()) == pytest.approx(0.15, abs=1e-4)
    assert float(np.abs(np.diff(field, axis=1)).max()) < 0.01


@pytest.mark.parametrize("sleeve", [None, Sleeve(0.3)])
def test_an_arm_that_rests_lies_on_the_table_with_its_elbow(sleeve: Sleeve | None) -> None:
    build = Build()
    held = pose(build, WRITING, Aim(0.0, 40.0, ((0.0, 0.0, 7.0),), (0.0, 0.0), 0.0))
    arm = with_arm(held, build, (100.0, 1200.0), 350.0, sleeve, elbow_mm=0.0).solids[len(held.solids) :]
    lowest = [min(s.a_mm[2] - s.radius_a_mm, s.b_mm[2] - s.radius_b_mm) for s in arm if isinstance(s, Capsule)]
    assert min(lowest) == pytest.approx(0.0, abs=0.5)
