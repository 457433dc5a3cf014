"""The stereo camera's noise against the figures measured on a real one over a table at 0.5 to 0.9 m."""

import numpy as np
import pytest
from numpy.typing import NDArray
from touchd.table.scene import Capsule, Hand, TableCamera
from touchd.table.sensor_stereo import StereoModel
from touchd.table.table import Table

Frames = NDArray[np.float64]


def frames(height_mm: float, count: int, *hands: Hand) -> Frames:
    table = Table(TableCamera(height_mm), 5, StereoModel())
    return np.array([table.render(hands, i, i).raw for i in range(count)]).astype(np.float64)


@pytest.fixture(scope="module")
def still() -> Frames:
    return frames(700.0, 80)


def known(pictures: Frames) -> NDArray[np.bool_]:
    return np.asarray((pictures > 0).all(0))


def test_a_still_pixel_varies_by_a_millimetre_and_a_tenth_like_a_bell(still: Frames) -> None:
    spread = still.std(0)[known(still)]
    assert np.median(spread) == pytest.approx(1.1, abs=0.1)
    error = (still - still.mean(0))[:, known(still)] / spread
    assert (error**4).mean() == pytest.approx(3.0, abs=0.2)  # a normal distribution's


def test_a_plane_ripples_by_two_and_a_half_millimetres(still: Frames) -> None:
    assert still.mean(0)[known(still)].std() == pytest.approx(2.5, abs=0.35)


def test_eight_readings_in_ten_thousand_are_lost(still: Frames) -> None:
    assert (still == 0).mean() == pytest.approx(0.0008, abs=0.0001)


def test_readings_are_whole_millimetres_and_zero_where_there_is_none() -> None:
    table = Table(TableCamera(700.0), 5, StereoModel())
    assert (table.sensor.unit, table.sensor.invalid, table.sensor.kind) == ("mm", 0, "stereo")
    assert table.sensor.to_mm[700] == 700.0
    assert table.render([], 0, 0).raw.dtype == np.uint16


def test_noise_grows_with_the_square_of_the_distance() -> None:
    far = frames(1400.0, 30)
    assert np.median(far.std(0)[known(far)]) == pytest.approx(4.0 * 1.1, rel=0.12)


def test_a_finger_rises_over_the_table_by_about_its_thickness() -> None:
    finger = Hand((Capsule((-200.0, 0.0, 10.0), (200.0, 0.0, 10.0), 10.0, 10.0),), ())
    empty, full = frames(700.0, 25).mean(0), frames(700.0, 25, finger).mean(0)
    assert (empty - full)[238:242, 280:360].mean() == pytest.approx(20.0, abs=2.5)


def test_nothing_is_read_nearer_than_the_camera_can() -> None:
    near = Hand((Capsule((-50.0, 0.0, 480.0), (50.0, 0.0, 480.0), 40.0, 40.0),), ())
    assert (frames(700.0, 1, near)[0, 238:242, 300:340] == 0).all()
