"""Fingers that keep still: averaged while the picture around them stays the same, and at once elsewhere when not."""

from dataclasses import replace

import numpy as np
import pytest
from touchd.contacts.fit import Picture
from touchd.contacts.heights import Box
from touchd.contacts.steady import Steady
from touchd.model import Floats

from unit.fingertips import STEP_MM, seen_at

BOX = Box(100, 200, 180, 260)
ONE = seen_at(140.0, 230.0)


def a_picture(seed: int = 0, raised_mm: float = 0.0, noise_mm: float = 0.2) -> Picture:
    """Heights of a bump in the box's middle, with noise."""
    heights = np.random.default_rng(seed).normal(0.0, noise_mm, (60, 80)).astype(np.float32)
    heights[20:40, 30:50] += np.float32(12.0 + raised_mm)
    return Picture(heights, np.full((60, 80), 255, np.uint8), BOX)


def averages(clearances_mm: list[float], raised_mm: list[float]) -> list[float]:
    """What is said of a finger in pictures in which its fit has these clearances and it is raised that much."""
    steady = Steady(STEP_MM)
    said = []
    for number, (clearance, raised) in enumerate(zip(clearances_mm, raised_mm, strict=True)):
        one = replace(ONE, clearance_mm=clearance)
        (seen,) = steady.settle([one], a_picture(number, raised))
        said.append(seen.clearance_mm)
    return said


def test_fits_of_a_finger_that_keeps_still_are_averaged() -> None:
    assert averages([4.0, 8.0, 0.0, 12.0], [0.0] * 4) == pytest.approx([4.0, 6.0, 4.0, 6.0])


def test_once_the_picture_changes_only_the_latest_fit_counts() -> None:
    assert averages([1.0, 1.0, 7.0, 7.0], [0.0, 0.0, 5.0, 5.0]) == pytest.approx([1.0, 1.0, 7.0, 7.0])


def test_a_slow_change_counts_as_soon_as_it_adds_up() -> None:
    said = averages([0.25 * k for k in range(40)], [0.25 * k for k in range(40)])
    assert max(0.25 * k - value for k, value in enumerate(said)) < 1.2


def pictures(raised_mm: list[float], noise_mm: float = 0.05) -> list[int]:
    """How many pictures a finger's average is of, in pictures in which it is raised that much."""
    steady = Steady(STEP_MM)
    seen = [steady.settle([ONE], a_picture(k, raised, noise_mm)) for k, raised in enumerate(raised_mm)]
    return [one.pictures for (one,) in seen]


def test_a_single_picture_in_which_a_known_finger_seems_to_have_moved_may_be_noise() -> None:
    assert pictures([0.0] * 6 + [1.1] + [0.0] * 2) == [1, 2, 3, 4, 5, 6, 7, 8, 9]


def test_two_such_pictures_are_none_nor_is_one_in_which_it_plainly_moved_or_that_comes_early() -> None:
    assert pictures([0.0] * 6 + [1.1] * 3) == [1, 2, 3, 4, 5, 6, 7, 1, 2]
    assert pictures([0.0] * 6 + [1.6] * 2) == [1, 2, 3, 4, 5, 6, 1, 2]
    assert pictures([0.0] * 4 + [1.1] * 2) == [1, 2, 3, 4, 1, 2]


def test_much_noise_alone_never_makes_a_finger_move() -> None:
    assert pictures([0.0] * 300, noise_mm=0.77)[30:] == [30] * 270


def test_a_fit_that_comes_out_elsewhere_on_a_finger_that_keeps_still_went_astray() -> None:
    steady = Steady(STEP_MM)
    for number in range(6):
        steady.settle([ONE], a_picture(number))
    (seen,) = steady.settle([replace(ONE, u=ONE.u - 10.0)], a_picture(6))
    assert (seen.u, seen.v, seen.pictures, seen.shown) == (140.0, 230.0, 6, False)
    (seen,) = steady.settle([ONE], a_picture(7))
    assert (seen.u, seen.pictures, seen.shown) == (140.0, 7, True)


def test_a_fit_beside_a_finger_that_keeps_still_or_on_one_that_moved_is_none_that_went_astray() -> None:
    steady, beside, along = Steady(STEP_MM), replace(ONE, v=ONE.v + 10.0), replace(ONE, u=ONE.u - 10.0)
    for number in range(6):
        steady.settle([ONE], a_picture(number))
    assert [seen.v for seen in steady.settle([beside, ONE], a_picture(6))] == pytest.approx([230.0, 240.0])
    (seen,) = steady.settle([along], a_picture(7, raised_mm=5.0))
    assert (seen.u, seen.pictures) == (130.0, 1)


def test_how_many_pictures_an_average_is_of_is_said_and_bounded() -> None:
    steady = Steady(STEP_MM)
    counts = [steady.settle([ONE], a_picture(number))[0].pictures for number in range(40)]
    assert counts == [min(number + 1, 30) for number in range(40)]


def test_places_and_directions_are_averaged_the_short_way_round() -> None:
    steady = Steady(STEP_MM)
    steady.settle([ONE], a_picture(0))
    (seen,) = steady.settle([replace(ONE, u=142.0, u_under=145.0, angle=-3.1)], a_picture(1))
    assert (seen.u, seen.v) == (141.0, 230.0)
    assert (seen.u_under, seen.v_under) == (143.0, 231.0)
    assert seen.angle == pytest.approx(np.pi)


def test_what_pictures_say_of_touching_is_averaged_as_well() -> None:
    steady = Steady(STEP_MM)
    steady.settle([ONE], a_picture(0))
    (seen,) = steady.settle([replace(ONE, odds=-2.0, finger_odds=1.0)], a_picture(1))
    assert (seen.odds, seen.finger_odds) == (-0.5, 2.0)


def test_a_finger_that_no_outline_showed_is_still_there_if_the_picture_is_as_it_was() -> None:
    steady = Steady(STEP_MM)
    for number in range(2):
        steady.settle([ONE], a_picture(number))
    (missing,) = steady.settle([], a_picture(2))
    assert (missing.u, missing.v, missing.shown) == (140.0, 230.0, False)
    assert steady.settle([], a_picture(3, raised_mm=9.0)) == []


def test_of_two_sightings_of_one_finger_the_one_that_is_no_longer_seen_is_not_missed() -> None:
    steady, other = Steady(STEP_MM), replace(ONE, u=147.0)
    for number in range(2):
        steady.settle([ONE, other], a_picture(number))
    assert [seen.u for seen in steady.settle([other], a_picture(2))] == [147.0]


def test_what_was_seen_but_once_is_not_missed() -> None:
    steady = Steady(STEP_MM)
    steady.settle([ONE], a_picture(0))
    assert steady.settle([], a_picture(1)) == []


def test_two_fingers_are_averaged_each_with_itself() -> None:
    steady = Steady(STEP_MM)
    other = replace(ONE, u=152.0, clearance_mm=10.0)
    steady.settle([ONE, other], a_picture(0))
    said = steady.settle([other, ONE], a_picture(1))
    assert [(seen.u, seen.clearance_mm) for seen in said] == [(152.0, 10.0), (140.0, 4.0)]


@pytest.mark.parametrize("box", [Box(150, 200, 180, 260), Box(300, 300, 380, 360)])
def test_where_the_picture_no_longer_shows_all_around_it_a_finger_begins_anew(box: Box) -> None:
    steady = Steady(STEP_MM)
    for number in range(3):
        steady.settle([ONE], a_picture(number))
    shape = (box.bottom - box.top, box.right - box.left)
    heights: Floats = np.zeros(shape, np.float32)
    (seen,) = steady.settle([ONE], Picture(heights, np.full(shape, 255, np.uint8), box))
    assert seen.pictures == 1


def test_two_sightings_that_turn_out_to_be_the_same_finger_are_one_the_one_known_for_longer() -> None:
    steady = Steady(STEP_MM)
    for number in range(2):
        steady.settle([ONE], a_picture(number))
    beside = replace(ONE, u=ONE.u + 6.0, odds=4.0)
    (seen,) = steady.settle([beside, ONE], a_picture(2))
    assert (seen.u, seen.pictures) == (140.0, 3)
