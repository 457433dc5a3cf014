"""Running scenes: each is rendered once, and every contender sees the same frames."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice
from multiprocessing import get_context
from pathlib import Path

import cv2

from touchd.assemble import pipeline_settings
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.frames import played
from touchd.lab.baselines import BASELINES
from touchd.lab.scenes import LabScene, TruthFrame, lab_scene, visible_shares
from touchd.lab.scoring import Score, SeenFrame, Truth, score, seen_frame, truth_of
from touchd.model import Frame, Surface
from touchd.pipeline import Pipeline
from touchd.ready import MissingArea
from touchd.surface.calibrate import Calibration
from touchd.surface.settings import CalibrationSettings


@dataclass(frozen=True, slots=True)
class Trial:
    """A scene to run."""

    scene: str
    height_mm: float
    seed: int


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a contender fared in a trial. ``sensor``: the kind of camera; ``crowded``: see :class:`Truth`."""

    contender: str
    trial: Trial
    sensor: str
    crowded: bool
    score: Score


@dataclass(frozen=True, slots=True)
class Learned:
    """What calibration gives to the contenders: the surface, and the first frame for the one that learns from it."""

    surface: Surface
    first: Frame


def run_trials(
    trials: Sequence[Trial], contenders: Sequence[Contender], jobs: int, frames: Path | None
) -> Iterator[list[Outcome]]:
    """Yield the outcomes of one trial after the other; ``jobs`` processes run them if that is more than one.

    ``frames``: the folder that keeps the scenes' frames (:func:`played`).
    """
    if jobs == 1:
        for trial in trials:
            yield run_trial(trial, contenders, frames)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as workers:
        yield from workers.map(run_trial, trials, [contenders] * len(trials), [frames] * len(trials))


def run_trial(trial: Trial, contenders: Sequence[Contender], frames: Path | None) -> list[Outcome]:
    """Return the outcome of a trial for each contender."""
    scene = lab_scene(trial.scene, trial.height_mm, trial.seed)
    return run_scene(scene, played(scene, frames), contenders)


def run_scene(scene: LabScene, frames: Iterator[Frame], contenders: Sequence[Contender]) -> list[Outcome]:
    """Show a scene's frames, calibration's first, to each contender and return its outcome."""
    cv2.setNumThreads(1)
    learned = learn_from(scene, frames)
    pipelines = [pipeline_of(contender, scene, learned) for contender in contenders]
    seen: list[list[SeenFrame]] = [[] for _ in contenders]
    for frame in frames:
        for pipeline, events in zip(pipelines, seen, strict=True):
            events.append(seen_frame(pipeline.step(frame).as_event()))
    truth, trial = scene_truth(scene), Trial(scene.name, scene.height_mm, scene.seed)
    return [
        Outcome(contender.name, trial, scene.sensor.kind, truth.crowded, score(events, truth))
        for contender, events in zip(contenders, seen, strict=True)
    ]


def learn(scene: LabScene) -> Learned:
    """Render a scene's empty frames and calibrate on them."""
    return learn_from(scene, (scene.frame(index) for index in range(scene.calibration_frames)))


def learn_from(scene: LabScene, frames: Iterator[Frame]) -> Learned:
    """Calibrate on a scene's empty frames, taken from the first of ``frames``."""
    calibration = Calibration(scene.sensor, CalibrationSettings(frames=scene.calibration_frames), scene.name)
    first = next(frames)
    calibration.add(first.raw)
    for frame in islice(frames, scene.calibration_frames - 1):
        calibration.add(frame.raw)
    return Learned(calibration.surface_so_far(), first)


def pipeline_of(contender: Contender, scene: LabScene, learned: Learned) -> Pipeline:
    """Return a contender's pipeline, with the surface as it sees it: camera and area are set, nothing else."""
    settings = pipeline_settings(contender.config(), scene.calibration_frames, MissingArea.WHOLE_PICTURE)
    settings = replace(settings, area=scene.corners, method=contender.method)
    pipeline = Pipeline(scene.sensor, settings, scene.name)
    surface = learned.surface
    pipeline.use(BASELINES[contender.baseline](surface, learned.first) if contender.baseline else surface)
    return pipeline


def scene_truth(scene: LabScene) -> Truth:
    """Return a scene's truth for the scoring."""
    frames = [scene.truth(index) for index in range(scene.calibration_frames + scene.frames)]
    happenings = [happening for happening in (frame.happening() for frame in frames) if happening is not None]
    truth = truth_of([frame.as_json() for frame in frames], scene.area.size_mm, happenings)
    return replace(truth, visible=_visible(scene, frames))


def _visible(scene: LabScene, frames: Sequence[TruthFrame]) -> dict[int, float]:
    """Return for each touch how much of its fingertip is in sight in the middle one of its frames."""
    touching: dict[int, list[tuple[int, int]]] = {}
    for frame in frames:
        for tip in frame.tips:
            if tip.touching:
                touching.setdefault(tip.tip, []).append((frame.index, tip.finger))
    middles = {number: seen[len(seen) // 2] for number, seen in touching.items()}
    return {number: visible_shares(scene, index)[finger] for number, (index, finger) in middles.items()}
