"""``python -m touchd.lab.learn``: renders scenes, watches the fingertip method in them, and writes the judge anew.

Hours on one core; ``--keep FOLDER`` keeps what was seen in each scene, so that a run that was broken off goes on.
"""

import argparse
import pickle
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

import touchd.contacts
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.ranges import heights_of, seeds_of
from touchd.lab.accuracy.trials import Trial, learn, pipeline_of, scene_truth
from touchd.lab.learn.network import train
from touchd.lab.learn.samples import Samples, joined, samples
from touchd.lab.learn.variety import world
from touchd.lab.scenes import LAB_SCENES, lab_scene

# Scenes in which places tell of a wrong lens, in which nothing is judged, and in which a minute looks like a second.
_LEFT_OUT = ("targets-unknown-lens", "stacks", "still", "sway")
_ROUNDS = 20


def main(arguments: Sequence[str]) -> None:
    """Learn a judge and put it where touchd looks for it."""
    parser = argparse.ArgumentParser(prog="python -m touchd.lab.learn")
    parser.add_argument("--seeds", default="401-406")
    parser.add_argument("--heights", default="600,750,1000,1250,1500,1900")
    parser.add_argument("--worlds", default="1-150", help="seeds of plain hands under all kinds of cameras")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, required=True, metavar="FOLDER")
    options = parser.parse_args(arguments)
    options.keep.mkdir(parents=True, exist_ok=True)
    scenes = [scene for scene in LAB_SCENES if scene not in _LEFT_OUT]
    trials = [Trial(*each) for each in product(scenes, heights_of(options.heights), seeds_of(options.seeds))]
    seen = list(_all_seen([*trials, *seeds_of(options.worlds)], options.keep, options.jobs))
    layers = train(joined([part for part in seen if part is not None]), _ROUNDS)
    arrays = {f"weights{i}": weights.astype(np.float16) for i, (weights, _) in enumerate(layers)}
    arrays |= {f"bias{i}": bias.astype(np.float16) for i, (_, bias) in enumerate(layers)}
    np.savez(Path(touchd.contacts.__file__).with_name("judge.npz"), **arrays)  # type: ignore[arg-type]  # of numpy


def _all_seen(what: Sequence[Trial | int], keep: Path, jobs: int) -> Iterator[Samples | None]:
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as workers:
        yield from workers.map(partial(_seen_once, keep), what)


def _seen_once(keep: Path, what: Trial | int) -> Samples | None:
    """Return what was seen in a scene, or in the world with a seed; from the folder if it is there."""
    name = f"world-{what}" if isinstance(what, int) else f"{what.scene}-{what.height_mm:.0f}-{what.seed}"
    kept = keep / f"{name}.pickle"
    if kept.exists():
        own: Samples | None = pickle.loads(kept.read_bytes())  # noqa: S301 - written by the last line
        return own
    cv2.setNumThreads(1)
    seen = _seen_in_world(what) if isinstance(what, int) else _seen_in_scene(what)
    kept.write_bytes(pickle.dumps(seen))
    return seen


def _seen_in_world(seed: int) -> Samples | None:
    there = world(seed)
    return samples(there.pipeline, there.frames, there.truth)


def _seen_in_scene(trial: Trial) -> Samples | None:
    scene = lab_scene(trial.scene, trial.height_mm, trial.seed)
    pipeline = pipeline_of(Contender("fingertip", "fingertip"), scene, learn(scene))
    first = scene.calibration_frames
    frames = (scene.frame(index) for index in range(first, first + scene.frames))
    return samples(pipeline, frames, scene_truth(scene))


if __name__ == "__main__":
    main(sys.argv[1:])
