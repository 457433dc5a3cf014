import numpy as np
import pytest
from touchd.geometry import (
    KINECT_INVALID,
    Doubles,
    ZeroPlane,
    depth_mm,
    kinect_v1_sensor,
    map_area,
    map_surface,
    measured_size_mm,
    raw_of_depth,
    rays,
    whole_picture,
)
from touchd.model import AreaCorners, Intrinsics, Sensor, Surface

LENS = Intrinsics(580.0, 580.0, 319.5, 239.5)
SENSOR = kinect_v1_sensor(intrinsics=LENS)


def surface_at(z_mm: Doubles, sensor: Sensor = SENSOR) -> Surface:
    reference = raw_of_depth(sensor, z_mm)
    everywhere = np.ones(z_mm.shape, bool)
    return Surface(
        sensor=sensor,
        reference=reference.astype(np.float32),
        dmax=np.floor(reference).astype(np.uint16),
        noise=np.full(z_mm.shape, 0.2, np.float32),
        valid=everywhere,
        moved=~everywhere,
        frames=1,
        made_from="a test",
    )


def tilted_plane(tilt_rad: float, distance_mm: float) -> tuple[Doubles, Doubles]:
    v, u = np.mgrid[0:480, 0:640].astype(float)
    directions = rays(LENS, np.stack([u, v], axis=-1))
    normal = np.array([0.0, np.sin(tilt_rad), -np.cos(tilt_rad)])
    return distance_mm / (directions @ -normal), normal


@pytest.mark.parametrize(("raw", "z_mm"), [(600, 705.9), (628.8, 750.1), (859.1, 1500.2)])
def test_the_usual_constants_give_345489_over_1089_minus_raw(raw: float, z_mm: float) -> None:
    assert depth_mm(SENSOR, np.array([raw]))[0] == pytest.approx(345489 / (1089.41 - raw), rel=1e-4)
    assert depth_mm(SENSOR, np.array([raw]))[0] == pytest.approx(z_mm, rel=1e-3)


def test_one_raw_step_is_the_square_of_the_distance_over_345489() -> None:
    z_mm = SENSOR.to_mm[628]
    assert SENSOR.step_mm[628] == pytest.approx(z_mm * z_mm / 345489, rel=1e-4)


def test_no_reading_and_shifts_beyond_infinity_have_no_depth() -> None:
    depths = depth_mm(SENSOR, np.array([KINECT_INVALID, 1090, 2046, 1089]))
    assert np.isnan(depths[:3]).all()
    assert np.isfinite(depths[3])


def test_another_unit_s_constants_move_its_depths() -> None:
    nearer = kinect_v1_sensor(ZeroPlane(reference_distance_cm=110.0))
    assert depth_mm(nearer, np.array([628]))[0] == pytest.approx(depth_mm(SENSOR, np.array([628]))[0] * 110 / 120)


def test_a_floor_beside_the_table_does_not_pull_the_table_s_plane() -> None:
    z_mm, normal = tilted_plane(np.radians(10), 800.0)
    z_mm[:, :130] += 700.0
    z_mm[:, 510:] += 700.0
    plane = map_surface(surface_at(z_mm)).plane
    assert plane is not None
    np.testing.assert_allclose(plane.normal, normal, atol=1e-3)
    assert plane.distance_mm == pytest.approx(800.0, abs=0.5)


@pytest.mark.parametrize("tilt_deg", [0, 15, 35])
def test_the_foot_of_a_point_above_a_tilted_surface_is_under_it_along_the_normal(tilt_deg: int) -> None:
    z_mm, normal = tilted_plane(np.radians(tilt_deg), 800.0)
    surface_map = map_surface(surface_at(z_mm))
    seen = np.array([[100.0, 90.0], [560.3, 400.7], [319.5, 239.5]])
    directions = rays(LENS, seen)
    on_surface = directions * (800.0 / (directions @ -normal))[:, None]
    points = directions * (on_surface[:, 2:] - 12.0)
    feet = [surface_map.foot(u, v, 12.0) for u, v in seen.tolist()]
    expected_heights = points @ normal + 800.0
    np.testing.assert_allclose([foot.height_mm for foot in feet], expected_heights, atol=0.05)
    np.testing.assert_allclose(
        [(foot.x_mm, foot.y_mm, foot.z_mm) for foot in feet], points - expected_heights[:, None] * normal, atol=0.3
    )


def test_the_foot_on_a_book_is_on_the_book() -> None:
    z_mm = np.full((480, 640), 800.0)
    z_mm[150:330, 200:440] = 770.0
    surface_map = map_surface(surface_at(z_mm))
    for u, v in ((320.0, 240.0), (210.0, 160.0)):
        foot = surface_map.foot(u, v, 10.0)
        assert foot.z_mm == pytest.approx(770.0, abs=0.5)
        assert foot.height_mm == pytest.approx(10.0, abs=0.3)
    np.testing.assert_allclose(surface_map.normals[240, 320], [0, 0, -1], atol=0.01)


def test_the_best_plane_s_tilt_and_distance_are_those_of_the_surface() -> None:
    z_mm, normal = tilted_plane(np.radians(20), 900.0)
    plane = map_surface(surface_at(z_mm)).plane
    assert plane is not None
    np.testing.assert_allclose(plane.normal, normal, atol=1e-3)
    assert plane.distance_mm == pytest.approx(900.0, abs=0.5)


def test_the_whole_picture_as_area_is_u_and_v_over_the_last_pixel() -> None:
    area = map_area(whole_picture(SENSOR), LENS, (1.0, 1.0))
    for u, v, x, y in ((0.0, 0.0, 0.0, 0.0), (639.0, 479.0, 1.0, 1.0), (159.75, 119.75, 0.25, 0.25)):
        assert area.of_ideal_pixel(u, v) == pytest.approx((x, y), abs=1e-6)


def test_the_area_s_size_is_measured_on_the_surface() -> None:
    surface_map = map_surface(surface_at(np.full((480, 640), 800.0)))
    corners = AreaCorners(((100.0, 100.0), (500.0, 100.0), (500.0, 400.0), (100.0, 400.0)))
    assert measured_size_mm(corners, surface_map) == pytest.approx((400 / 580 * 800, 300 / 580 * 800), rel=1e-3)
