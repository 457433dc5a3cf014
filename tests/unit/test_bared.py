"""What shows that a part of what lay on a surface is not there any more."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from touchd.model import Floats, Image16, Mask
from touchd.surface.bared import Bared

ROWS, COLUMNS = 12, 16
TABLE, HIGH = 700, -20.0
FRAME_S = 1 / 30
READABLE = np.arange(2048) < 2047
NO_READING = 2047


def layer(where: Mask) -> Floats:
    return np.where(where, np.float32(HIGH), np.float32(0.0))


def seen(there: Mask) -> Image16:
    return np.where(there, TABLE + int(HIGH), TABLE).astype(np.uint16)


def rectangle(top: int, bottom: int, left: int, right: int) -> Mask:
    mask = np.zeros((ROWS, COLUMNS), np.bool_)
    mask[top:bottom, left:right] = True
    return mask


EMPTY = seen(rectangle(0, 0, 0, 0))


def told(laid: Mask, pictures: list[Image16]) -> Mask:
    """Return where the surface was said to be bare, after so many pictures of what is laid over it."""
    bared, by = Bared(READABLE, 1.0), layer(laid)
    said = np.zeros((ROWS, COLUMNS), np.bool_)
    for picture in pictures:
        found = bared.step(picture, np.float32(TABLE) + by, by, np.abs(by), FRAME_S)
        said |= found if found is not None else False
    return said


def test_what_is_left_of_a_thing_that_is_gone_is_bare_after_half_a_second() -> None:
    left = rectangle(3, 4, 5, 6)
    assert not told(left, [EMPTY] * 14).any()
    assert np.array_equal(told(left, [EMPTY] * 18), left)


def test_the_rim_of_a_thing_that_lies_there_stays_and_what_is_farther_out_does_not() -> None:
    laid, there = rectangle(2, 9, 2, 12), rectangle(2, 9, 2, 8)
    assert np.array_equal(told(laid, [seen(there)] * 20), rectangle(2, 9, 9, 12))


def test_where_nothing_can_be_read_or_a_hand_is_nothing_is_bare() -> None:
    laid = rectangle(2, 9, 2, 12)
    hand = np.full((ROWS, COLUMNS), TABLE - 60, np.uint16)
    dark = np.full((ROWS, COLUMNS), NO_READING, np.uint16)
    assert not told(laid, [hand] * 40).any()
    assert not told(laid, [dark] * 40).any()


def test_what_wavers_is_not_bare() -> None:
    laid = rectangle(3, 6, 3, 6)
    assert not told(laid, ([EMPTY] * 8 + [seen(laid)]) * 6).any()


@given(
    st.tuples(st.integers(0, 6), st.integers(7, ROWS), st.integers(0, 8), st.integers(9, COLUMNS)),
    st.lists(st.booleans(), min_size=ROWS * COLUMNS, max_size=ROWS * COLUMNS),
)
def test_what_is_there_is_never_bare(sides: tuple[int, int, int, int], bits: list[bool]) -> None:
    laid = rectangle(*sides)
    there = np.array(bits).reshape(ROWS, COLUMNS) & laid
    said = told(laid, [seen(there)] * 20)
    assert not (said & (there | ~laid)).any()
