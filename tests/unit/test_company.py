"""What is told of a fingertip's motion, and of those beside it."""

from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.contacts.company import Standing, company
from touchd.model import Floats

from unit.fingertips import IMPRESSION, standing_at

OWN, MOVED, NEIGHBOUR, TOGETHER = slice(0, 12), slice(12, 18), 7, slice(39, 43)


def told(*now: Standing) -> Floats:
    return company(now, [None] * len(now))[0]


def beside(row: Floats, which: int) -> list[float]:
    """What a row says of the first, second or third nearest."""
    begin = MOVED.stop + which * NEIGHBOUR
    told: list[float] = row[begin : begin + NEIGHBOUR].tolist()
    return told


def test_one_that_is_new_and_alone_has_no_motion_and_no_company() -> None:
    inputs, hearing = company([standing_at(100.0, 100.0)], [None])
    assert not inputs[0, MOVED].any()
    assert not inputs[0, MOVED.stop : TOGETHER.start].any()
    assert inputs[0, TOGETHER].tolist() == [0.0, -1.0, 3.0, 0.0]
    assert hearing.tolist() == [[0.0]]


def test_motion_is_told_along_the_finger_and_across() -> None:
    last = replace(standing_at(100.0, 100.0, clearance_mm=9.0), unseen=1)
    upwards = replace(standing_at(103.0, 105.0, clearance_mm=4.0), towards=(0.0, 1.0))
    inputs, _ = company([upwards], [last])
    assert inputs[0, MOVED] == pytest.approx([1.0, 1.0, 0.5, -0.3, 0.5, -0.5])


def test_the_three_nearest_are_told_in_turn() -> None:
    one, *others = (
        standing_at(100.0 + away, 100.0, odds) for away, odds in ((0, 3), (60, 6), (20, 9), (90, 12), (99, 15))
    )
    row = told(one, *others)[0]
    assert [beside(row, which)[1] for which in range(3)] == pytest.approx([0.5, 1.5, 2.25])
    assert [beside(row, which)[3] for which in range(3)] == pytest.approx([3.0, 2.0, 4.0])
    assert row[TOGETHER] == pytest.approx([4 / 3, 5.0, 0.4, 3.5])


def test_what_is_beside_a_finger_is_told_as_seen_from_it() -> None:
    turned = replace(standing_at(100.0, 100.0), towards=(0.0, 1.0))
    assert beside(told(turned, standing_at(100.0, 140.0))[0], 0)[1:3] == pytest.approx([1.0, 0.0])
    assert beside(told(turned, standing_at(140.0, 100.0))[0], 0)[1:3] == pytest.approx([0.0, -1.0])


def test_places_are_given_along_the_way_that_it_points_and_across() -> None:
    turned = replace(standing_at(100.0, 200.0), towards=(0.0, 1.0))
    assert turned.from_rest_mm(3.0, 2.0) == (98.0, 203.0)


def test_what_is_farther_than_a_hand_is_no_company() -> None:
    inputs, hearing = company([standing_at(100.0, 100.0), standing_at(251.0, 100.0)], [None, None])
    assert not hearing.any()
    assert not inputs[:, MOVED.stop : TOGETHER.start].any()


def test_all_beside_one_are_heard_alike() -> None:
    _, hearing = company([standing_at(100.0 + 20.0 * i, 100.0) for i in range(4)], [None] * 4)
    assert hearing == pytest.approx((np.ones((4, 4)) - np.eye(4)) / 3)


def test_the_impression_comes_last_as_it_is() -> None:
    one = standing_at(100.0, 100.0)
    impression = np.arange(len(IMPRESSION), dtype=np.float32)
    seen = replace(one.seen, opinion=replace(one.seen.opinion, impression=impression))
    assert told(replace(one, seen=seen))[0, TOGETHER.stop :].tolist() == impression.tolist()


@given(
    st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100), st.floats(-9, 9)), min_size=1, max_size=8),
    st.floats(-3.1, 3.1),
)
def test_neither_the_area_s_axes_nor_the_order_matter(places: list[tuple[float, float, float]], turn: float) -> None:
    def turned(x: float, y: float, odds: float, angle: float) -> Standing:
        at = (x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle))
        return replace(standing_at(0.0, 0.0, odds), rest_mm=at, under_mm=at, towards=(cos(angle), sin(angle)))

    plain = told(*(turned(*place, 0.0) for place in places))[:, TOGETHER]
    other = told(*(turned(*place, turn) for place in reversed(places)))[::-1, TOGETHER]
    assert plain == pytest.approx(other, abs=1e-4)
