"""Teaching the judge: what it learns from, and that it does learn."""

import numpy as np
import pytest
from touchd.contacts.judge import Judge
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.trials import learn, pipeline_of, scene_truth
from touchd.lab.learn.network import train
from touchd.lab.learn.samples import Samples, _LastJudge, joined, samples
from touchd.lab.learn.variety import world
from touchd.lab.scenes import LabScene, lab_scene


def made_up(count: int, seed: int = 0) -> Samples:
    """Fingertips whose first trait tells the clearance, the second where they are, the third that they are none."""
    traits = np.random.default_rng(seed).normal(0.0, 1.0, (count, 6)).astype(np.float32)
    finger = (traits[:, 2] < 0.8).astype(np.float32)
    clearance_mm = np.where(finger > 0, np.maximum(10.0 * traits[:, 0], 0.0), np.nan).astype(np.float32)
    touching = finger * (traits[:, 0] < 0)
    return Samples(
        traits=traits,
        touching=touching,
        finger=finger,
        clearance_mm=clearance_mm,
        place_mm=np.where(finger[:, None] > 0, 2.0 * traits[:, 3:5], np.nan).astype(np.float32),
        step_mm=np.full(count, 1.6, np.float32),
        weight=np.ones(count, np.float32),
    )


def test_a_judge_learns_what_traits_tell() -> None:
    judge, unseen = Judge(train(made_up(6000), rounds=12)), made_up(500, seed=1)
    said = judge.opinions(unseen.traits)
    clear = (unseen.finger == 0) | (unseen.touching > 0) | (unseen.clearance_mm > 6.0)
    right = np.array([(each.odds > 0) == (touch > 0) for each, touch in zip(said, unseen.touching, strict=True)])
    assert right[clear].mean() > 0.97
    assert np.mean([(each.finger_odds > 0) == (f > 0) for each, f in zip(said, unseen.finger, strict=True)]) > 0.95
    touching = unseen.touching > 0
    off_mm = [each.along_mm - place for each, place in zip(said, unseen.place_mm[:, 0], strict=True)]
    assert np.abs(np.array(off_mm)[touching]).mean() < 0.6


def test_the_same_samples_teach_the_same_judge() -> None:
    first, second = (train(made_up(600), rounds=1) for _ in range(2))
    assert all((a[0] == b[0]).all() and (a[1] == b[1]).all() for a, b in zip(first, second, strict=True))


@pytest.fixture(scope="module")
def scene() -> LabScene:
    return lab_scene("targets", 750.0, 1)


def test_what_the_method_saw_comes_with_what_was_true(scene: LabScene) -> None:
    pipeline = pipeline_of(Contender("fingertip", "fingertip"), scene, learn(scene))
    first = scene.calibration_frames
    seen = samples(pipeline, (scene.frame(index) for index in range(first, first + 60)), scene_truth(scene))
    assert seen is not None
    touching = seen.touching > 0
    assert touching.any()
    assert (seen.clearance_mm[touching] == 0.0).all()
    assert np.median(np.hypot(*seen.place_mm[touching].T)) < 3.0
    assert np.isnan(seen.clearance_mm[seen.finger == 0]).all()
    both = joined([seen, seen])
    assert len(both.weight) == 2 * len(seen.weight)


def test_where_nothing_comes_near_there_is_nothing_to_learn(scene: LabScene) -> None:
    pipeline = pipeline_of(Contender("fingertip", "fingertip"), scene, learn(scene))
    first = scene.calibration_frames
    assert samples(pipeline, (scene.frame(index) for index in range(first, first + 3)), scene_truth(scene)) is None


def test_plain_hands_under_any_camera_come_with_their_truth_and_the_same_ones_again() -> None:
    worlds = [world(5, visits=2) for _ in range(2)]
    first, again = (samples(there.pipeline, there.frames, there.truth) for there in worlds)
    assert first is not None
    assert again is not None
    assert (first.traits == again.traits).all()
    touching = first.touching > 0
    assert touching.any()
    assert np.median(np.hypot(*first.place_mm[touching].T)) < 3.0


@pytest.mark.parametrize("added", [-2, 0, 3])
def test_while_teaching_the_judge_from_before_goes_by_the_traits_that_it_knows(added: int) -> None:
    seen = made_up(5).traits
    layers = train(made_up(200), rounds=1)
    other = np.ones((5, max(added, 0)), np.float32)
    shown = np.concatenate([seen, other], axis=1)[:, : seen.shape[1] + added]
    known = np.zeros_like(seen)
    known[:, : shown.shape[1]] = shown[:, : seen.shape[1]]
    assert _LastJudge(layers).opinions(shown) == Judge(layers).opinions(known)
