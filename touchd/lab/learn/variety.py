"""Plain hands under cameras of all kinds, so that a judge does not learn one sensor's and one sort of hands' ways.

The lab's scenes have hands that are true to life under a Kinect as it was measured. Here hands are plainer and of all
sizes, and the camera's window, noise and pattern are drawn at random: what the judge is to learn holds for all.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from touchd.assemble import pipeline_settings
from touchd.config.schema import Config
from touchd.lab.scoring import Truth
from touchd.lab.scoring.truth import Tip
from touchd.model import AreaCorners, Frame
from touchd.pipeline import Pipeline
from touchd.ready import MissingArea
from touchd.table.correlator import Window
from touchd.table.hands import HandPose, open_hand, pinching_hand, pointing_hand
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.sensor_kinect import KinectModel
from touchd.table.sensor_stereo import StereoModel
from touchd.table.table import SensorModel, Table

_EMPTY_FRAMES = 60
_FRAME_NS = 33_333_333
_SHAPES = (pointing_hand, pointing_hand, pointing_hand, pinching_hand, open_hand)
# A visit: how high the fingertips are in each frame, in shares of how high they come in, and 0 where they touch.
_VISIT = (1.0, 0.7, 0.35, 0.12, 0.0, 0.0, 0.0, 0.0, 0.12, 0.4, 0.8)
_HELD = 4  # of five visits one hovers, and never touches
_LOWEST_HOVER = 0.3
_STEREO_SHARE = 0.2  # of the cameras; the others are like a Kinect


@dataclass(frozen=True, slots=True)
class World:
    """A camera over a table, and who visits it: frames, and what is true of each."""

    pipeline: Pipeline
    frames: Iterator[Frame]
    truth: Truth


Shown: TypeAlias = tuple[Sequence[Hand], tuple[Tip, ...]]
"""What is there in a frame: hands, and what is true of the fingertips that mean to touch."""


def world(seed: int, visits: int = 24) -> World:
    """Return a world with so many visits of a hand; all of it follows from the seed."""
    rng = np.random.default_rng([seed, 1])
    camera, sensor, area = some_camera(rng)
    visited = _visits(rng, area, camera.height_mm, visits)
    return shown_world(seed, camera, sensor, area, [([hand], true_tips(hand, i, area)) for hand, i in visited])


def some_camera(rng: np.random.Generator) -> tuple[TableCamera, SensorModel, Area]:
    """Return a camera drawn at random, how its sensor errs, and an area that it sees."""
    height_mm = float(rng.choice([600.0, 750.0, 750.0, 900.0, 1050.0, 1300.0, 1500.0, 1500.0, 1800.0]))
    camera = TableCamera(height_mm, float(rng.uniform(-25.0, 25.0)), float(rng.uniform(-20.0, 20.0)))
    sensor = _some_stereo(rng) if rng.random() < _STEREO_SHARE else _some_kinect(rng)
    width_mm = 0.72 * height_mm
    return camera, sensor, Area((0.0, 0.0), (width_mm, 0.7 * width_mm))


def shown_world(seed: int, camera: TableCamera, sensor: SensorModel, area: Area, shown: Sequence[Shown]) -> World:
    """Return the world in which a camera has learned its surface, and then sees what is shown, a frame each."""
    table = Table(camera, seed, sensor)
    (a, b), (c, d), (e, f), (g, h) = area_corners_px(camera, area).tolist()
    corners = AreaCorners(((a, b), (c, d), (e, f), (g, h)), area.size_mm)
    settings = replace(pipeline_settings(Config(), _EMPTY_FRAMES, MissingArea.WHOLE_PICTURE), area=corners)
    pipeline = Pipeline(table.sensor, settings, f"world {seed}")
    pipeline.calibrate()
    for index in range(_EMPTY_FRAMES):
        pipeline.step(table.render([], index * _FRAME_NS, index))
    frames = (
        table.render(hands, index * _FRAME_NS, index) for index, (hands, _) in enumerate(shown, start=_EMPTY_FRAMES)
    )
    return World(pipeline, frames, Truth(area.size_mm, ((),) * _EMPTY_FRAMES + tuple(tips for _, tips in shown)))


def _some_kinect(rng: np.random.Generator) -> KinectModel:
    usual = KinectModel()
    window = Window(
        size_px=int(rng.choice([7, 9, 9, 9, 11])),
        bump_raw=float(rng.uniform(3.5, 7.0)),
        near_weight=float(rng.uniform(1.5, 2.7)),
    )
    scale = float(rng.uniform(0.6, 1.5))
    return replace(
        usual,
        window=window,
        noise_raw=usual.noise_raw * scale,
        pattern_raw=usual.pattern_raw * float(rng.uniform(0.5, 1.4)),
        dot_contrast=float(rng.uniform(0.0, 1.5)),
    )


def _some_stereo(rng: np.random.Generator) -> StereoModel:
    usual = StereoModel()
    scale = float(rng.uniform(0.6, 1.3))
    return replace(
        usual,
        window=Window(
            size_px=int(rng.choice([5, 7, 7, 9])),
            bump_raw=float(rng.uniform(3.5, 7.0)),
            near_weight=float(rng.uniform(1.2, 1.8)),
        ),
        noise_mm=usual.noise_mm * scale,
        ripple_mm=usual.ripple_mm * float(rng.uniform(0.5, 1.3)),
    )


def _visits(rng: np.random.Generator, area: Area, height_mm: float, count: int) -> Iterator[tuple[Hand, int]]:
    """Yield the hand of each frame with the number of its visit, from 1 on."""
    for number in range(1, count + 1):
        shape = _SHAPES[int(rng.integers(len(_SHAPES)))]
        high_mm = float(rng.uniform(15.0, 40.0)) * max(1.0, height_mm / 750.0)
        pose = HandPose(
            area.at(*rng.uniform(0.15, 0.85, 2).tolist()),
            heading_deg=float(rng.uniform(0.0, 360.0)),
            pitch_deg=float(rng.uniform(18.0, 62.0)),
            scale=float(rng.uniform(0.75, 1.3)),
            left=bool(rng.random() < 0.5),
            spread_mm=float(rng.uniform(22.0, 90.0)),
        )
        drift = rng.normal(0.0, 5.0, 2)
        for step, share in enumerate(_VISIT):
            least = _LOWEST_HOVER if number % (_HELD + 1) == 0 else 0.0
            at = (pose.at_mm[0] + step * float(drift[0]), pose.at_mm[1] + step * float(drift[1]))
            yield shape(replace(pose, at_mm=at, clearance_mm=high_mm * max(share, least))), number


def true_tips(hand: Hand, number: int, area: Area) -> tuple[Tip, ...]:
    """Return what is true of the fingertips of a hand, whose touches are told from others by a number."""
    left, top = area.centre_mm[0] - 0.5 * area.size_mm[0], area.centre_mm[1] - 0.5 * area.size_mm[1]
    return tuple(
        Tip(
            touch=10 * number + finger,
            finger=finger,
            hand=number,
            x_mm=tip.at_mm[0] - left,
            y_mm=tip.at_mm[1] - top,
            clearance_mm=tip.clearance_mm,
            touching=tip.clearance_mm == 0.0,
            inside=True,
            person=0,
        )
        for finger, tip in enumerate(hand.fingertips)
    )
