"""What one output's client gets of the cursors, and where on its screen."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.model import Cursor
from touchd.outputs.screen import Box, Screen, ScreenMap

LEFT_HALF, RIGHT_HALF = (0.0, 0.0, 2.0, 1.0), (-1.0, 0.0, 1.0, 1.0)
SHARES = st.floats(0.0, 1.0)


def cursor(session_id: int, x: float = 0.5, y: float = 0.5, vx: float = 0.0, vy: float = 0.0, a: float = 0.0) -> Cursor:
    return Cursor(session_id, x, y, vx, vy, a, height_mm=4.0, area_mm2=60.0, angle=0.0)


def ids(cursors: list[Cursor]) -> list[int]:
    return [each.session_id for each in cursors]


def test_without_settings_a_client_gets_all_cursors_as_they_are() -> None:
    cursors = [cursor(1, 0.0, 1.0, 0.3, -0.2, 0.1), cursor(2, 0.25, 0.75)]
    assert Screen().view(cursors) == cursors


@pytest.mark.parametrize(
    ("turn", "corner"),  # where the area's top-left corner comes to lie
    [
        (ScreenMap(), (0.0, 0.0)),
        (ScreenMap(swap_axes=True), (0.0, 0.0)),
        (ScreenMap(flip_x=True), (1.0, 0.0)),
        (ScreenMap(flip_y=True), (0.0, 1.0)),
        (ScreenMap(flip_x=True, flip_y=True), (1.0, 1.0)),
        (ScreenMap(swap_axes=True, flip_x=True), (1.0, 0.0)),
        (ScreenMap(swap_axes=True, flip_y=True), (0.0, 1.0)),
        (ScreenMap(swap_axes=True, flip_x=True, flip_y=True), (1.0, 1.0)),
    ],
)
def test_the_eight_ways_to_turn_a_table_move_its_corners(turn: ScreenMap, corner: tuple[float, float]) -> None:
    placed = turn.place(cursor(1, 0.0, 0.0))
    assert (placed.x, placed.y) == corner


def test_a_quarter_turn_takes_the_right_hand_side_to_the_bottom() -> None:
    placed = ScreenMap(swap_axes=True, flip_x=True).place(cursor(1, 1.0, 0.25, vx=0.5, vy=0.125))
    assert (placed.x, placed.y, placed.vx, placed.vy) == (0.75, 1.0, -0.125, 0.5)


def test_a_table_that_is_part_of_a_larger_screen_touches_only_that_part() -> None:
    placement = ScreenMap((0.25, 0.5, 0.75, 1.0))
    placed = placement.place(cursor(1, 1.0, 0.5, vx=0.4, vy=-0.2, a=0.6))
    assert (placed.x, placed.y, placed.vx, placed.vy) == (0.75, 0.75, 0.2, -0.1)
    assert placed.accel == pytest.approx(0.3)
    assert placement.place(cursor(1, a=0.6)).accel == pytest.approx(0.3)


@given(x=SHARES, y=SHARES, vx=st.floats(-5, 5), vy=st.floats(-5, 5), turn=st.tuples(*[st.booleans()] * 3))
def test_velocity_is_the_movement_of_the_placed_point(
    x: float, y: float, vx: float, vy: float, turn: tuple[bool, bool, bool]
) -> None:
    placement = ScreenMap((-0.5, 0.25, 1.5, 0.75), *turn)
    before, after = cursor(1, x, y, vx, vy), cursor(1, x + vx, y + vy)
    placed, then = placement.place(before), placement.place(after)
    assert placed.x + placed.vx == pytest.approx(then.x, abs=1e-9)
    assert placed.y + placed.vy == pytest.approx(then.y, abs=1e-9)
    assert math.isfinite(placed.accel)


def test_two_clients_share_a_table_by_halves_and_each_touch_goes_to_one() -> None:
    left, right = Screen(ScreenMap(LEFT_HALF)), Screen(ScreenMap(RIGHT_HALF))
    cursors = [cursor(1, 0.25), cursor(2, 0.75)]
    assert [(each.session_id, each.x) for each in left.view(cursors)] == [(1, 0.5)]
    assert [(each.session_id, each.x) for each in right.view(cursors)] == [(2, 0.5)]


@pytest.mark.parametrize(("box", "x", "held"), [(LEFT_HALF, 0.9, 1.0), (RIGHT_HALF, 0.1, 0.0)])
def test_a_touch_that_strays_from_its_clients_screen_is_held_at_the_edge(box: Box, x: float, held: float) -> None:
    screen = Screen(ScreenMap(box))
    began = cursor(1)
    assert ids(screen.view([began])) == [1]
    assert [each.x for each in screen.view([replace(began, x=x)])] == [held]


def test_a_touch_that_began_beyond_the_screen_never_comes_in() -> None:
    screen = Screen(ScreenMap(LEFT_HALF))
    assert screen.view([cursor(1, 0.9)]) == []
    assert screen.view([cursor(1, 0.1)]) == []
    assert ids(screen.view([cursor(1, 0.1), cursor(2, 0.2)])) == [2]


def test_a_client_of_one_touch_keeps_its_first_and_gets_no_other_in_mid_stroke() -> None:
    kiosk = Screen(max_cursors=1)
    assert ids(kiosk.view([cursor(2), cursor(1)])) == [1]
    assert ids(kiosk.view([cursor(1), cursor(2)])) == [1]
    assert kiosk.view([cursor(2)]) == []
    assert ids(kiosk.view([cursor(2), cursor(3)])) == [3]


def test_a_pause_of_tracking_forgets_who_was_refused() -> None:
    kiosk = Screen(max_cursors=1)
    kiosk.view([cursor(1), cursor(2)])
    assert kiosk.view([]) == []
    assert ids(kiosk.view([cursor(2)])) == [2]


@given(
    frames=st.lists(st.sets(st.integers(1, 30), max_size=12), min_size=1, max_size=20),
    most=st.integers(1, 5),
)
def test_a_client_sees_each_touch_in_one_piece_and_never_more_than_its_share(frames: list[set[int]], most: int) -> None:
    screen = Screen(max_cursors=most)
    ended: set[int] = set()
    shown_before: set[int] = set()
    published: set[int] = set()
    for live in frames:
        alive = live - (published - live) - ended
        ended |= published - alive
        published |= alive
        shown = set(ids(screen.view([cursor(i) for i in sorted(alive)])))
        assert len(shown) <= most
        assert shown_before & alive <= shown
        shown_before = shown
