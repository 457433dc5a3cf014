import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from touchd.geometry import Doubles, rays, undistort
from touchd.model import Intrinsics
from touchd.table.crowd import contact_scene
from touchd.table.hands import TIP_RADIUS_MM, HandPose, open_hand, pointing_hand
from touchd.table.render import DepthRenderer
from touchd.table.scene import Area, Capsule, Hand, Solid, Sphere, TableCamera, area_corners_px
from touchd.table.truth import tip_truth

SIZE = (640, 480)
STRAIGHT_DOWN = TableCamera(900.0)
CENTRED = TableCamera(900.0, intrinsics=Intrinsics(575.8, 575.8, 320.0, 240.0))
SMALL = (64, 48)
SMALL_LENS = Intrinsics(60.0, 60.0, 31.5, 23.5, k1=-0.12, k2=0.05)
SMALL_CAMERA = TableCamera(700.0, 14.0, -9.0, SMALL_LENS)


def seen(camera: TableCamera, *solids: Solid) -> Doubles:
    return DepthRenderer(camera, SIZE).render([Hand(solids, ())]).depth_mm.astype(np.float64)


def all_rays(camera: TableCamera, size: tuple[int, int]) -> Doubles:
    u, v = np.meshgrid(np.arange(size[0], dtype=np.float64), np.arange(size[1], dtype=np.float64))
    return rays(camera.intrinsics, np.stack([u, v], -1))


def test_the_table_seen_straight_is_equally_deep_everywhere() -> None:
    assert np.allclose(seen(STRAIGHT_DOWN), 900.0, atol=1e-3)


def test_a_tilted_table_follows_the_planes_equation_and_is_nearer_below() -> None:
    camera = TableCamera(1500.0, tilt_deg=20.0)
    depth = seen(camera)
    y = all_rays(camera, SIZE)[..., 1]
    tilt = np.radians(20.0)
    assert np.allclose(depth, 1500.0 * np.cos(tilt) / (np.cos(tilt) + y * np.sin(tilt)), atol=0.01)
    assert depth[479, 320] < depth[0, 320]


def test_roll_turns_the_table_clockwise_in_the_picture() -> None:
    right = TableCamera(900.0, roll_deg=10.0).pixels(np.array([100.0, 0.0, 0.0]))
    assert right[0] > 319.5
    assert right[1] > 239.5


def test_where_rays_pass_over_the_table_there_is_no_depth() -> None:
    depth = seen(TableCamera(900.0, tilt_deg=80.0))
    assert np.isinf(depth[0, 320])
    assert np.isfinite(depth[479, 320])


def test_a_ball_is_met_at_its_top_and_nowhere_beside_it() -> None:
    depth = seen(CENTRED, Sphere((0.0, 0.0, 50.0), 20.0))
    assert depth[240, 320] == pytest.approx(900.0 - 70.0, abs=0.01)
    rim_px = 575.8 * 20.0 / np.sqrt(850.0**2 - 20.0**2)
    assert depth[240, 320 + int(rim_px)] < 860.0
    assert depth[240, 320 + int(rim_px) + 2] == pytest.approx(900.0, abs=0.01)


def test_a_lying_capsule_is_met_where_the_circle_of_its_section_is() -> None:
    depth = seen(STRAIGHT_DOWN, Capsule((-80.0, 0.0, 40.0), (80.0, 0.0, 40.0), 12.0, 12.0))
    y = all_rays(STRAIGHT_DOWN, SIZE)[233:246, 320, 1]
    square, half, rest = 1.0 + y * y, 860.0, 860.0**2 - 12.0**2
    expected = (half - np.sqrt(half * half - square * rest)) / square
    assert np.allclose(depth[233:246, 320], expected, atol=0.02)


def test_a_capsule_whose_one_end_holds_the_other_is_a_ball() -> None:
    depth = seen(STRAIGHT_DOWN, Capsule((0.0, 0.0, 60.0), (3.0, 0.0, 60.0), 5.0, 30.0))
    assert np.array_equal(depth, seen(STRAIGHT_DOWN, Sphere((3.0, 0.0, 60.0), 30.0)))


def test_a_capsule_that_reaches_behind_the_camera_hides_what_it_passes() -> None:
    depth = seen(STRAIGHT_DOWN, Capsule((0.0, 60.0, 300.0), (0.0, 60.0, 1500.0), 30.0, 30.0))
    assert depth[300, 320] < 700.0
    assert depth[0, 0] == pytest.approx(900.0, abs=0.01)


coordinates = st.floats(-250.0, 250.0)
points = st.tuples(coordinates, coordinates, st.floats(0.0, 300.0))
radii = st.floats(6.0, 50.0)


@settings(deadline=None, max_examples=30)
@given(points, points, radii, radii)
@example((0.0, 0.0, 0.0), (0.0, 0.0, 1e-102), 6.0, 6.0)
def test_any_capsule_looks_like_the_many_balls_it_is_made_of(
    a: tuple[float, float, float], b: tuple[float, float, float], radius_a: float, radius_b: float
) -> None:
    renderer = DepthRenderer(SMALL_CAMERA, SMALL)
    depth = renderer.render([Hand((Capsule(a, b, radius_a, radius_b),), ())]).depth_mm
    ray = all_rays(SMALL_CAMERA, SMALL)[..., None, :]
    share = np.linspace(0.0, 1.0, 300)[:, None]
    centres = SMALL_CAMERA.to_camera(np.array(a) * (1.0 - share) + np.array(b) * share)
    radius = (radius_a + (radius_b - radius_a) * share)[:, 0]
    square, half = np.sum(ray * ray, -1), np.sum(ray * centres, -1)
    inside = half * half - square * (np.sum(centres * centres, -1) - radius * radius)
    with np.errstate(invalid="ignore"):
        balls = np.where(inside > 0.0, (half - np.sqrt(inside)) / square, np.inf).min(-1)
    expected = np.minimum(balls, renderer.table_mm)
    clear = np.abs(inside).min(-1) > 3000.0  # near the rim a hair decides between hit and miss
    assert np.allclose(depth[clear], expected[clear], atol=0.1)


@settings(deadline=None, max_examples=30)
@given(st.floats(-200.0, 200.0), st.floats(-150.0, 150.0))
def test_the_touch_point_is_seen_where_the_ray_of_its_pixel_meets_the_table(x_mm: float, y_mm: float) -> None:
    foot = np.array([x_mm, y_mm, 0.0])
    camera = TableCamera(800.0, 20.0, 5.0, Intrinsics(580.0, 575.0, 320.0, 241.0, k1=-0.1, k2=0.03))
    ray = rays(camera.intrinsics, camera.pixels(foot))
    point = camera.to_camera(foot)
    assert np.allclose(ray * point[2], point, atol=1e-6)


def test_a_touching_fingers_ball_rests_on_the_table_right_over_its_touch_point() -> None:
    for hand in (pointing_hand(HandPose((40.0, -30.0), pitch_deg=50.0)), open_hand(HandPose((40.0, -30.0)))):
        balls = {solid.a_mm for solid in hand.solids if isinstance(solid, Capsule)}
        for fingertip in hand.fingertips:
            assert (*fingertip.at_mm, TIP_RADIUS_MM) in balls


def test_the_finger_over_its_foot_is_as_high_as_its_thickness_and_slope_say() -> None:
    renderer = DepthRenderer(CENTRED, SIZE)
    hand = pointing_hand(HandPose((0.0, 0.0), pitch_deg=40.0))
    rise = renderer.table_mm - renderer.render([hand]).depth_mm
    u, v = 320, 240
    last_bone = np.radians(48.0)  # a pressing finger's last bone is 8 degrees steeper than the finger
    assert rise[v, u] == pytest.approx(TIP_RADIUS_MM * (1.0 + 1.0 / np.cos(last_bone)), abs=0.4)
    end_px = TIP_RADIUS_MM / 900.0 * 575.8
    column = rise[: v + 1, u]
    assert v - np.flatnonzero(column > 0.5)[0] == pytest.approx(end_px, abs=1.0)


@pytest.mark.parametrize("pitch_deg", [15.0, 25.0, 40.0, 60.0])
def test_nothing_but_the_pointing_finger_comes_near_the_table(pitch_deg: float) -> None:
    hand = pointing_hand(HandPose((0.0, 0.0), pitch_deg=pitch_deg, heading_deg=70.0, left=True))
    others = [solid for solid in hand.solids[3:] if isinstance(solid, Capsule)]
    assert min(solid.a_mm[2] - solid.radius_a_mm for solid in others) >= 13.9
    assert min(solid.b_mm[2] - solid.radius_b_mm for solid in others) >= 13.9


def test_a_hand_lifts_off_with_its_clearance() -> None:
    down = pointing_hand(HandPose((0.0, 0.0)))
    up = pointing_hand(HandPose((0.0, 0.0), clearance_mm=20.0))
    heights = [
        high.a_mm[2] - low.a_mm[2]
        for low, high in zip(down.solids, up.solids, strict=True)
        if isinstance(low, Capsule) and isinstance(high, Capsule)
    ]
    assert np.allclose(heights, 20.0)
    assert up.fingertips[0].clearance_mm == 20.0


def test_a_left_hand_mirrors_a_right_one() -> None:
    right = open_hand(HandPose((0.0, 0.0)))
    left = open_hand(HandPose((0.0, 0.0), left=True))
    mirrored = [(-tip.at_mm[0], tip.at_mm[1]) for tip in right.fingertips]
    assert np.allclose([tip.at_mm for tip in left.fingertips], mirrored)


def test_an_arm_reaches_the_border_of_the_picture_on_the_side_it_comes_from() -> None:
    renderer = DepthRenderer(TableCamera(1500.0), SIZE)
    for heading_deg, border in ((0.0, np.s_[479, :]), (180.0, np.s_[0, :]), (90.0, np.s_[:, 0])):
        depth = renderer.render([pointing_hand(HandPose((0.0, 0.0), heading_deg=heading_deg))]).depth_mm
        assert (depth[border] < renderer.table_mm[border] - 20.0).any()


def test_truth_agrees_with_the_homography_of_the_areas_undistorted_corners() -> None:
    lens = Intrinsics(580.0, 580.0, 319.5, 239.5, k1=-0.15, k2=0.04)
    camera = TableCamera(750.0, 20.0, -4.0, lens)
    area = Area((10.0, -20.0), (500.0, 350.0))
    corners = undistort(lens, area_corners_px(camera, area)).astype(np.float32)
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    homography = cv2.getPerspectiveTransform(corners, unit)
    for x, y in ((0.1, 0.9), (0.5, 0.5), (0.77, 0.23)):
        fingertip = pointing_hand(HandPose(area.at(x, y))).fingertips[0]
        pixel = undistort(lens, camera.pixels(np.array([*fingertip.at_mm, 0.0])))
        found = homography @ np.array([*pixel, 1.0])
        truth = tip_truth(area, fingertip, 1)
        assert (truth.x, truth.y) == pytest.approx((x, y), abs=1e-9)
        assert found[:2] / found[2] == pytest.approx((x, y), abs=1e-5)


def test_area_corners_come_in_the_order_of_the_config() -> None:
    corners = area_corners_px(STRAIGHT_DOWN, Area((0.0, 0.0), (400.0, 300.0)))
    middle = corners.mean(0)
    assert [tuple(np.sign(corner - middle)) for corner in corners] == [(-1, -1), (1, -1), (1, 1), (-1, 1)]


@pytest.mark.parametrize("count", [0, 1, 10, 13, 30])
def test_a_contact_scene_spreads_its_fingertips_over_the_area(count: int) -> None:
    area = Area((0.0, 0.0), (600.0, 420.0))
    tips = [tip for hand in contact_scene(count, area) for tip in hand.fingertips]
    truth = [tip_truth(area, tip, 1) for tip in tips]
    assert len(tips) == count
    assert all(entry.touching and 0.0 < entry.x < 1.0 and 0.0 < entry.y < 1.0 for entry in truth)
    places = np.array([tip.at_mm for tip in tips]).reshape(-1, 2)
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) + 1e3 * np.eye(count)
    assert count < 2 or apart.min() > 2.0 * TIP_RADIUS_MM


def test_no_hand_of_a_contact_scene_hides_anothers_fingertip() -> None:
    area = Area((0.0, 0.0), (600.0, 420.0))
    camera = TableCamera(821.0, 5.0)
    renderer = DepthRenderer(camera, SIZE)
    hands = contact_scene(30, area)
    together = renderer.render(hands).depth_mm
    for hand in hands:
        alone = renderer.render([hand]).depth_mm
        for tip in hand.fingertips:
            u, v = camera.pixels(np.array([*tip.at_mm, 0.0])).round().astype(int)
            assert together[v, u] == alone[v, u]


def test_an_area_too_small_for_so_many_hands_is_refused_with_the_size_it_takes() -> None:
    with pytest.raises(ValueError, match="contact_scene: 30 fingertips") as caught:
        contact_scene(30, Area((0.0, 0.0), (200.0, 150.0)))
    assert str(caught.value) == (
        "contact_scene: 30 fingertips need an area of at least 270 x 156 mm, "
        "but it is 200 x 150 mm: ask for fewer or give a larger area"
    )
