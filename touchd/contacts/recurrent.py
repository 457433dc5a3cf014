"""A small recurrent network over fingertips: each has a state that goes on from picture to picture.

Every fingertip is looked at, hears from those beside it what they are and were (the mean of their words, as in a graph
network), and moves its state by what it saw and heard: a gated recurrent unit (K. Cho et al., "Learning Phrase
Representations using RNN Encoder-Decoder", 2014). Learned by ``make judge``.
"""

from dataclasses import dataclass, fields
from importlib.resources import files

import numpy as np

from touchd.contacts.judge import CLEARANCE_MM, LEAK, PLACE_MM
from touchd.model import Floats

_MOST = np.float32(4.0)  # that any input counts, in its standard deviations


@dataclass(frozen=True, slots=True)
class Weights:
    """What a network is made of, all float32.

    F inputs less their ``centre`` (F,), over their ``scale`` (F,), become a look (L,) with ``look``; that and the last
    state (S,) a word (W,) with ``word``. ``gates`` (L + W, 3 S) and ``past`` (S, 3 S) move the state: how much of the
    last one is seen, how much is kept, and what comes new. ``answer`` (S + L, 5) says what is in :class:`Said`.
    """

    centre: Floats
    scale: Floats
    look: Floats
    look_bias: Floats
    word: Floats
    word_bias: Floats
    gates: Floats
    gates_bias: Floats
    past: Floats
    past_bias: Floats
    answer: Floats
    answer_bias: Floats

    @property
    def state_size(self) -> int:
        """S."""
        return len(self.past)

    @property
    def word_size(self) -> int:
        """W."""
        return len(self.word_bias)


@dataclass(frozen=True, slots=True)
class Said:
    """What is said of a fingertip by all pictures so far, and by those beside it.

    ``odds``: the logarithm of its odds of touching; ``finger_odds``: of being a fingertip at all; ``clearance_mm``: the
    gap below it. ``along_mm``, ``across_mm``: how far from where it is seen at rest it touches, the way it points.
    """

    odds: float
    finger_odds: float
    clearance_mm: float
    along_mm: float
    across_mm: float


def step(weights: Weights, inputs: Floats, before: Floats, hearing: Floats) -> tuple[list[Said], Floats]:
    """Return what is said of N fingertips, and their states (N, S) for the next picture.

    ``inputs`` (N, F); ``before`` (N, S) the states in the last picture, 0 where there was none; ``hearing`` (N, N) how
    much each hears of the others, rows summing to 1 or 0.
    """
    look = leaking(scaled(weights, inputs) @ weights.look + weights.look_bias)
    words = leaking(np.concatenate([look, before], axis=1) @ weights.word + weights.word_bias)
    heard = hearing @ words
    size = weights.state_size
    now = np.concatenate([look, heard], axis=1) @ weights.gates + weights.gates_bias
    then = before @ weights.past
    gates = opened(now[:, : 2 * size] + then[:, : 2 * size])
    new = np.tanh(now[:, 2 * size :] + gates[:, :size] * (then[:, 2 * size :] + weights.past_bias))
    state = new + gates[:, size:] * (before - new)
    said: list[list[float]] = (np.concatenate([state, look], axis=1) @ weights.answer + weights.answer_bias).tolist()
    return [
        Said(odds, finger, CLEARANCE_MM * clearance, PLACE_MM * along, PLACE_MM * across)
        for odds, finger, clearance, along, across in said
    ], state


def scaled(weights: Weights, inputs: Floats) -> Floats:
    """Return inputs (N, F) as a network takes them."""
    taken = (inputs - weights.centre) / weights.scale
    # In one pass each; numpy's clip takes twice as long.
    np.minimum(taken, _MOST, out=taken)
    np.maximum(taken, -_MOST, out=taken)
    return taken


def leaking(values: Floats) -> Floats:
    """Return values, the negative ones made small."""
    leaked: Floats = np.maximum(values, LEAK * values)
    return leaked


def opened(values: Floats) -> Floats:
    """Return how far gates are open, from 0 to 1."""
    share: Floats = np.float32(0.5) * (np.float32(1.0) + np.tanh(np.float32(0.5) * values))
    return share


def learned_weights() -> Weights:
    """Return the network that comes with touchd."""
    with files("touchd.contacts").joinpath("belief.npz").open("rb") as stored, np.load(stored) as arrays:
        return Weights(*(arrays[field.name].astype(np.float32) for field in fields(Weights)))
