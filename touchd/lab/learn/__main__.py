"""``python -m touchd.lab.learn judge beliefs more``: renders scenes, watches the fingertip method, and learns anew.

Five hours on two cores; what was seen in each scene is kept in a folder, so that a broken run goes on.
"""

import argparse
import os
import pickle
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np

import touchd.contacts
from touchd.contacts.recurrent import Weights, learned_weights
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.trials import learn, pipeline_of, scene_truth
from touchd.lab.learn.courses import Course, course
from touchd.lab.learn.later import later_lessons
from touchd.lab.learn.lessons import Lesson, belief_lessons, judge_lessons
from touchd.lab.learn.network import train
from touchd.lab.learn.samples import joined, samples
from touchd.lab.learn.unrolled import train_beliefs, train_on
from touchd.lab.learn.variety import World, world
from touchd.lab.learn.visitors import Fingers, visitors
from touchd.lab.scenes import lab_scene
from touchd.lab.scoring import Truth
from touchd.model import Floats, Frame
from touchd.pipeline import Pipeline

_ROUNDS, _BELIEF_ROUNDS, _LATER_ROUNDS = 20, 8, 12

T = TypeVar("T")
Watch = Callable[[Pipeline, Iterable[Frame], Truth], T | None]


def main(arguments: Sequence[str]) -> None:
    """Teach what is named, in the order that it must be in, and put it where touchd looks for it."""
    parser = argparse.ArgumentParser(prog="python -m touchd.lab.learn")
    parser.add_argument("what", nargs="+", choices=("judge", "beliefs", "more"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, required=True, metavar="FOLDER")
    options = parser.parse_args(arguments)
    if "judge" in options.what:
        seen = _seen(samples, judge_lessons(), options.keep / "judge", options.jobs)
        layers = train(joined(seen), _ROUNDS)
        arrays = {f"weights{i}": weights for i, (weights, _) in enumerate(layers)}
        _store("judge.npz", arrays | {f"bias{i}": bias for i, (_, bias) in enumerate(layers)})
    if "beliefs" in options.what:
        _store_beliefs(train_beliefs(_courses(belief_lessons(), options), _BELIEF_ROUNDS))
    if "more" in options.what:
        _store_beliefs(train_on(learned_weights(), _courses(later_lessons(), options), _LATER_ROUNDS))


def _courses(lessons: Iterable[Lesson], options: argparse.Namespace) -> list[Course]:
    return _seen(course, lessons, options.keep / "beliefs", options.jobs)


def _store_beliefs(learned: Weights) -> None:
    _store("belief.npz", {field.name: getattr(learned, field.name) for field in fields(Weights)})


def _store(name: str, arrays: dict[str, Floats]) -> None:
    halves = {key: array.astype(np.float16) for key, array in arrays.items()}
    np.savez(Path(touchd.contacts.__file__).with_name(name), **halves)  # type: ignore[arg-type]  # of numpy


def _seen(watch: Watch[T], lessons: Iterable[Lesson], keep: Path, jobs: int) -> list[T]:
    """Return what was seen in all lessons in which there was something to see."""
    keep.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as workers:
        return [seen for seen in workers.map(partial(_seen_once, watch, keep), lessons) if seen is not None]


def _seen_once(watch: Watch[T], keep: Path, lesson: Lesson) -> T | None:
    """Return what was seen in a lesson, from the folder if it is there."""
    kept = keep / f"{lesson.scene}-{lesson.height_mm:.0f}-{lesson.seed}.pickle"
    if kept.exists():
        own: T | None = pickle.loads(kept.read_bytes())  # noqa: S301 - written below
        return own
    cv2.setNumThreads(1)
    seen = _seen_in_lesson(watch, lesson)
    unfinished = kept.with_suffix(f".{os.getpid()}")
    unfinished.write_bytes(pickle.dumps(seen))
    unfinished.replace(kept)
    return seen


def _seen_in_lesson(watch: Watch[T], lesson: Lesson) -> T | None:
    if lesson.scene is None:
        return _seen_in_world(watch, world(lesson.seed))
    if lesson.scene in tuple(Fingers):
        return _seen_in_world(watch, visitors(lesson.seed, Fingers(lesson.scene)))
    return _seen_in_scene(watch, lesson.scene, lesson)


def _seen_in_world(watch: Watch[T], there: World) -> T | None:
    return watch(there.pipeline, there.frames, there.truth)


def _seen_in_scene(watch: Watch[T], name: str, lesson: Lesson) -> T | None:
    scene = lab_scene(name, lesson.height_mm, lesson.seed)
    pipeline = pipeline_of(Contender("fingertip", "fingertip"), scene, learn(scene))
    first = scene.calibration_frames
    count = scene.frames if lesson.most is None else min(scene.frames, lesson.most)
    frames = (scene.frame(index) for index in range(first, first + count, lesson.every))
    return watch(pipeline, frames, scene_truth(scene))


if __name__ == "__main__":
    main(sys.argv[1:])
