"""Whether a fingertip touches, over time: plain sights decide at once, doubtful ones add up."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.contacts.belief import Beliefs

PIXEL_MM = 1.3
HERE = (100.0, 80.0)


def told(*odds: float) -> list[float]:
    """The log odds that one fingertip touches after each of some pictures."""
    beliefs = Beliefs(PIXEL_MM)
    return [beliefs.update([HERE], [each])[0] for each in odds]


def test_a_plain_sight_of_a_touch_is_believed_at_once() -> None:
    assert told(5.0)[0] > 2.0
    assert told(-5.0, -5.0, 5.0)[-1] > 2.0


def test_a_plain_sight_of_a_lift_is_believed_at_once() -> None:
    assert told(5.0, 5.0, 5.0, 5.0, -5.0)[-1] < -2.0


def test_doubtful_sights_add_up() -> None:
    after = told(1.0, 1.0, 1.0, 1.0)
    assert after[0] < 0.0 < after[2]
    assert after == sorted(after)


def test_a_single_doubtful_sight_ends_no_touch() -> None:
    assert told(4.0, 4.0, -1.0)[-1] > 0.0


def test_a_fingertip_is_known_again_where_it_has_moved_to() -> None:
    beliefs = Beliefs(PIXEL_MM)
    beliefs.update([HERE], [5.0])
    assert beliefs.update([(HERE[0] + 20.0 / PIXEL_MM, HERE[1])], [0.0])[0] > 1.0


def test_a_new_fingertip_beside_a_touching_one_inherits_nothing() -> None:
    beliefs = Beliefs(PIXEL_MM)
    beliefs.update([HERE], [5.0])
    old, new = beliefs.update([HERE, (HERE[0] + 15.0 / PIXEL_MM, HERE[1])], [0.0, 0.0])
    assert old > 0.0 > new


@pytest.mark.parametrize(("missed", "known"), [(1, True), (2, True), (3, False)])
def test_a_fingertip_that_pictures_do_not_show_is_forgotten_soon(missed: int, known: bool) -> None:
    beliefs = Beliefs(PIXEL_MM)
    beliefs.update([HERE], [6.0])
    for _ in range(missed):
        beliefs.update([], [])
    assert (beliefs.update([HERE], [0.0])[0] > 0.0) == known


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), st.floats(0.0, 10.0))
def test_more_likely_sights_never_make_a_touch_less_likely(odds: list[float], more: float) -> None:
    plain, likelier = told(*odds), told(*(each + more for each in odds))
    assert all(math.isfinite(belief) for belief in plain)
    assert all(high >= low for low, high in zip(plain, likelier, strict=True))
