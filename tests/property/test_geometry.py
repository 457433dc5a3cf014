import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.geometry import (
    depth_mm,
    depth_of,
    distort,
    distort_pixel,
    fit_plane,
    kinect_v1_sensor,
    map_area,
    millimetre_sensor,
    project_ideal,
    raw_of_depth,
    rays,
    undistort,
)
from touchd.model import AreaCorners, Intrinsics

# Up to about 2.5 % at the picture's edge, either way.
lenses = st.builds(
    Intrinsics,
    fx=st.floats(500, 650),
    fy=st.floats(500, 650),
    cx=st.floats(300, 340),
    cy=st.floats(220, 260),
    k1=st.floats(-0.06, 0.06),
    k2=st.floats(-0.02, 0.02),
)
pixels = st.tuples(st.floats(0, 639), st.floats(0, 479))


@settings(deadline=None)
@given(lenses, pixels)
def test_distorting_an_undistorted_pixel_gives_the_pixel_back(lens: Intrinsics, pixel: tuple[float, float]) -> None:
    np.testing.assert_allclose(distort(lens, undistort(lens, np.array(pixel))), pixel, atol=1e-4)


@settings(deadline=None)
@given(lenses, pixels)
def test_one_pixel_is_distorted_as_many_are(lens: Intrinsics, pixel: tuple[float, float]) -> None:
    np.testing.assert_allclose(distort_pixel(lens, *pixel), distort(lens, np.array(pixel)), atol=1e-9)


@settings(deadline=None)
@given(lenses, pixels, st.floats(400, 3000))
def test_a_point_seen_at_a_pixel_projects_to_where_that_pixel_is_without_the_lens(
    lens: Intrinsics, pixel: tuple[float, float], z_mm: float
) -> None:
    point = rays(lens, np.array(pixel)) * z_mm
    assert point[2] == z_mm
    np.testing.assert_allclose(project_ideal(lens, point), undistort(lens, np.array(pixel)), atol=1e-6)


@settings(deadline=None)
@given(st.floats(0, 1080))
def test_kinect_shift_to_millimetres_and_back(raw: float) -> None:
    sensor = kinect_v1_sensor()
    z_mm = depth_mm(sensor, np.array([raw]))
    np.testing.assert_allclose(raw_of_depth(sensor, z_mm), [raw], atol=1e-3)
    np.testing.assert_allclose(depth_of(sensor, raw), z_mm[0])


@given(st.integers(1, 65535))
def test_millimetres_are_themselves(raw: int) -> None:
    sensor = millimetre_sensor("depth-mm", (640, 480), Intrinsics(500, 500, 319.5, 239.5), noise_mm=1.0)
    assert depth_mm(sensor, np.array([raw]))[0] == raw
    assert raw_of_depth(sensor, np.array([float(raw)]))[0] == raw


corners = st.tuples(
    st.tuples(st.floats(0, 250), st.floats(0, 180)),
    st.tuples(st.floats(390, 639), st.floats(0, 180)),
    st.tuples(st.floats(390, 639), st.floats(300, 479)),
    st.tuples(st.floats(0, 250), st.floats(300, 479)),
)


@settings(deadline=None)
@given(lenses, corners)
def test_the_area_s_corners_as_seen_are_the_corners_of_its_coordinates(
    lens: Intrinsics, seen: tuple[tuple[float, float], ...]
) -> None:
    area = map_area(AreaCorners((seen[0], seen[1], seen[2], seen[3])), lens, (600.0, 400.0))
    found = [area.of_ideal_pixel(u, v) for u, v in undistort(lens, np.array(seen)).tolist()]
    np.testing.assert_allclose(np.array(found), np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), atol=2e-4)


@settings(deadline=None)
@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(500, 2000), st.integers(0, 2**31))
def test_the_plane_through_points_of_a_plane_is_that_plane_despite_a_tenth_of_outliers(
    slope_x: float, slope_y: float, z_mm: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    directions = np.column_stack([rng.uniform(-0.5, 0.5, (300, 2)), np.ones(300)])
    normal = np.array([slope_x, slope_y, -1.0]) / np.linalg.norm([slope_x, slope_y, 1.0])
    distance = -z_mm * normal[2]
    points = directions * (distance / (directions @ -normal))[:, None]
    points[:30] *= rng.uniform(0.6, 0.9, (30, 1))
    plane = fit_plane(points)
    assert plane is not None
    np.testing.assert_allclose(plane.normal, normal, atol=1e-6)
    np.testing.assert_allclose(plane.distance_mm, distance, rtol=1e-6)
