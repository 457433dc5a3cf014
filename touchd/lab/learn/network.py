"""Training the judge: a network of two hidden layers, by stochastic gradient descent (Adam) in plain numpy."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from touchd.contacts.judge import CLEARANCE_MM, LEAK, PLACE_MM, Layer
from touchd.lab.learn.adam import Adam
from touchd.lab.learn.goals import placed, verdicts
from touchd.lab.learn.samples import Samples
from touchd.model import Floats

_HIDDEN = (160, 64)
_BATCH = 256
_RATE, _DECAY = 2e-3, 4e-2
# What is done to the traits in each sight of a sample, so that no single one is relied on: the share that is left out,
# and the standard deviation of what is added to all.
_MISSING, _NOISE = 0.05, np.float32(0.12)
_FINGER, _CLEARANCE, _PLACE = 0.5, 0.5, 0.7  # what an answer counts beside that of touching or not
_HIGHEST_MM = 40.0  # clearance that is told


@dataclass(frozen=True, slots=True)
class _Lesson:
    """What the network should answer (N, 5), in its own units, and how much each answer counts (N, 5)."""

    traits: Floats
    answers: Floats
    counts: Floats


def train(samples: Samples, rounds: int, seed: int = 0) -> list[Layer]:
    """Return the layers of a network that answers as in :class:`touchd.contacts.judge.Judge`."""
    lesson = _lesson(samples)
    rng = np.random.default_rng(seed)
    sizes = (lesson.traits.shape[1], *_HIDDEN, lesson.answers.shape[1])
    weights = [_drawn(rng, a, b) for a, b in pairwise(sizes)]
    biases = [np.zeros(size, np.float32) for size in sizes[1:]]
    adam = Adam([*weights, *biases], _DECAY)
    for round_ in range(rounds):
        rate = 0.5 * _RATE * (1.0 + float(np.cos(np.pi * round_ / rounds)))
        order = rng.permutation(len(lesson.traits))
        for begin in range(0, len(order), _BATCH):
            which = order[begin : begin + _BATCH]
            shown = lesson.traits[which]
            shown = shown + _NOISE * rng.standard_normal(shown.shape, np.float32)
            shown *= rng.random(shown.shape, dtype=np.float32) > _MISSING
            gradients = _gradients(weights, biases, shown, lesson.answers[which], lesson.counts[which])
            adam.step(gradients, rate, len(weights))
    return list(zip(weights, biases, strict=True))


def _lesson(samples: Samples) -> _Lesson:
    finger, touching, clearance_mm = samples.finger > 0, samples.touching > 0, np.nan_to_num(samples.clearance_mm)
    low, unclear = verdicts(finger, touching, clearance_mm, samples.step_mm)
    near = finger & (clearance_mm < _HIGHEST_MM)
    near_place = placed(touching, np.nan_to_num(samples.place_mm))
    place = np.where(near_place[:, None], np.nan_to_num(samples.place_mm), 0.0) / PLACE_MM
    answers = np.column_stack([low, finger, np.where(near, clearance_mm, 0.0) / CLEARANCE_MM, place])
    counts = np.column_stack(
        [~unclear, _FINGER * (finger >= 0), _CLEARANCE * near, _PLACE * near_place, _PLACE * near_place]
    )
    return _Lesson(samples.traits, answers.astype(np.float32), (counts * samples.weight[:, None]).astype(np.float32))


def _drawn(rng: np.random.Generator, inputs: int, outputs: int) -> Floats:
    drawn: Floats = rng.standard_normal((inputs, outputs), np.float32) * np.float32(np.sqrt(1.6 / inputs))
    return drawn


def _gradients(
    weights: list[Floats], biases: list[Floats], traits: Floats, answers: Floats, counts: Floats
) -> list[Floats]:
    """Return the gradients by all weights and then all biases of the mean loss.

    The two odds have the logarithmic loss, the lengths Huber's with a unit of 1.
    """
    values = [traits]
    for i, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        value = values[-1] @ weight + bias
        values.append(np.maximum(value, LEAK * value) if i < len(weights) - 1 else value)
    said = values[-1]
    off = said - answers
    off[:, :2] = 1.0 / (1.0 + np.exp(-said[:, :2])) - answers[:, :2]
    slope = counts * np.clip(off, -1.0, 1.0) / np.float32(len(traits))
    by_weight, by_bias = [], []
    for i in reversed(range(len(weights))):
        by_weight.append(values[i].T @ slope)
        by_bias.append(slope.sum(axis=0))
        slope = (slope @ weights[i].T) * np.where(values[i] > 0.0, np.float32(1.0), LEAK)
    return [*reversed(by_weight), *reversed(by_bias)]
