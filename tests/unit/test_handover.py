"""From the air to the surface and back: touches and hovers go on with the way of the same fingertip."""

from collections.abc import Sequence

import pytest
from touchd.model import Contact, Cursor, Hover
from touchd.tracking.hovers import HoverTracker
from touchd.tracking.settings import TrackingSettings
from touchd.tracking.tracker import Tracker

AREA_MM = (600.0, 400.0)
FRAME_NS = 33_333_333
FRAME_S = FRAME_NS / 1e9


def seen(x_mm: float, y_mm: float = 200.0, height_mm: float = 0.0) -> Contact:
    firm = height_mm == 0.0
    return Contact(x_mm / AREA_MM[0], y_mm / AREA_MM[1], x_mm, y_mm, height_mm, 150.0, 0.0, firm)


class Table:
    """Both trackers, as the pipeline runs them: what is at height 0 touches, what is higher hovers."""

    def __init__(self) -> None:
        self.touches = Tracker(TrackingSettings(), AREA_MM)
        self.hovers = HoverTracker(TrackingSettings(), AREA_MM)
        self.t_ns = 0

    def see(
        self, *fingertips: Contact, lifted_mm: Sequence[tuple[float, float]] = ()
    ) -> tuple[tuple[Cursor, ...], tuple[Hover, ...]]:
        self.t_ns += FRAME_NS
        aloft = [each for each in fingertips if each.height_mm > 0.0]
        landed = [each for each in fingertips if each.height_mm == 0.0]
        cursors = self.touches.step(landed, self.t_ns, lifted_mm, self.hovers.air(aloft))
        return cursors, self.hovers.step(aloft, self.t_ns, self.touches.ground)

    def expected_mm(self) -> tuple[float, float]:
        """Return where the one touch is expected in the next frame."""
        (place,) = self.touches.expected_mm(self.t_ns + FRAME_NS)
        return place


@pytest.fixture
def table() -> Table:
    return Table()


def test_a_touch_says_which_hover_it_was_for_as_long_as_it_lives(table: Table) -> None:
    table.see(seen(300.0, height_mm=12.0))
    for _ in range(3):
        (cursor,), hovers = table.see(seen(300.0))
        assert (cursor.session_id, cursor.hover_id) == (1, 1)
        assert hovers == ()


def test_a_touch_out_of_nowhere_was_no_hover_and_begins_at_rest(table: Table) -> None:
    (cursor,), _ = table.see(seen(300.0))
    assert (cursor.hover_id, cursor.vx, cursor.vy) == (None, 0.0, 0.0)
    assert cursor.x == 0.5


def test_a_finger_that_glides_in_has_its_velocity_in_the_first_touching_frame(table: Table) -> None:
    for k in range(8):
        table.see(seen(100.0 + 15.0 * k, height_mm=10.0 - k))
    (cursor,), _ = table.see(seen(220.0))
    assert cursor.vx * AREA_MM[0] == pytest.approx(450.0, rel=0.1)
    assert cursor.vy == 0.0
    assert table.expected_mm()[0] == pytest.approx(235.0, abs=3.0)


def test_a_finger_that_comes_down_steeply_is_expected_where_it_lands(table: Table) -> None:
    for k in range(4):
        table.see(seen(200.0 + 3.0 * k, height_mm=39.0 - 9.0 * k))
    table.see(seen(212.0))
    assert table.expected_mm() == (212.0, 200.0)


def test_the_first_place_of_a_touch_is_averaged_with_where_its_still_finger_hovered(table: Table) -> None:
    for _ in range(10):
        table.see(seen(300.0, height_mm=10.0))
    (cursor,), _ = table.see(seen(304.0))
    assert 300.0 < cursor.x * AREA_MM[0] < 304.0


def test_a_touch_after_a_frame_in_which_its_hover_was_hidden_is_followed_too(table: Table) -> None:
    for k in range(8):
        table.see(seen(100.0 + 10.0 * k, height_mm=9.0))
    table.see()
    (cursor,), _ = table.see(seen(190.0))
    assert cursor.hover_id == 1
    assert cursor.vx * AREA_MM[0] == pytest.approx(300.0, rel=0.15)


def test_a_finger_that_lands_beside_one_that_goes_on_hovering_does_not_take_its_way(table: Table) -> None:
    table.see(seen(300.0, height_mm=10.0))
    (cursor,), (hover,) = table.see(seen(318.0), seen(301.0, height_mm=10.0))
    assert (cursor.hover_id, hover.hover_id) == (None, 1)


def test_of_two_neighbours_each_lands_with_its_own_way(table: Table) -> None:
    _, (left, right) = table.see(seen(300.0, height_mm=10.0), seen(320.0, height_mm=10.0))
    cursors, _ = table.see(seen(321.0), seen(301.0))
    assert {round(cursor.x * AREA_MM[0], -1): cursor.hover_id for cursor in cursors} == {
        300.0: left.hover_id,
        320.0: right.hover_id,
    }


def test_a_hover_says_which_touch_it_was(table: Table) -> None:
    table.see(seen(300.0))
    place = (300.0, 200.0)
    for height_mm in (14.0, 20.0, 26.0):
        cursors, (hover,) = table.see(seen(300.0, height_mm=height_mm), lifted_mm=[place])
        assert (cursors, hover.session_id) == ((), 1)
        assert hover.hover_id == 1


def test_a_finger_that_is_seen_only_after_its_touch_has_ended_is_still_followed(table: Table) -> None:
    table.see(seen(300.0))
    table.see()  # it coasts
    table.see()  # it ends
    _, (hover,) = table.see(seen(300.0, height_mm=30.0))
    assert hover.session_id == 1


def test_a_finger_that_comes_much_later_is_another(table: Table) -> None:
    table.see(seen(300.0))
    for _ in range(5):
        table.see()
    _, (hover,) = table.see(seen(300.0, height_mm=30.0))
    assert hover.session_id is None


def test_touches_are_numbered_in_the_order_in_which_they_begin_and_hovers_by_themselves(table: Table) -> None:
    table.see(seen(100.0, height_mm=10.0), seen(200.0, height_mm=10.0), seen(300.0, height_mm=10.0))
    (third,), _ = table.see(seen(100.0, height_mm=10.0), seen(200.0, height_mm=10.0), seen(300.0))
    cursors, (second,) = table.see(seen(100.0), seen(200.0, height_mm=10.0), seen(300.0))
    assert (third.session_id, third.hover_id) == (1, 3)
    assert [(cursor.session_id, cursor.hover_id) for cursor in cursors] == [(1, 3), (2, 1)]
    assert second.hover_id == 2


def test_after_all_ended_nothing_is_followed(table: Table) -> None:
    table.see(seen(300.0, height_mm=10.0), seen(100.0))
    table.touches.end_all()
    table.hovers.end_all()
    (cursor,), (hover,) = table.see(seen(300.0), seen(100.0, height_mm=10.0))
    assert (cursor.hover_id, hover.session_id) == (None, None)
