"""Teaching beliefs: what they are learned from, that gradients are right, and that something is learned."""

from dataclasses import fields, replace

import numpy as np
import pytest
from touchd.contacts.recurrent import Weights, scaled, step
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.trials import learn, pipeline_of, scene_truth
from touchd.lab.learn.courses import Course, course
from touchd.lab.learn.later import later_lessons
from touchd.lab.learn.lessons import belief_lessons, judge_lessons
from touchd.lab.learn.unrolled import Chunk, chunked, gradients, loss, side_by_side, train_beliefs, train_on
from touchd.lab.scenes import lab_scene
from touchd.model import Floats, State, TouchFrame
from touchd.tracking.settings import TrackingSettings

from unit.test_recurrent import drawn

INPUTS = 5
_SMALL = np.float32(1e-2)


def made_up(frames: int, seed: int = 0) -> Course:
    """Two fingertips side by side in each frame, that touch if the other one's first input was positive a frame ago."""
    rng = np.random.default_rng(seed)
    inputs = rng.normal(0.0, 1.0, (2 * frames, INPUTS)).astype(np.float32)
    rows = np.arange(2 * frames)
    other = rows ^ 1
    touching = np.zeros(2 * frames, np.bool_)
    touching[2:] = inputs[other[2:] - 2, 0] > 0.0
    return Course(
        inputs=inputs,
        frame=rows // 2 + 100,
        last=np.where(rows < 2, -1, rows - 2),
        heard=np.column_stack([rows, other]),
        touching=touching,
        finger=np.ones(2 * frames, np.bool_),
        either=np.zeros(2 * frames, np.bool_),
        clearance_mm=np.where(touching, 0.0, 20.0).astype(np.float32),
        place_mm=rng.normal(0.0, 2.0, (2 * frames, 2)).astype(np.float32),
        step_mm=np.full(2 * frames, 1.6, np.float32),
    )


def said_by(weights: Weights, chunk: Chunk) -> Floats:
    """The odds of each row, as touchd would say them frame by frame."""
    states = np.zeros((len(chunk.inputs) + 1, weights.state_size), np.float32)
    odds = []
    for at, hearing in zip(chunk.frames, chunk.hearing, strict=True):
        said, states[at] = step(weights, chunk.inputs[at], states[chunk.last[at]], hearing)
        odds += [each.odds for each in said]
    return np.array(odds, np.float32)


def test_chunks_begin_without_a_past_and_keep_to_their_frames() -> None:
    first, second = chunked(made_up(80))
    assert (len(first.frames), len(second.frames)) == (60, 20)
    assert second.last[:4].tolist() == [-1, -1, 0, 1]
    assert second.hearing[0].tolist() == [[0.0, 1.0], [1.0, 0.0]]
    assert first.answers[:, 1].all()


def test_of_a_finger_that_may_be_taken_for_touching_or_not_neither_that_nor_its_height_is_taught() -> None:
    course = made_up(7)
    (plain,), (held,) = chunked(course), chunked(replace(course, either=np.ones(14, np.bool_)))
    assert plain.counts[:, [0, 2]].all()
    assert not held.counts[:, [0, 2]].any()
    assert held.counts[:, 1].all()


def test_heights_are_taught_from_higher_up_than_hovers_are_followed() -> None:
    hovering = replace(made_up(20), touching=np.zeros(40, np.bool_))
    highest_mm = TrackingSettings().hover_mm + 5.0
    for height_mm, is_taught in ((highest_mm, True), (90.0, False)):
        (chunk,) = chunked(replace(hovering, clearance_mm=np.full(40, height_mm, np.float32)))
        assert chunk.counts[:, 2].all() == is_taught
        assert chunk.counts[:, :2].all()


def test_gradients_are_the_loss_s_slopes() -> None:
    (chunk,) = chunked(made_up(7))
    names = [field.name for field in fields(Weights)][2:]
    weights = drawn(seed=3)
    for name, gradient in zip(names, gradients(weights, chunk, chunk.inputs), strict=True):
        place = tuple(0 for _ in gradient.shape)
        for at in (place, tuple(size - 1 for size in gradient.shape)):
            moved = [getattr(weights, name).copy() for _ in range(2)]
            moved[0][at] += _SMALL
            moved[1][at] -= _SMALL
            up, down = (loss(replace(weights, **{name: one}), chunk, chunk.inputs) for one in moved)
            assert gradient[at] == pytest.approx((up - down) / (2 * _SMALL), rel=0.03, abs=0.01), (name, at)


def test_chunks_side_by_side_have_the_sum_of_their_gradients() -> None:
    chunks = [chunk for frames, seed in ((7, 1), (3, 2), (61, 3)) for chunk in chunked(made_up(frames, seed))]
    weights = drawn(seed=3)
    each = [gradients(weights, chunk, chunk.inputs) for chunk in chunks]
    together = side_by_side(chunks)
    for parts, whole in zip(zip(*each, strict=True), gradients(weights, together, together.inputs), strict=True):
        np.testing.assert_allclose(whole, np.sum(parts, axis=0), rtol=1e-3, atol=1e-3)


def test_what_others_were_before_is_learned() -> None:
    weights = train_beliefs([made_up(60, seed) for seed in range(60)], rounds=15)
    (chunk,) = chunked(made_up(60, seed=999))
    odds = said_by(weights, chunk)
    assert np.mean((odds > 0.0) == (chunk.answers[:, 0] > 0.0)) > 0.9


def test_the_same_courses_teach_the_same_beliefs() -> None:
    first, second = (train_beliefs([made_up(60)], rounds=1) for _ in range(2))
    assert all((getattr(first, each.name) == getattr(second, each.name)).all() for each in fields(Weights))


def test_more_courses_teach_what_the_first_ones_did_not_and_leave_the_weights_they_began_with() -> None:
    first = train_beliefs([made_up(60, seed) for seed in range(12)], rounds=2)
    began = [getattr(first, field.name).copy() for field in fields(Weights)]
    later = train_on(first, [made_up(60, seed) for seed in range(100, 160)], rounds=15)
    (chunk,) = chunked(made_up(60, seed=999))
    before, after = (loss(one, chunk, scaled(one, chunk.inputs)) for one in (first, later))
    assert after < 0.7 * before
    assert all((getattr(first, field.name) == old).all() for field, old in zip(fields(Weights), began, strict=True))


def test_what_is_learned_later_is_the_mean_of_what_each_order_of_it_teaches() -> None:
    first, courses = train_beliefs([made_up(60)], rounds=1), [made_up(60, seed) for seed in range(20)]
    one, other, both = (train_on(first, courses, 1, seeds) for seeds in ((0,), (1,), (0, 1)))
    for field in fields(Weights):
        alone, apart, mean = (getattr(weights, field.name) for weights in (one, other, both))
        assert mean.dtype == np.float32
        assert mean == pytest.approx(0.5 * (alone + apart), abs=1e-6)
    assert (one.look != other.look).any()


def test_a_course_says_what_was_seen_and_what_was_true() -> None:
    scene = lab_scene("targets", 750.0, 1)
    pipeline = pipeline_of(Contender("fingertip", "fingertip"), scene, learn(scene))
    first = scene.calibration_frames
    seen = course(pipeline, (scene.frame(index) for index in range(first, first + 60)), scene_truth(scene))
    assert seen is not None
    assert seen.touching.any()
    assert (seen.clearance_mm[seen.touching] == 0.0).all()
    assert 0.0 < np.median(np.abs(seen.place_mm[seen.touching])) < 2.0
    assert (np.diff(seen.frame) >= 0).all()
    before = seen.last >= 0
    assert before.any()
    assert (seen.frame[before] > seen.frame[seen.last[before]]).all()
    assert (seen.frame[seen.heard[:, 0]] == seen.frame[seen.heard[:, 1]]).all()
    nothing = (scene.frame(index) for index in range(first, first + 3))
    assert course(pipeline, nothing, scene_truth(scene)) is None


def test_a_frame_that_nobody_looked_at_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = lab_scene("targets", 750.0, 1)
    pipeline = pipeline_of(Contender("fingertip", "fingertip"), scene, learn(scene))
    step, first = pipeline.step, scene.calibration_frames
    paused = TouchFrame(0, 0, State.PAUSED)
    monkeypatch.setattr(pipeline, "step", lambda frame: step(frame) if frame.index % 2 else paused)
    seen = course(pipeline, (scene.frame(index) for index in range(first, first + 60)), scene_truth(scene))
    assert seen is not None
    assert (seen.frame % 2 == 1).all()


def test_beliefs_learn_from_nothing_that_the_judge_was_taught() -> None:
    taught = {(lesson.scene, lesson.seed) for lesson in judge_lessons()}
    lessons = [*belief_lessons(), *later_lessons()]
    assert not taught & {(lesson.scene, lesson.seed) for lesson in lessons}
    assert len({(lesson.scene, lesson.height_mm, lesson.seed) for lesson in lessons}) == len(lessons)
