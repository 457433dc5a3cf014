from math import cos, sin

import pytest
from touchd.model import Contact, Cursor, Unseen
from touchd.tracking.settings import TrackingSettings
from touchd.tracking.tracker import Tracker

AREA_MM = (600.0, 400.0)
FRAME_NS = 33_333_333
ALL_SEEN = Unseen()


def contact(x_mm: float, y_mm: float, firm: bool = True) -> Contact:
    return Contact(
        x=x_mm / AREA_MM[0],
        y=y_mm / AREA_MM[1],
        x_mm=x_mm,
        y_mm=y_mm,
        height_mm=9.0,
        area_mm2=150.0,
        angle=0.0,
        firm=firm,
    )


class Table:
    def __init__(self) -> None:
        self.tracker = Tracker(TrackingSettings(), AREA_MM)
        self.t_ns = 0

    def see(self, *contacts: Contact, unseen: Unseen = ALL_SEEN) -> list[Cursor]:
        self.t_ns += FRAME_NS
        return list(self.tracker.step(contacts, self.t_ns, unseen=unseen))


@pytest.fixture
def table() -> Table:
    return Table()


def test_a_touch_begins_in_the_frame_in_which_its_contact_is_first_seen(table: Table) -> None:
    assert [c.session_id for c in table.see(contact(300, 200))] == [1]


def test_a_still_finger_has_exactly_no_velocity_whatever_its_jitter(table: Table) -> None:
    table.see(contact(300, 200))
    for wobble in (0.1, -0.1, 0.05, -0.08):
        (cursor,) = table.see(contact(300 + wobble, 200 - wobble))
        assert (cursor.vx, cursor.vy, cursor.accel) == (0.0, 0.0, 0.0)


def test_velocity_and_acceleration_are_the_way_since_the_last_frame_in_axes_a_second(table: Table) -> None:
    before = table.see(contact(100, 200))[0]
    for step in range(1, 20):
        (cursor,) = table.see(contact(100 + 20.0 * step, 200))
        assert cursor.vx == pytest.approx((cursor.x - before.x) / (FRAME_NS / 1e9))
        assert cursor.vy == 0.0
        assert cursor.accel == pytest.approx((abs(cursor.vx) - abs(before.vx)) / (FRAME_NS / 1e9))
        before = cursor
    assert cursor.vx * AREA_MM[0] == pytest.approx(600.0, rel=0.02)


def test_a_finger_at_600_mm_a_second_is_followed_within_20_ms(table: Table) -> None:
    for step in range(15):
        (cursor,) = table.see(contact(50 + 20.0 * step, 200))
    behind_mm = 50 + 20.0 * 14 - cursor.x * AREA_MM[0]
    assert 0.0 <= behind_mm <= 600.0 * 0.020


@pytest.mark.parametrize("speed_mm_s", [600.0, 1200.0])
def test_a_swipe_that_lands_at_speed_is_one_touch(table: Table, speed_mm_s: float) -> None:
    ids = {c.session_id for frame in range(10) for c in table.see(contact(50 + speed_mm_s / 30.0 * frame, 200))}
    assert ids == {1}


@pytest.mark.parametrize("radius_mm", [40.0, 80.0, 160.0])
def test_a_finger_that_draws_circles_at_900_mm_a_second_is_one_touch(table: Table, radius_mm: float) -> None:
    ids = set()
    for step in range(60):
        turned = 900.0 / 30.0 * step / radius_mm
        seen = table.see(contact(300 + radius_mm * cos(turned), 200 + radius_mm * sin(turned)))
        ids |= {cursor.session_id for cursor in seen}
    assert ids == {1}


def test_what_appears_farther_away_than_a_swipe_goes_is_another_touch(table: Table) -> None:
    table.see(contact(300, 200))
    assert [c.session_id for c in table.see(contact(350, 200))] == [1, 2]


def test_a_touch_survives_one_frame_without_its_contact_and_keeps_its_id(table: Table) -> None:
    table.see(contact(300, 200))
    assert [c.session_id for c in table.see()] == [1]
    assert [c.session_id for c in table.see(contact(301, 200))] == [1]


def test_a_touch_ends_in_the_second_frame_without_its_contact(table: Table) -> None:
    table.see(contact(300, 200))
    table.see()
    assert table.see() == []


def test_a_lifted_finger_s_cursor_stays_where_it_was(table: Table) -> None:
    for _ in range(3):
        (last,) = table.see(contact(300, 200))
    (held,) = table.see()
    assert (held.x, held.y) == (last.x, last.y)


def test_two_fingers_that_cross_keep_their_ids(table: Table) -> None:
    for step in range(20):
        cursors = table.see(contact(100 + 15 * step, 190), contact(400 - 15 * step, 210))
    assert [round(c.y * AREA_MM[1] / 10) for c in cursors] == [19, 21]
    assert [c.session_id for c in cursors] == [1, 2]


def test_a_weak_contact_continues_a_touch_but_never_begins_one(table: Table) -> None:
    assert table.see(contact(300, 200, firm=False)) == []
    table.see(contact(300, 200))
    for _ in range(5):
        assert [c.session_id for c in table.see(contact(300, 200, firm=False))] == [1]


def test_a_touch_begins_only_inside_the_area(table: Table) -> None:
    assert table.see(contact(-2, 200), contact(300, 403)) == []


def test_a_live_touch_may_stray_five_millimetres_outside_clamped_and_then_ends(table: Table) -> None:
    table.see(contact(5, 200))
    (cursor,) = table.see(contact(-4, 200))
    assert cursor.session_id == 1
    assert cursor.x == pytest.approx(0.0, abs=0.01)
    assert table.see(contact(-6, 200)) == []


def test_a_touch_whose_finger_is_seen_above_the_surface_ends_at_once(table: Table) -> None:
    table.see(contact(300, 200))
    table.t_ns += FRAME_NS
    assert table.tracker.step([], table.t_ns, lifted_mm=[(304.0, 203.0)]) == ()


@pytest.mark.parametrize("x_mm", [300.0, 320.0])
def test_a_moving_touch_ends_if_its_finger_lifts_where_it_was_or_where_it_should_be(table: Table, x_mm: float) -> None:
    for step in range(11):
        table.see(contact(100 + 20.0 * step, 200))
    table.t_ns += FRAME_NS
    assert table.tracker.step([], table.t_ns, lifted_mm=[(x_mm, 200.0)]) == ()


def test_a_finger_above_the_surface_somewhere_else_ends_no_touch(table: Table) -> None:
    table.see(contact(300, 200))
    table.t_ns += FRAME_NS
    (cursor,) = table.tracker.step([], table.t_ns, lifted_mm=[(340.0, 200.0)])
    assert cursor.session_id == 1


HIDDEN, STANDING = Unseen(hidden=frozenset({0})), Unseen(standing=frozenset({0}))


def resting(table: Table) -> Cursor:
    """Let a finger rest for a while and return its cursor."""
    for _ in range(5):
        (cursor,) = table.see(contact(300, 200))
    return cursor


def test_a_resting_touch_that_something_hides_stays_where_it_was_and_is_the_same_one_after(table: Table) -> None:
    before = resting(table)
    for _ in range(14):
        (held,) = table.see(unseen=HIDDEN)
        assert (held.session_id, held.x, held.y) == (before.session_id, before.x, before.y)
    table.see()  # the picture in which the arm has passed and the finger is not made out yet
    assert [c.session_id for c in table.see(contact(303, 200))] == [before.session_id]


def test_a_touch_that_stays_hidden_ends_after_half_a_second(table: Table) -> None:
    resting(table)
    lasted = sum(bool(table.see(unseen=HIDDEN)) for _ in range(60))
    assert 14 <= lasted <= 17


def test_a_touch_ends_as_ever_once_it_is_hidden_no_more_and_not_there(table: Table) -> None:
    resting(table)
    table.see(unseen=HIDDEN)
    assert len(table.see()) == 1
    assert table.see() == []


def test_a_moving_touch_is_not_waited_for_as_nobody_knows_where_it_went(table: Table) -> None:
    for step in range(10):
        table.see(contact(100 + 10.0 * step, 200))
    table.see(unseen=HIDDEN)
    assert table.see(unseen=HIDDEN) == []


def test_what_is_seen_above_a_hidden_touch_is_no_lifted_finger_of_it(table: Table) -> None:
    resting(table)
    table.t_ns += FRAME_NS
    assert len(table.tracker.step([], table.t_ns, lifted_mm=[(300.0, 200.0)], unseen=HIDDEN)) == 1


def test_other_touches_are_not_hidden_with_one(table: Table) -> None:
    for _ in range(5):
        table.see(contact(100, 200), contact(300, 200))
    for _ in range(3):
        cursors = table.see(unseen=HIDDEN)
    assert [c.session_id for c in cursors] == [1]


def test_a_touch_outlives_its_contact_by_three_frames_where_a_finger_is_still_seen(table: Table) -> None:
    resting(table)
    assert [len(table.see(unseen=STANDING)) for _ in range(4)] == [1, 1, 1, 0]


def test_a_finger_seen_to_lift_ends_its_touch_though_something_low_is_there(table: Table) -> None:
    resting(table)
    table.t_ns += FRAME_NS
    assert table.tracker.step([], table.t_ns, lifted_mm=[(300.0, 200.0)], unseen=STANDING) == ()


def test_touches_are_expected_where_they_move_to(table: Table) -> None:
    for step in range(6):
        table.see(contact(100 + 10 * step, 200))
    ((x_mm, y_mm),) = table.tracker.expected_mm(table.t_ns + FRAME_NS)
    assert 155.0 < x_mm < 165.0
    assert y_mm == pytest.approx(200.0)


def test_ending_all_touches_gives_the_same_finger_a_new_id(table: Table) -> None:
    table.see(contact(300, 200))
    table.tracker.end_all()
    assert [c.session_id for c in table.see(contact(300, 200))] == [2]


def test_after_a_long_gap_a_finger_that_moved_far_is_still_the_same_touch(table: Table) -> None:
    for step in range(8):
        table.see(contact(100 + 10 * step, 200))
    table.t_ns += 2 * FRAME_NS
    assert [c.session_id for c in table.see(contact(200, 200))] == [1]
