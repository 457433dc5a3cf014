from itertools import pairwise

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from touchd.geometry import Doubles, kinect_v1_sensor, raw_of_depth
from touchd.model import Intrinsics
from touchd.table.boxes import Box, apart
from touchd.table.correlator import Correlator, Window, shadow
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.noise import Correlation, NoiseBank
from touchd.table.render import DepthRenderer
from touchd.table.scene import Capsule, Hand, Sphere, TableCamera
from touchd.table.sensor_kinect import KinectModel, KinectV1
from touchd.table.table import Table

INVALID = 2047
STILL_CAMERA = TableCamera(1170.0, 3.0, 1.0)
INNER = np.s_[20:460, 20:600]

Frames = NDArray[np.int64]


def frames(table: Table, count: int, *hands: Hand) -> Frames:
    return np.array([table.render(hands, i, i).raw for i in range(count)]).astype(np.int64)


def thing(*solids: Capsule | Sphere) -> Hand:
    return Hand(solids, ())


@pytest.fixture(scope="module")
def still() -> Frames:
    return frames(Table(STILL_CAMERA, 7), 60)


def kinect(model: KinectModel | None = None) -> KinectV1:
    sensor = kinect_v1_sensor()
    empty = DepthRenderer(STILL_CAMERA, sensor.size).empty
    return KinectV1(sensor, empty, model or KinectModel(), np.random.default_rng(3))


def correlation(pictures: Doubles, distance: int) -> float:
    """Mean over rows and columns of the correlation of pixels so far apart, pictures (N, H, W) of mean 0."""
    variance = float((pictures * pictures).mean())
    along = float((pictures[:, :, :-distance] * pictures[:, :, distance:]).mean())
    down = float((pictures[:, :-distance] * pictures[:, distance:]).mean())
    return (along + down) / 2.0 / variance


def without_plane(picture: Doubles) -> Doubles:
    v, u = np.mgrid[: picture.shape[0], : picture.shape[1]]
    basis = np.stack([u.ravel(), v.ravel(), np.ones(u.size)], -1).astype(np.float64)
    known = np.isfinite(picture).ravel()
    fit, *_ = np.linalg.lstsq(basis[known], picture.ravel()[known], rcond=None)
    flat: Doubles = picture - (basis @ fit).reshape(picture.shape)
    return flat


def mean_reading(readings: Frames) -> Doubles:
    known = readings != INVALID
    mean: Doubles = np.where(known, readings, 0).sum(0) / np.maximum(known.sum(0), 1)
    return mean


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not() -> None:
    hand = pointing_hand(HandPose((0.0, 0.0)))
    first, second, other = (frames(Table(STILL_CAMERA, seed), 3, hand) for seed in (1, 1, 2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
    assert not np.array_equal(first[0], first[1])


def test_a_frame_carries_its_time_and_index_and_cannot_be_changed() -> None:
    frame = Table(STILL_CAMERA, 1).render([], 33_000_000, 5)
    assert (frame.t_ns, frame.index, frame.raw.shape) == (33_000_000, 5, (480, 640))
    assert frame.raw.dtype == np.uint16
    assert not frame.raw.flags.writeable


def test_the_sensor_is_a_kinect_with_the_cameras_lens() -> None:
    lens = Intrinsics(580.0, 581.0, 318.0, 242.0, k1=-0.1)
    sensor = Table(TableCamera(900.0, intrinsics=lens), 1).sensor
    assert (sensor.kind, sensor.unit, sensor.intrinsics) == ("kinect-v1", "shift", lens)


def test_depth_becomes_raw_by_the_sensors_own_law() -> None:
    depth = np.linspace(460.0, 4000.0, 500)
    ours = kinect().raw_of_depth(depth.astype(np.float32))
    assert np.allclose(ours, raw_of_depth(kinect_v1_sensor(), depth), atol=0.002)


def test_still_pixels_spread_over_as_many_values_as_measured(still: Frames) -> None:
    known = (still != INVALID).all(0)
    spread = (still.max(0) - still.min(0))[known]
    shares = [(spread == steps).mean() for steps in range(4)]
    assert shares == pytest.approx([0.14, 0.63, 0.20, 0.03], abs=0.03)  # of 60 frames, where 150 were measured
    assert (still == np.median(still, 0)).mean(0)[known].mean() == pytest.approx(0.85, abs=0.06)


def test_noise_is_white_in_time_and_goes_together_in_space_as_measured() -> None:
    model = KinectModel()
    unit = kinect(model)
    rng = np.random.default_rng(0)
    noise = np.array([unit._noise * unit._bank.draw(rng) for _ in range(12)]).astype(np.float64)
    found = [correlation(noise, distance) for distance in (1, 2, 3, 4, 6)]
    assert found == pytest.approx([0.42, 0.29, 0.22, 0.17, 0.08], abs=0.03)
    in_time = (noise[:-1] * noise[1:]).mean() / (noise * noise).mean()
    assert in_time == pytest.approx(0.0, abs=0.02)
    assert np.median(unit._noise) == pytest.approx(0.22, abs=0.005)
    assert np.log(unit._noise).std() == pytest.approx(0.45, abs=0.01)


def test_the_fixed_pattern_is_as_strong_and_as_smooth_as_measured(still: Frames) -> None:
    pattern = without_plane(mean_reading(still)[INNER])
    assert 0.37 <= np.sqrt((pattern * pattern).mean()) <= 0.46
    found = [correlation(pattern[None], distance) for distance in (1, 2, 4)]
    assert found == pytest.approx([0.83, 0.68, 0.39], abs=0.05)


def test_the_fixed_pattern_wanders_with_the_dots_as_the_surface_comes_nearer() -> None:
    pictures = []
    for raw in (794.5, 778.5):
        height_mm = float(np.interp(raw, np.arange(2048), kinect_v1_sensor().to_mm))
        pictures.append(without_plane(mean_reading(frames(Table(TableCamera(height_mm), 7), 20))[INNER]))
    far, near = pictures
    alike = [float((far[:, 10:-10] * np.roll(near, shift, 1)[:, 10:-10]).mean()) for shift in range(-5, 6)]
    assert np.argmax(alike) - 5 == -2  # 16 raw steps nearer: the dots lie 2 px further right


def test_one_or_two_readings_in_a_thousand_are_lost_anywhere(still: Frames) -> None:
    assert 0.001 <= (still[:, :, :632] == INVALID).mean() <= 0.002


def test_the_eight_rightmost_columns_read_nothing(still: Frames) -> None:
    assert (still[:, :, 632:] == INVALID).all()
    assert (still[:, :, 631] != INVALID).mean() > 0.99


def test_nothing_is_read_nearer_than_the_sensor_can() -> None:
    table = Table(TableCamera(700.0), 1)
    near = frames(table, 1, thing(Sphere((0.0, 0.0, 200.0), 100.0)))[0]
    assert near[240, 320] == INVALID
    assert frames(table, 1, thing(Sphere((0.0, 0.0, 100.0), 100.0)))[0, 240, 320] != INVALID


def test_nothing_is_read_beyond_the_tables_end() -> None:
    raw = frames(Table(TableCamera(900.0, tilt_deg=80.0), 1), 1)[0]
    assert (raw[:40] == INVALID).all()


def test_a_shadow_lies_on_the_left_five_pixels_narrower_than_the_step() -> None:
    table = Table(TableCamera(900.0), 1)
    post = thing(Capsule((0.0, -400.0, 200.0), (0.0, 400.0, 200.0), 30.0, 30.0))
    readings = frames(table, 10, post)
    lost = (readings == INVALID).mean(0)[100:380]
    table_raw, rim_raw = raw_of_depth(table.sensor, np.array([900.0, 700.0]))
    left = (lost[:, 200:300] > 0.9).sum(1).mean()
    assert left == pytest.approx((table_raw - rim_raw) / 8.0 - 5.0, abs=1.0)
    assert (lost[:, 345:500] > 0.9).sum() < 100


def test_a_low_fingertip_throws_no_shadow() -> None:
    table = Table(TableCamera(800.0), 1)
    readings = frames(table, 5, thing(Sphere((0.0, 0.0, 6.5), 6.5)))
    assert (readings[:, 200:280, 280:360] == INVALID).mean() < 0.004


def test_high_outlines_are_sharp_and_fatter_by_a_pixel_or_two() -> None:
    camera = TableCamera(900.0)
    beam = Capsule((-400.0, 0.0, 150.0), (400.0, 0.0, 150.0), 20.0, 20.0)
    true = DepthRenderer(camera, (640, 480)).render([thing(beam)]).depth_mm[:, 320] < 890.0
    rise = 708.0 - np.median(frames(Table(camera, 1), 15, thing(beam))[:, :, 200:450], axis=0)
    edge = 40.0
    height_px = (rise > edge).sum(0).mean()
    assert 1.0 <= (height_px - true.sum()) / 2.0 <= 2.5
    between = (rise > 15.0) & (rise < rise.max() - 45.0)
    assert between.sum(0).mean() < 1.0


def test_low_outlines_are_ramps_of_a_few_pixels() -> None:
    camera = TableCamera(900.0)
    finger = thing(Capsule((-200.0, 0.0, 7.0), (200.0, 0.0, 7.0), 7.0, 7.0))
    table = Table(camera, 1)
    rise = np.median(frames(table, 20), axis=0) - np.median(frames(table, 20, finger), axis=0)
    profile = rise[215:265, 220:420].mean(1)
    top = float(profile.max())
    ramp = ((profile > 0.1 * top) & (profile < 0.9 * top)).sum() / 2.0
    assert 2.0 <= ramp <= 6.0
    assert top == pytest.approx(14.0 / 2.345, abs=1.0)  # a raw step is 2.345 mm at 0.9 m


def test_readings_get_lost_inside_the_near_side_as_often_as_measured() -> None:
    beam = thing(Capsule((-400.0, 0.0, 150.0), (400.0, 0.0, 150.0), 60.0, 60.0))
    readings = frames(Table(TableCamera(900.0), 1), 60, beam)[:, 120:360, 200:450]
    known = readings != INVALID
    height = np.where(known, 708 - readings, 0).max(0)
    inside_px = cv2.distanceTransform((height > 40).astype(np.uint8), cv2.DIST_C, 3)
    found = [1.0 - known[:, inside_px == distance].mean() for distance in range(1, 6)]
    assert found == pytest.approx([0.23, 0.065, 0.034, 0.02, 0.012], abs=0.02)


def test_a_flat_thing_reads_its_true_height_away_from_its_outline() -> None:
    table = Table(TableCamera(1000.0), 1)
    ball = thing(Sphere((0.0, 0.0, -3900.0), 4000.0))
    empty, full = (float(mean_reading(frames(table, 20, *hands))[235:246, 315:326].mean()) for hands in ([], [ball]))
    expected = raw_of_depth(table.sensor, np.array([1000.0, 900.0]))
    assert empty - full == pytest.approx(expected[0] - expected[1], abs=0.5)


def test_small_steps_merge_and_large_ones_are_decided_by_the_vote() -> None:
    correlator = Correlator(Window(near_weight=1.0))
    for step, middle in ((4.0, 2.0), (40.0, 40.0)):
        rise = np.zeros((40, 40), np.float32)
        rise[:, 20:] = step
        found = correlator.match(rise, np.ones((40, 40), np.float32)).rise_raw[20]
        assert found[10] == pytest.approx(0.0, abs=0.01)
        assert found[30] == pytest.approx(step, abs=0.01)
        assert found[20] == pytest.approx(middle, abs=0.5)


def test_a_slope_is_read_as_it_is() -> None:
    rise = np.broadcast_to(np.arange(60, dtype=np.float32) * 0.5, (40, 60)).copy()
    found = Correlator(Window(near_weight=1.0)).match(rise, np.ones((40, 60), np.float32)).rise_raw
    assert np.allclose(found[:, 8:-8], rise[:, 8:-8], atol=0.05)


def test_shadow_falls_where_a_nearer_pixel_takes_the_projectors_column() -> None:
    columns = np.array([[0.0, 1.0, 2.0, 3.0, 4.0, 2.5, 3.5, 7.0]], np.float32)
    assert shadow(columns, 3).tolist() == [[False, False, False, True, True, False, False, False]]


def test_a_bank_draws_different_pictures_of_unit_variance() -> None:
    bank = NoiseBank(Correlation(0.2, 0.5, 1.0, 4.0), (160, 120), 4, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    drawn = [bank.draw(rng) for _ in range(8)]
    assert all(picture.shape == (120, 160) for picture in drawn)
    assert np.var(drawn) == pytest.approx(1.0, abs=0.1)
    assert not any(np.array_equal(a, b) for a, b in pairwise(drawn))


def test_boxes_that_meet_are_joined_until_none_do() -> None:
    boxes = [Box(0, 0, 10, 10), Box(20, 0, 30, 10), Box(5, 5, 25, 8), Box(50, 50, 60, 60)]
    assert apart(boxes) == [Box(0, 0, 30, 10), Box(50, 50, 60, 60)]
