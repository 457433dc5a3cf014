"""Touches that are not found: whether the picture shows that they ended, and what becomes of them."""

import pytest
from touchd.contacts.fingertip import FingertipMethod
from touchd.model import Unseen
from touchd.table.scene import Block, Capsule, Hand

from living_tables import AT_MM, Desk, cursor_counts, finger

ELSEWHERE_MM = (-150.0, -100.0)
HEIGHTS = [750.0, 1500.0]


def arm_across(x_mm: float = AT_MM[0], high_mm: float = 150.0) -> Hand:
    """An arm above the table, from its far side past a place."""
    x_mm, y_mm = x_mm * (1.0 - high_mm / 750.0), -60.0
    return Hand((Capsule((x_mm, 700.0, high_mm + 60.0), (x_mm, y_mm, high_mm), 50.0, 45.0),), ())


def block(high_mm: float) -> Hand:
    """Something flat that lies where touches are."""
    return Hand((Block((*AT_MM, 0.0), (50.0, 50.0, high_mm)),), ())


def told(height_mm: float, *hands: Hand) -> Unseen:
    """What is told of touches at the place and elsewhere with these hands over the table."""
    desk = Desk(height_mm)
    ready = desk.pipeline.ready
    assert ready is not None
    width_mm, depth_mm = ready.area.size_mm
    expected = [(x + width_mm / 2, y + depth_mm / 2) for x, y in (AT_MM, ELSEWHERE_MM)]
    return FingertipMethod(ready.place).find(desk.frame(hands).raw, expected).unseen


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_touch_under_an_arm_is_hidden_and_one_elsewhere_is_not(height_mm: float) -> None:
    assert told(height_mm, arm_across()) == Unseen(hidden=frozenset({0}))


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_of_an_empty_table_nothing_is_hidden(height_mm: float) -> None:
    assert told(height_mm) == Unseen()


def test_an_arm_too_near_for_the_sensor_hides_nothing_as_it_is_not_known_to_be_one() -> None:
    assert told(750.0, arm_across(high_mm=420.0)) == Unseen()


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_what_is_as_low_as_a_finger_still_stands_there(height_mm: float) -> None:
    assert told(height_mm, block(high_mm=15.0)) == Unseen(standing=frozenset({0}))


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("high_mm", [3.0, 50.0])
def test_what_is_lower_or_higher_than_a_finger_is_none(height_mm: float, high_mm: float) -> None:
    assert told(height_mm, block(high_mm)) == Unseen()


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_finger_that_rests_while_an_arm_reaches_across_is_one_touch(height_mm: float) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    frames = [frame for x_mm in range(300, -220, -40) for frame in desk.play(1, finger(), arm_across(x_mm))]
    frames += desk.play(6, finger())
    assert [len(frame.cursors) for frame in frames] == [1] * 19
    assert {cursor.session_id for frame in frames for cursor in frame.cursors} == {1}
    assert {cursor.hand for frame in frames for cursor in frame.cursors} == {1}


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_finger_that_was_lifted_under_the_arm_has_ended_soon_after(height_mm: float) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    desk.play(6, arm_across())
    assert cursor_counts(desk.play(4))[1:] == [0, 0, 0]


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_no_touch_lasts_for_more_than_half_a_second_under_an_arm(height_mm: float) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    counts = cursor_counts(desk.play(30, arm_across()))
    assert counts == sorted(counts, reverse=True)
    assert 12 <= sum(counts) <= 17
