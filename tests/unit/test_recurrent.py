"""The recurrent network: states that go on, and words from those beside."""

from dataclasses import fields, replace

import numpy as np
import pytest
from touchd.contacts.recurrent import Weights, learned_weights, opened, scaled, step
from touchd.model import Floats

NOTHING_HEARD = np.zeros((1, 1), np.float32)


def drawn(seed: int = 0, inputs: int = 5, look: int = 4, word: int = 3, state: int = 2) -> Weights:
    """A small network at random."""
    rng = np.random.default_rng(seed)

    def of(*shape: int) -> Floats:
        return rng.normal(0.0, 0.7, shape).astype(np.float32)

    return Weights(
        *(of(inputs), np.abs(of(inputs)) + 1, of(inputs, look), of(look), of(look + state, word), of(word)),
        *(of(look + word, 3 * state), of(3 * state), of(state, 3 * state), of(state), of(state + look, 5), of(5)),
    )


def test_inputs_are_taken_by_their_usual_size_and_none_counts_too_much() -> None:
    weights = replace(drawn(), centre=np.full(5, 2.0, np.float32), scale=np.full(5, 0.5, np.float32))
    assert scaled(weights, np.array([[2.0, 2.5, 1.0, 99.0, -99.0]], np.float32)).tolist() == [
        [0.0, 1.0, -2.0, 4.0, -4.0]
    ]


def test_gates_open_from_none_to_all() -> None:
    assert opened(np.array([-80.0, 0.0, 80.0], np.float32)).tolist() == [0.0, 0.5, 1.0]


def test_a_state_is_kept_where_its_gate_is_open_and_new_where_it_is_shut() -> None:
    weights, before = drawn(), np.array([[0.3, -0.6]], np.float32)
    keeps = replace(weights, gates_bias=np.array([0, 0, 50, -50, 0, 0], np.float32))
    _, state = step(keeps, np.zeros((1, 5), np.float32), before, NOTHING_HEARD)
    assert state[0, 0] == pytest.approx(0.3)
    assert state[0, 1] != pytest.approx(-0.6, abs=1e-3)


def test_fingertips_that_hear_nobody_are_as_if_alone() -> None:
    weights, rng = drawn(), np.random.default_rng(1)
    inputs, before = rng.normal(size=(3, 5)).astype(np.float32), rng.normal(size=(3, 2)).astype(np.float32)
    together, states = step(weights, inputs, before, np.zeros((3, 3), np.float32))
    for i in range(3):
        (alone,), state = step(weights, inputs[i : i + 1], before[i : i + 1], NOTHING_HEARD)
        assert (alone.odds, alone.clearance_mm) == pytest.approx((together[i].odds, together[i].clearance_mm), abs=1e-5)
        assert state[0] == pytest.approx(states[i], abs=1e-6)


def test_what_is_heard_changes_what_is_said() -> None:
    weights, inputs = drawn(), np.random.default_rng(1).normal(size=(2, 5)).astype(np.float32)
    before = np.zeros((2, 2), np.float32)
    alone, _ = step(weights, inputs, before, np.zeros((2, 2), np.float32))
    heard, _ = step(weights, inputs, before, np.array([[0.0, 1.0], [0.0, 0.0]], np.float32))
    assert heard[0].odds != pytest.approx(alone[0].odds, abs=1e-3)
    assert heard[1].odds == pytest.approx(alone[1].odds)


def test_the_network_that_comes_with_touchd_fits_together() -> None:
    weights = learned_weights()
    assert all(getattr(weights, field.name).dtype == np.float32 for field in fields(Weights))
    inputs = np.tile(weights.centre, (2, 1))
    said, states = step(weights, inputs, np.zeros((2, weights.state_size), np.float32), np.zeros((2, 2), np.float32))
    assert len(said) == len(states) == 2
    assert np.isfinite(states).all()
