"""How far ahead of their touch people aim, from simulated people who touch the same points from two sides."""

import math

import numpy as np
import pytest
from touchd.align.alignment import Alignment, AlignmentError
from touchd.align.session import AlignProgress, AlignSession
from touchd.errors import UsageError
from touchd.geometry import Doubles, SurfaceMap, distort, map_area, measured_size_mm, project_ideal, whole_picture
from touchd.model import Cursor, State, TouchFrame

from aligned_table import AROUND, FRAME_NS, GRID, LENS, NORMAL, SENSOR, pixels, tilted_table

UP, DOWN, RIGHT = 0.0, 180.0, 90.0


@pytest.fixture(scope="module")
def table() -> SurfaceMap:
    return tilted_table()


def along(heading_deg: float) -> Doubles:
    """Return the direction of a finger on the rectangle of aligned_table, x to its right and y down."""
    heading = math.radians(heading_deg)
    return np.array([math.sin(heading), -math.cos(heading)])


class Person:
    """Aims so many mm ahead of the touch, from one side, and never quite the same."""

    def __init__(self, heading_deg: float, ahead_mm: float, sloppy_mm: float = 0.0, seed: int = 1) -> None:
        self._heading_deg = heading_deg
        self._ahead_mm = ahead_mm
        self._sloppy_mm = sloppy_mm
        self._chance = np.random.default_rng(seed)

    def touch(self, point: Doubles) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the undistorted pixels of the touch and of a place 5 mm further along the finger."""
        turned = along(self._heading_deg + float(self._chance.normal(0.0, 10.0 * self._sloppy_mm)))
        off = -self._ahead_mm * turned + self._chance.normal(0.0, 1.0, 2) * self._sloppy_mm
        here, ahead = pixels(np.stack([point, point]), np.stack([off, off + 5.0 * turned]))
        return here, ahead


class Aligner:
    """Goes through an alignment from two sides."""

    def __init__(self, table: SurfaceMap, points: Doubles) -> None:
        corners = whole_picture(SENSOR)
        self._area = map_area(corners, LENS, measured_size_mm(corners, table))
        self._points = points
        self._session = AlignSession(len(points), self._area, table, sides=2)
        self._t_ns = 0
        self.asked: list[str] = []

    def go_round(self, *people: Person) -> tuple[Alignment, AlignProgress]:
        for person in people:
            for point in self._points:
                here, ahead = (self._area.of_ideal_pixel(*pixel) for pixel in person.touch(point))
                last = self._hold(here, self._direction(here, ahead))
        found = self._session.alignment
        assert found is not None
        return found, last

    def hold_without_direction(self) -> None:
        for _ in range(2):
            for pixel in pixels(self._points):
                self._hold(self._area.of_ideal_pixel(*pixel), None)

    def _direction(self, here: tuple[float, float], ahead: tuple[float, float]) -> tuple[float, float]:
        width_mm, height_mm = self._area.size_mm
        dx, dy = (ahead[0] - here[0]) * width_mm, (ahead[1] - here[1]) * height_mm
        return dx / math.hypot(dx, dy), dy / math.hypot(dx, dy)

    def _hold(self, place: tuple[float, float], towards: tuple[float, float] | None) -> AlignProgress:
        touch = Cursor(1, *place, 0.0, 0.0, 0.0, 5.0, 80.0, 0.0, towards=towards)
        for _ in range(30):
            progress = self._feed(touch)
        self.asked.append(progress.target)
        for _ in range(10):
            progress = self._feed()
        return progress

    def _feed(self, *cursors: Cursor) -> AlignProgress:
        self._t_ns += FRAME_NS
        return self._session.feed(TouchFrame(self._t_ns // FRAME_NS, self._t_ns, State.TRACKING, cursors))


@pytest.mark.parametrize("points", [AROUND, GRID], ids=["4 points", "9 points"])
def test_from_opposite_sides_the_offset_is_found_and_the_corners_are_where_they_were_meant(
    table: SurfaceMap, points: Doubles
) -> None:
    aligner = Aligner(table, points)
    found, last = aligner.go_round(Person(UP, 4.0), Person(DOWN, 4.0))
    assert found.eye is not None
    assert (found.eye.bottom, found.eye.top) == pytest.approx((4.0, 4.0), abs=0.1)
    assert (found.eye.left, found.eye.right) == pytest.approx((4.0, 4.0), abs=0.1)
    np.testing.assert_allclose(found.corners_px, distort(LENS, np.array(pixels(AROUND))), atol=0.1)
    assert last.eye == found.eye
    assert aligner.asked[0] == "top-left corner"
    assert aligner.asked[len(points)] == "top-left corner, from another side"


def test_from_sides_at_a_right_angle_each_has_its_own_offset(table: SurfaceMap) -> None:
    found, _ = Aligner(table, GRID).go_round(Person(UP, 6.0), Person(RIGHT, 2.0))
    assert found.eye is not None
    assert found.eye.bottom == pytest.approx(6.0, abs=1.0)
    assert found.eye.left == pytest.approx(2.0, abs=1.0)
    assert found.eye.top == found.eye.right == pytest.approx((found.eye.bottom + found.eye.left) / 2.0)


@pytest.mark.parametrize("seed", range(5))
def test_people_whose_touches_and_fingers_scatter_are_measured_within_two_millimetres(
    table: SurfaceMap, seed: int
) -> None:
    people = Person(UP, 5.0, sloppy_mm=1.5, seed=seed), Person(DOWN, 5.0, sloppy_mm=1.5, seed=seed + 100)
    found, _ = Aligner(table, GRID).go_round(*people)
    assert found.eye is not None
    assert (found.eye.bottom, found.eye.top) == pytest.approx((5.0, 5.0), abs=2.0)
    assert (found.eye.bottom + found.eye.top) / 2.0 == pytest.approx(5.0, abs=1.0)


def test_people_who_aim_short_of_their_touch_are_measured_as_well(table: SurfaceMap) -> None:
    found, _ = Aligner(table, AROUND).go_round(Person(UP, -3.0), Person(DOWN, -3.0))
    assert found.eye is not None
    assert found.eye.bottom == pytest.approx(-3.0, abs=0.1)


def test_two_rounds_from_one_side_are_refused(table: SurfaceMap) -> None:
    with pytest.raises(AlignmentError) as refused:
        Aligner(table, AROUND).go_round(Person(UP, 4.0), Person(20.0, 4.0))
    assert str(refused.value) == (
        "both rounds were touched from the same side of the table; align again, and go round it after the first"
    )


def test_other_points_from_the_other_side_are_refused(table: SurfaceMap) -> None:
    with pytest.raises(
        AlignmentError, match=r"the touches from the two sides are \d+ mm apart, more than aim explains"
    ):
        Aligner(table, AROUND).go_round(Person(UP, 4.0), Person(DOWN, 90.0))


def test_fingers_of_unknown_direction_are_refused_with_the_remedy(table: SurfaceMap) -> None:
    with pytest.raises(AlignmentError) as refused:
        Aligner(table, AROUND).hold_without_direction()
    assert str(refused.value) == (
        "it cannot be told where the fingers point (touch.method: fingertip tells it); align without --eye"
    )


def test_an_alignment_is_made_from_1_side_or_2(table: SurfaceMap) -> None:
    corners = whole_picture(SENSOR)
    area = map_area(corners, LENS, measured_size_mm(corners, table))
    with pytest.raises(UsageError, match="an alignment is made from 1 side or 2, found 3"):
        AlignSession(4, area, table, sides=3)


def test_the_rectangle_that_people_touch_lies_on_the_table() -> None:
    """What the other tests rest on: a place 5 mm along is 5 mm away on the table."""
    here, ahead = (np.array([place]) for place in Person(UP, 0.0).touch(np.array([0.3, -0.2])))
    points = [np.append((px[0] - [LENS.cx, LENS.cy]) / [LENS.fx, LENS.fy], 1.0) for px in (here, ahead)]
    on_table = [point * (900.0 / -(point @ NORMAL)) for point in points]
    assert float(np.linalg.norm(on_table[1] - on_table[0])) == pytest.approx(5.0, abs=0.01)
    np.testing.assert_allclose(project_ideal(LENS, on_table[0]), here[0], atol=1e-6)
