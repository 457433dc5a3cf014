import math
import re

import numpy as np
import pytest
from touchd.align.alignment import AlignmentError
from touchd.align.solve import GRID_NAMES, rectangle_residual_mm, solve_alignment
from touchd.geometry import (
    SurfaceMap,
    distort,
    map_area,
    measured_size_mm,
)
from touchd.model import AreaCorners

from aligned_table import AROUND, GRID, LENS, pixels, tilted_table


@pytest.fixture(scope="module")
def table() -> SurfaceMap:
    return tilted_table()


def test_four_touched_corners_are_the_corners_as_the_lens_shows_them(table: SurfaceMap) -> None:
    touched = pixels(AROUND)
    found = solve_alignment(touched, LENS, table)
    np.testing.assert_allclose(found.corners_px, distort(LENS, np.array(touched)))
    assert found.size_mm == pytest.approx((500.0, 300.0), abs=1.0)
    assert found.residual_mm < 0.5
    assert found.points == 4


def test_an_area_map_of_the_corners_found_puts_the_touched_points_at_its_corners(table: SurfaceMap) -> None:
    touched = pixels(AROUND)
    area = AreaCorners(solve_alignment(touched, LENS, table).corners_px)
    area_map = map_area(area, LENS, (1.0, 1.0))
    places = [area_map.of_ideal_pixel(u, v) for u, v in touched]
    np.testing.assert_allclose(places, [(0, 0), (1, 0), (1, 1), (0, 1)], atol=1e-4)
    assert measured_size_mm(area, table) == pytest.approx((500.0, 300.0), abs=3.0)


def test_a_corner_touched_beside_the_rectangle_shows_in_the_residual(table: SurfaceMap) -> None:
    off = np.zeros((4, 2))
    off[1] = (8.0, 0.0)
    assert 2.0 < solve_alignment(pixels(AROUND, off), LENS, table).residual_mm < 4.0


def test_nine_points_average_out_how_inexactly_each_was_touched(table: SurfaceMap) -> None:
    off = np.random.default_rng(5).normal(0.0, 2.0, (9, 2))
    found = solve_alignment(pixels(GRID, off), LENS, table)
    assert found.points == 9
    assert 0.5 < found.residual_mm < 4.0
    truth = distort(LENS, np.array(pixels(AROUND)))
    errors_mm = np.linalg.norm(np.array(found.corners_px) - truth, axis=1) * 900.0 / 580.0
    assert errors_mm.max() < 4.5
    exact = solve_alignment(pixels(GRID), LENS, table)
    assert exact.residual_mm < 0.01
    np.testing.assert_allclose(exact.corners_px, truth, atol=0.01)


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, -3.0])
def test_the_residual_is_how_far_corners_lie_from_the_best_rectangle(angle: float) -> None:
    turn = np.array([[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0, 0, 1]])
    rectangle = np.array([(0.0, 0.0, 700.0), (600.0, 0.0, 700.0), (600.0, 400.0, 700.0), (0.0, 400.0, 700.0)])
    assert rectangle_residual_mm(rectangle @ turn.T) == pytest.approx(0.0, abs=1e-4)
    # Of a parallelogram with sides a, b that lean by a small s the best rectangle takes back half at each corner ...
    leaning = rectangle + np.array([(4.0, 0, 0), (4.0, 0, 0), (-4.0, 0, 0), (-4.0, 0, 0)])
    share = 600.0 / math.hypot(600.0, 400.0)
    assert rectangle_residual_mm(leaning @ turn.T) == pytest.approx(4.0 * share, rel=0.02)
    # ... and of a warped one, nothing.
    warped = rectangle + np.array([(0, 0, 5.0), (0, 0, -5.0), (0, 0, 5.0), (0, 0, -5.0)])
    assert rectangle_residual_mm(warped @ turn.T) == pytest.approx(5.0, rel=1e-3)


@pytest.mark.parametrize(
    ("order", "sentence"),
    [
        (
            [0, 3, 2, 1],
            "the corners run anticlockwise for the camera, as in a mirror; align again, in the order top-left,",
        ),
        ([1, 0, 3, 2], "the corners run anticlockwise for the camera"),
        ([0, 2, 1, 3], "the top-right corner and the bottom-right corner look swapped; align again"),
        ([1, 0, 2, 3], "the top-left corner and the top-right corner look swapped; align again"),
        ([0, 1, 3, 2], "the bottom-right corner and the bottom-left corner look swapped; align again"),
        ([3, 1, 2, 0], "the bottom-left corner and the top-left corner look swapped; align again"),
    ],
)
def test_corners_touched_in_another_order_are_named(table: SurfaceMap, order: list[int], sentence: str) -> None:
    with pytest.raises(AlignmentError) as caught:
        solve_alignment(pixels(AROUND[order]), LENS, table)
    assert str(caught.value).startswith(sentence)
    assert caught.value.exit_code == 75


@pytest.mark.parametrize(
    ("corner", "place", "sentence"),
    [
        (2, (-0.5, -0.5), "the bottom-right corner dents the area inwards; align again"),
        (2, (0.0, 0.0), "the bottom-right corner lies in a line with its neighbours; align again"),
        (0, (0.99, -0.98), "the top-left corner and the top-right corner were touched 4 mm apart, and an area's sides"),
    ],
)
def test_a_corner_touched_at_a_wrong_place_is_named(
    table: SurfaceMap, corner: int, place: tuple[float, float], sentence: str
) -> None:
    places = AROUND.copy()
    places[corner] = place
    with pytest.raises(AlignmentError) as caught:
        solve_alignment(pixels(places), LENS, table)
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize("wrong", range(9))
def test_one_of_nine_points_touched_at_a_wrong_place_is_named(table: SurfaceMap, wrong: int) -> None:
    off = np.zeros((9, 2))
    off[wrong] = (50.0, 30.0)
    with pytest.raises(AlignmentError) as caught:
        solve_alignment(pixels(GRID, off), LENS, table)
    found = re.fullmatch(
        r"the ([\w -]+) was touched (\d+) mm from where the other points put it; align again, row by row from the "
        r"top-left corner",
        str(caught.value),
    )
    assert found is not None
    assert found[1] == GRID_NAMES[wrong]
    assert int(found[2]) == pytest.approx(math.hypot(50.0, 30.0), abs=2.0)


def test_nine_points_on_one_another_are_no_area(table: SurfaceMap) -> None:
    with pytest.raises(AlignmentError, match="align again"):
        solve_alignment([(300.0, 200.0)] * 9, LENS, table)
