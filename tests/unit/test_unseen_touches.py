"""Touches that are not found: whether the picture shows that they ended, and what becomes of them."""

import pytest
from touchd.contacts.fingertip import FingertipMethod
from touchd.model import TouchFrame, Unseen
from touchd.table.scene import Block, Capsule, Hand

from living_tables import AT_MM, Desk, cursor_counts, finger

HEIGHTS = [750.0, 1500.0]


def arm_across(x_mm: float = AT_MM[0], high_mm: float = 150.0) -> Hand:
    """An arm above the table, from its far side past a place."""
    x_mm, y_mm = x_mm * (1.0 - high_mm / 750.0), -60.0
    return Hand((Capsule((x_mm, 700.0, high_mm + 60.0), (x_mm, y_mm, high_mm), 50.0, 45.0),), ())


def block(high_mm: float) -> Hand:
    """Something flat that lies where touches are."""
    return Hand((Block((*AT_MM, 0.0), (50.0, 50.0, high_mm)),), ())


def told(height_mm: float, *hands: Hand, apart_mm: float = 200.0) -> Unseen:
    """What is told of touches at the place and another one so far beside it, with these hands over the table."""
    desk = Desk(height_mm)
    ready = desk.pipeline.ready
    assert ready is not None
    width_mm, depth_mm = ready.area.size_mm
    x_mm, y_mm = AT_MM[0] + width_mm / 2, AT_MM[1] + depth_mm / 2
    expected = [(x_mm, y_mm), (x_mm - apart_mm, y_mm)]
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
def test_beside_another_touch_what_is_as_low_as_a_finger_still_stands_there(height_mm: float) -> None:
    assert told(height_mm, block(high_mm=15.0), apart_mm=40.0) == Unseen(standing=frozenset({0}))


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_touch_alone_that_is_not_found_has_ended(height_mm: float) -> None:
    assert told(height_mm, block(high_mm=15.0)) == Unseen()


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("high_mm", [3.0, 50.0])
def test_what_is_lower_or_higher_than_a_finger_is_none(height_mm: float, high_mm: float) -> None:
    assert told(height_mm, block(high_mm), apart_mm=40.0) == Unseen()


def reach_across(desk: Desk, begin_mm: int, end_mm: int, *hands: Hand) -> list[TouchFrame]:
    """Let an arm pass at 0.9 m/s while other hands do not move."""
    return [frame for x_mm in range(begin_mm, end_mm, -30) for frame in desk.play(1, arm_across(x_mm), *hands)]


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_finger_that_rests_while_an_arm_reaches_across_is_one_touch(height_mm: float) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    frames = reach_across(desk, 330, -200, finger()) + desk.play(6, finger())
    assert [[cursor.session_id for cursor in frame.cursors] for frame in frames] == [[1]] * 24
    assert {cursor.hand for frame in frames for cursor in frame.cursors} == {1}


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_finger_that_was_lifted_under_the_arm_has_ended_when_the_arm_has_passed(height_mm: float) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    assert cursor_counts(reach_across(desk, 330, 50, finger()))[-1] == 1
    reach_across(desk, 50, -80)
    assert cursor_counts(desk.play(3)) == [0, 0, 0]


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_no_touch_lasts_for_more_than_half_a_second_under_an_arm(height_mm: float) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    reach_across(desk, 330, 50, finger())
    counts = cursor_counts(desk.play(30, arm_across(), finger()))
    assert counts == sorted(counts, reverse=True)
    assert 12 <= sum(counts) <= 17


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("aside_mm", [-70.0, 0.0, 70.0])
def test_a_finger_that_lifts_ends_its_touch_though_its_own_hand_is_over_the_place(
    height_mm: float, aside_mm: float
) -> None:
    desk = Desk(height_mm)
    desk.play(12, finger())
    lifted = finger(clearance_mm=70.0, at_mm=(AT_MM[0] + aside_mm, AT_MM[1]))
    assert cursor_counts(desk.play(4, lifted))[2:] == [0, 0]
