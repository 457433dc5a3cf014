"""The judge: from a fitted fingertip's traits to what is said of it."""

import numpy as np
import pytest
from touchd.contacts.judge import Judge, Opinion, learned_judge


def test_it_answers_in_log_odds_and_mm() -> None:
    judge = Judge([(np.zeros((3, 5), np.float32), np.array([1.5, -2.0, 0.5, 0.5, -1.0], np.float32))])
    (said,) = judge.opinions(np.ones((1, 3), np.float32))
    assert said == Opinion(1.5, -2.0, clearance_mm=5.0, along_mm=1.0, across_mm=-2.0, impression=said.impression)


def test_it_shows_what_it_answers_from() -> None:
    first = np.array([[2.0, -3.0]], np.float32), np.zeros(2, np.float32)
    second = np.ones((2, 5), np.float32), np.zeros(5, np.float32)
    (said,) = Judge([first, second]).opinions(np.array([[1.0]], np.float32))
    assert said.impression == pytest.approx([2.0, -0.3])


def test_hidden_values_below_zero_count_a_tenth() -> None:
    first = np.array([[1.0, -1.0]], np.float32), np.zeros(2, np.float32)
    second = np.array([[1.0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0]], np.float32), np.zeros(5, np.float32)
    (said,) = Judge([first, second]).opinions(np.array([[2.0]], np.float32))
    assert said.odds == pytest.approx(2.0 - 0.2)


def test_each_fingertip_is_judged_by_its_own_traits() -> None:
    judge, width = learned_judge(), learned_judge_width()
    traits = np.random.default_rng(0).normal(0.0, 1.0, (4, width)).astype(np.float32)
    together = [said.odds for said in judge.opinions(traits)]
    alone = [judge.opinions(traits[i : i + 1])[0].odds for i in range(4)]
    assert together == pytest.approx(alone, abs=1e-4)
    assert len(set(together)) == 4


def learned_judge_width() -> int:
    """How many traits the judge that comes with touchd is made for."""
    return int(learned_judge()._layers[0][0].shape[0])
