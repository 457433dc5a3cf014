"""Training beliefs: the recurrent network unrolled over chunks of frames, by gradient descent in plain numpy."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import accumulate, pairwise

import numpy as np

from touchd.contacts.judge import CLEARANCE_MM, LEAK, PLACE_MM
from touchd.contacts.recurrent import Weights, leaking, opened, scaled
from touchd.lab.learn.adam import Adam
from touchd.lab.learn.courses import Course, Rows
from touchd.lab.learn.goals import placed, verdicts
from touchd.model import Floats

_LOOK, _WORD, _STATE, _ANSWERS = 96, 24, 32, 5
_FRAMES = 60  # that a gradient goes back
_BATCH = 8  # chunks
_RATE, _DECAY = 2e-3, 1e-2
_MISSING, _NOISE = 0.05, np.float32(0.1)  # as in network.py
_STEEPEST = 1.0  # a gradient's length
_LEAST_SCALE = 0.05  # of inputs
_FINGER, _CLEARANCE, _PLACE = 0.3, 0.6, 0.3  # what an answer counts beside that of touching or not
# Clearance that is told: higher than hovers are followed, lest those near the top of that seem lower than they are.
_HIGHEST_MM = 50.0
_UNIT = 0.5  # of Huber's loss for lengths
_TRAINED = [field.name for field in fields(Weights) if field.name not in ("centre", "scale")]


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some frames of a course. ``frames``: which rows each has; ``hearing``: of each frame, as in ``recurrent.step``.

    ``answers``, ``counts`` (R, 5): what should be said, in the network's units, and how much that counts.
    """

    inputs: Floats
    last: Rows
    frames: list[slice]
    hearing: list[Floats]
    answers: Floats
    counts: Floats


def train_beliefs(courses: Sequence[Course], rounds: int, seed: int = 0) -> Weights:
    """Return the weights of a network that says of each row what was true of it."""
    rng = np.random.default_rng(seed)
    return _trained(_drawn(rng, courses), courses, rounds, rng)


def train_on(weights: Weights, courses: Sequence[Course], rounds: int, seeds: Sequence[int] = (0, 1)) -> Weights:
    """Return the mean of what a trained network becomes on more courses, in an order of its own for each seed.

    It is surer of what each of them was sure of, and less of what one made of its order (M. Wortsman et al., "Model
    soups", ICML 2022).
    """
    later = [_trained(_copied(weights), courses, rounds, np.random.default_rng(seed)) for seed in seeds]
    return Weights(*(np.mean([getattr(one, each.name) for one in later], axis=0) for each in fields(Weights)))


def _copied(weights: Weights) -> Weights:
    return Weights(*(getattr(weights, field.name).copy() for field in fields(Weights)))


def _trained(weights: Weights, courses: Sequence[Course], rounds: int, rng: np.random.Generator) -> Weights:
    """Change weights, and return them, so that they say better what was true, in steps that get smaller."""
    chunks = [chunk for one in courses for chunk in chunked(one)]
    parameters = [getattr(weights, name) for name in _TRAINED]
    adam = Adam(parameters, _DECAY)
    for round_ in range(rounds):
        rate = 0.5 * _RATE * (1.0 + float(np.cos(np.pi * round_ / rounds)))
        order = rng.permutation(len(chunks))
        for begin in range(0, len(order), _BATCH):
            batch = side_by_side([chunks[i] for i in order[begin : begin + _BATCH]])
            sums = gradients(weights, batch, _disturbed(rng, scaled(weights, batch.inputs)))
            adam.step(_limited(sums, float(batch.counts[:, 0].sum())), rate, len(parameters))
    return weights


def chunked(course: Course) -> Iterator[Chunk]:
    """Yield a course in pieces, of which each begins without a past."""
    low, unclear = verdicts(course.finger, course.touching, course.clearance_mm, course.step_mm)
    near = course.finger & (course.clearance_mm < _HIGHEST_MM) & ~course.either
    there = placed(course.touching, course.place_mm)
    place = np.where(there[:, None], course.place_mm, 0.0) / PLACE_MM
    answers = np.column_stack([low, course.finger, np.where(near, course.clearance_mm, 0.0) / CLEARANCE_MM, place])
    counts = np.column_stack(
        [~(unclear | course.either), np.full(len(low), _FINGER), _CLEARANCE * near, _PLACE * there, _PLACE * there],
    )
    for first in range(int(course.frame[0]), int(course.frame[-1]) + 1, _FRAMES):
        begin, end = np.searchsorted(course.frame, [first, first + _FRAMES]).tolist()
        if begin == end:
            continue
        edges = np.flatnonzero(np.diff(course.frame[begin:end])) + 1
        bounds = [0, *edges.tolist(), end - begin]
        frames = [slice(a, b) for a, b in pairwise(bounds)]
        heard = course.heard[(course.heard[:, 0] >= begin) & (course.heard[:, 0] < end)] - begin
        last = course.last[begin:end] - begin
        yield Chunk(
            course.inputs[begin:end],
            np.where(last >= 0, last, -1),
            frames,
            _hearing(frames, heard),
            answers[begin:end].astype(np.float32),
            counts[begin:end].astype(np.float32),
        )


def side_by_side(chunks: Sequence[Chunk]) -> Chunk:
    """Return chunks as one, each of whose frames holds those of all of them: the same sums in fewer, larger steps."""
    begins = [0, *accumulate(len(chunk.last) for chunk in chunks)]
    frames: list[slice] = []
    hearing: list[Floats] = []
    order: list[Rows] = []
    for at in range(max(len(chunk.frames) for chunk in chunks)):
        there = [(begin, chunk) for begin, chunk in zip(begins, chunks, strict=False) if at < len(chunk.frames)]
        order += [begin + np.arange(chunk.frames[at].start, chunk.frames[at].stop) for begin, chunk in there]
        hearing.append(_apart([chunk.hearing[at] for _, chunk in there]))
        first = frames[-1].stop if frames else 0
        frames.append(slice(first, first + len(hearing[-1])))
    rows = np.concatenate(order)
    place = np.append(np.argsort(rows), -1)
    last = [np.where(chunk.last >= 0, begin + chunk.last, -1) for begin, chunk in zip(begins, chunks, strict=False)]
    return Chunk(
        np.concatenate([chunk.inputs for chunk in chunks])[rows],
        place[np.concatenate(last)[rows]],
        frames,
        hearing,
        np.concatenate([chunk.answers for chunk in chunks])[rows],
        np.concatenate([chunk.counts for chunk in chunks])[rows],
    )


def _apart(hearing: Sequence[Floats]) -> Floats:
    """Return how much the rows of several frames hear of each other if they stand in one: of other frames nothing."""
    together = np.zeros((sum(map(len, hearing)),) * 2, np.float32)
    begin = 0
    for one in hearing:
        end = begin + len(one)
        together[begin:end, begin:end] = one
        begin = end
    return together


@dataclass(frozen=True, slots=True)
class _Run:
    """All that went on in a chunk of R rows: what gradients are made of."""

    look: Floats
    states: Floats  # (R + 1, S): the last one is of what was not there before
    before: Floats
    words: Floats
    heard: Floats
    open_: Floats  # (R, 2 S): how much of the last state is seen, and kept
    passed: Floats
    new: Floats

    def told(self) -> Floats:
        """Return what answers are made from (R, S + L)."""
        return np.concatenate([self.states[:-1], self.look], axis=1)


def _run(weights: Weights, chunk: Chunk, inputs: Floats) -> _Run:
    """Return what ``recurrent.step`` does in all frames of a chunk."""
    size, look_size, rows = weights.state_size, weights.look.shape[1], len(inputs)
    look = leaking(inputs @ weights.look + weights.look_bias)
    looked = look @ weights.word[:look_size] + weights.word_bias
    looked_gates = look @ weights.gates[:look_size] + weights.gates_bias
    shapes = [(rows + 1, size), (rows, size), *[(rows, weights.word_size)] * 2, (rows, 2 * size), *[(rows, size)] * 2]
    run = _Run(look, *(np.zeros(shape, np.float32) for shape in shapes))
    for at, hearing in zip(chunk.frames, chunk.hearing, strict=True):
        old = run.states[chunk.last[at]]
        run.before[at] = old
        run.words[at] = leaking(looked[at] + old @ weights.word[look_size:])
        run.heard[at] = hearing @ run.words[at]
        now, then = looked_gates[at] + run.heard[at] @ weights.gates[look_size:], old @ weights.past
        run.open_[at] = opened(now[:, : 2 * size] + then[:, : 2 * size])
        run.passed[at] = then[:, 2 * size :] + weights.past_bias
        run.new[at] = np.tanh(now[:, 2 * size :] + run.open_[at, :size] * run.passed[at])
        run.states[at] = run.new[at] + run.open_[at, size:] * (old - run.new[at])
    return run


def loss(weights: Weights, chunk: Chunk, inputs: Floats) -> float:
    """Return the summed loss: logarithmic for both odds, Huber's for lengths. ``inputs`` (R, F) are scaled."""
    said = _run(weights, chunk, inputs).told() @ weights.answer + weights.answer_bias
    odds, answers = said[:, :2], chunk.answers[:, :2]
    off = np.abs(said[:, 2:] - chunk.answers[:, 2:])
    huber = np.where(off < _UNIT, 0.5 * off * off, _UNIT * (off - 0.5 * _UNIT))
    return float((chunk.counts * np.column_stack([np.logaddexp(0.0, odds) - answers * odds, huber])).sum())


def gradients(weights: Weights, chunk: Chunk, inputs: Floats) -> list[Floats]:
    """Return the gradients of the loss by each of the weights trained, in their order. ``inputs`` (R, F) are scaled."""
    size, look_size = weights.state_size, weights.look.shape[1]
    run = _run(weights, chunk, inputs)
    told = run.told()
    slope = _loss_slope(told @ weights.answer + weights.answer_bias, chunk)
    by_told = slope @ weights.answer.T
    by_gates, by_past, by_words = _back_in_time(weights, chunk, run, by_told[:, :size])
    by_look = by_told[:, size:] + by_gates @ weights.gates[:look_size].T + by_words @ weights.word[:look_size].T
    by_look *= _leak_slope(run.look)
    return [
        inputs.T @ by_look,
        by_look.sum(axis=0),
        np.concatenate([run.look, run.before], axis=1).T @ by_words,
        by_words.sum(axis=0),
        np.concatenate([run.look, run.heard], axis=1).T @ by_gates,
        by_gates.sum(axis=0),
        run.before.T @ by_past,
        by_past[:, 2 * size :].sum(axis=0),
        told.T @ slope,
        slope.sum(axis=0),
    ]


def _back_in_time(weights: Weights, chunk: Chunk, run: _Run, by_answer: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the derivatives of the loss by what opens the gates, by what they have of the past, and by the words.

    ``by_answer`` (R, S): by the states, as far as they are told at once.
    """
    size, look_size, rows = weights.state_size, weights.look.shape[1], len(by_answer)
    by_state = np.concatenate([by_answer, np.zeros((1, size), np.float32)])
    by_gates, by_past = np.zeros((rows, 3 * size), np.float32), np.zeros((rows, 3 * size), np.float32)
    by_words = np.zeros_like(run.words)
    for at, hearing in zip(reversed(chunk.frames), reversed(chunk.hearing), strict=True):
        down, seen, kept, new = by_state[at], run.open_[at, :size], run.open_[at, size:], run.new[at]
        by_new = down * (1.0 - kept) * (1.0 - new * new)
        by_gates[at, :size] = by_new * run.passed[at] * seen * (1.0 - seen)
        by_gates[at, size : 2 * size] = down * (run.before[at] - new) * kept * (1.0 - kept)
        by_gates[at, 2 * size :] = by_new
        by_past[at] = by_gates[at]
        by_past[at, 2 * size :] *= seen
        by_words[at] = (hearing.T @ (by_gates[at] @ weights.gates[look_size:].T)) * _leak_slope(run.words[at])
        by_before = down * kept + by_past[at] @ weights.past.T + by_words[at] @ weights.word[look_size:].T
        by_state[chunk.last[at]] += by_before  # no two rows were the same one
    return by_gates, by_past, by_words


def _leak_slope(values: Floats) -> Floats:
    return np.where(values > 0.0, np.float32(1.0), LEAK)


def _loss_slope(said: Floats, chunk: Chunk) -> Floats:
    """Return the derivative (R, 5) of the loss by what is said."""
    off = said - chunk.answers
    off[:, :2] = opened(said[:, :2]) - chunk.answers[:, :2]
    off[:, 2:] = np.clip(off[:, 2:], -_UNIT, _UNIT)
    slope: Floats = chunk.counts * off
    return slope


def _disturbed(rng: np.random.Generator, inputs: Floats) -> Floats:
    """Return inputs with noise, and some of them missing."""
    noisy = inputs + _NOISE * rng.standard_normal(inputs.shape, np.float32)
    return noisy * (rng.random(inputs.shape, dtype=np.float32) > _MISSING)


def _limited(sums: Sequence[Floats], count: float) -> list[Floats]:
    """Return the mean over so many rows of gradients, no steeper than allowed."""
    means = [each / np.float32(count + 1.0) for each in sums]
    length = float(np.sqrt(sum(float((mean * mean).sum()) for mean in means)))
    return [mean * np.float32(min(1.0, _STEEPEST / (length + 1e-6))) for mean in means]


def _hearing(frames: Sequence[slice], heard: Rows) -> list[Floats]:
    """Return how much each row of each frame hears of the others in it."""
    found = []
    bounds = np.searchsorted(heard[:, 0], [at.start for at in frames] + [frames[-1].stop]).tolist()
    for at, (begin, end) in zip(frames, pairwise(bounds), strict=True):
        count = at.stop - at.start
        hearing = np.zeros((count, count), np.float32)
        own = heard[begin:end] - at.start
        hearing[own[:, 0], own[:, 1]] = 1.0
        found.append(hearing / np.maximum(hearing.sum(axis=1, keepdims=True), 1.0))
    return found


def _drawn(rng: np.random.Generator, courses: Sequence[Course]) -> Weights:
    """Return weights drawn at random, for inputs of the usual size."""
    inputs = np.concatenate([one.inputs for one in courses])
    count = inputs.shape[1]

    def normal(rows: int, columns: int) -> Floats:
        drawn: Floats = rng.standard_normal((rows, columns), np.float32) * np.float32(rows**-0.5)
        return drawn

    def zeros(size: int) -> Floats:
        return np.zeros(size, np.float32)

    return Weights(
        centre=inputs.mean(axis=0),
        scale=np.maximum(inputs.std(axis=0), np.float32(_LEAST_SCALE)),
        look=normal(count, _LOOK),
        look_bias=zeros(_LOOK),
        word=normal(_LOOK + _STATE, _WORD),
        word_bias=zeros(_WORD),
        gates=normal(_LOOK + _WORD, 3 * _STATE),
        gates_bias=zeros(3 * _STATE),
        past=normal(_STATE, 3 * _STATE),
        past_bias=zeros(_STATE),
        answer=normal(_STATE + _LOOK, _ANSWERS),
        answer_bias=zeros(_ANSWERS),
    )
