"""Whether a fingertip touches, over time: which one of the last pictures it is, and that its past counts."""

from collections.abc import Sequence

import pytest
from touchd.contacts.belief import Beliefs, Known
from touchd.contacts.company import Standing
from touchd.contacts.recurrent import Said, learned_weights
from touchd.model import Floats

from unit.fingertips import PIXEL_MM, standing_at


@pytest.fixture
def beliefs() -> Beliefs:
    return Beliefs(PIXEL_MM, learned_weights())


def odds(beliefs: Beliefs, *standing: Standing) -> list[float]:
    return [belief.said.odds for belief in beliefs.update(standing)]


def test_what_a_fingertip_was_before_counts(beliefs: Beliefs) -> None:
    odds(beliefs, standing_at(100.0, 100.0, odds=6.0))
    (second,) = odds(beliefs, standing_at(100.0, 100.0, odds=0.0))
    (alone,) = odds(Beliefs(PIXEL_MM, learned_weights()), standing_at(100.0, 100.0, odds=0.0))
    assert second != pytest.approx(alone, abs=0.01)


def test_a_fingertip_is_known_again_where_it_has_moved_to(beliefs: Beliefs) -> None:
    (new,) = odds(Beliefs(PIXEL_MM, learned_weights()), standing_at(120.0, 100.0))
    odds(beliefs, standing_at(100.0, 100.0, odds=6.0))
    assert odds(beliefs, standing_at(120.0, 100.0)) != [pytest.approx(new, abs=0.01)]


def test_one_that_jumps_farther_than_fingers_do_is_new(beliefs: Beliefs) -> None:
    (new,) = odds(Beliefs(PIXEL_MM, learned_weights()), standing_at(140.0, 100.0))
    odds(beliefs, standing_at(100.0, 100.0, odds=6.0))
    assert odds(beliefs, standing_at(140.0, 100.0)) == [pytest.approx(new, abs=1e-5)]


class Sure(Beliefs):
    """Beliefs of a network that takes whatever it is shown for a touch."""

    def think(self, now: Sequence[Standing], last: Sequence[Known | None]) -> tuple[list[Said], Floats]:
        _, states = super().think(now, last)
        return [Said(9.0, 9.0, 0.0, 0.0, 0.0) for _ in now], states


def test_no_belief_goes_far_beyond_the_best_that_the_judge_said_lately() -> None:
    sure = Sure(PIXEL_MM, learned_weights())
    assert odds(sure, standing_at(100.0, 100.0, odds=-4.0)) == [-1.0]
    assert odds(sure, standing_at(101.0, 100.0, odds=2.0)) == [5.0]
    later = [odds(sure, standing_at(101.0, 100.0, odds=-3.0))[0] for _ in range(7)]
    assert later == [4.0, 3.0, 2.0, 1.0, 0.0, 0.0, 0.0]


class Remembering(Beliefs):
    """Beliefs that tell which fingertip of the last picture each one was taken for."""

    before: Sequence[Standing | None] = ()

    def think(self, now: Sequence[Standing], last: Sequence[Known | None]) -> tuple[list[Said], Floats]:
        self.before = [None if known is None else known.standing for known in last]
        return super().think(now, last)


@pytest.fixture
def remembering() -> Remembering:
    return Remembering(PIXEL_MM, learned_weights())


def test_a_fast_fingertip_is_itself_though_another_was_nearer_to_where_it_is_now(remembering: Remembering) -> None:
    fast, other = standing_at(125.0, 100.0, odds=6.0), standing_at(140.0, 100.0)
    remembering.update([standing_at(100.0, 100.0, odds=6.0)])
    remembering.update([fast, other])
    remembering.update([standing_at(149.0, 100.0)])
    assert remembering.before == [fast]


def test_one_that_stops_is_itself_as_well(remembering: Remembering) -> None:
    fast = standing_at(125.0, 100.0, odds=6.0)
    remembering.update([standing_at(100.0, 100.0, odds=6.0)])
    remembering.update([fast, standing_at(149.0, 100.0)])
    remembering.update([standing_at(126.0, 100.0)])
    assert remembering.before == [fast]


@pytest.mark.parametrize(("finger_odds", "robs"), [(9.0, True), (-9.0, False)])
def test_what_was_no_fingertip_is_taken_for_none_if_another_could_be_it(
    remembering: Remembering, finger_odds: float, robs: bool
) -> None:
    finger = standing_at(100.0, 100.0, odds=6.0, finger_odds=9.0)
    other = standing_at(107.0, 100.0, odds=-6.0, finger_odds=finger_odds)
    remembering.update([finger, other])
    remembering.update([standing_at(104.0, 100.0)])
    assert remembering.before == [other if robs else finger]


@pytest.mark.parametrize(("missed", "known"), [(1, True), (2, True), (3, False)])
def test_a_fingertip_that_pictures_do_not_show_is_forgotten_soon(beliefs: Beliefs, missed: int, known: bool) -> None:
    (new,) = odds(Beliefs(PIXEL_MM, learned_weights()), standing_at(100.0, 100.0))
    odds(beliefs, standing_at(100.0, 100.0, odds=6.0))
    for _ in range(missed):
        assert odds(beliefs) == []
    (again,) = odds(beliefs, standing_at(100.0, 100.0))
    assert (abs(again - new) > 0.01) == known


def test_each_goes_on_with_its_own_past_in_whatever_order_it_comes() -> None:
    first = [standing_at(100.0, 100.0, odds=6.0), standing_at(100.0, 300.0, odds=-6.0)]
    second = [standing_at(102.0, 100.0, odds=1.0), standing_at(102.0, 300.0, odds=1.0)]
    plain, turned = Beliefs(PIXEL_MM, learned_weights()), Beliefs(PIXEL_MM, learned_weights())
    plain.update(first)
    turned.update(first[::-1])
    assert odds(plain, *second) == pytest.approx(odds(turned, *second[::-1])[::-1], abs=1e-4)
