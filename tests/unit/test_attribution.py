"""Whose fingertip is whose, where two people work with both hands each."""

from collections import Counter
from dataclasses import replace
from math import hypot

import pytest
from touchd.lab.accuracy.trials import learn
from touchd.lab.scenes import LabScene, lab_scene
from touchd.model import TouchFrame
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings

_FRAMES = 110
_NEAR_MM = 25.0


def played(scene: LabScene) -> list[TouchFrame]:
    pipeline = Pipeline(scene.sensor, replace(PipelineSettings(), area=scene.corners), "a test")
    pipeline.use(learn(scene).surface)
    first = scene.calibration_frames
    return [pipeline.step(scene.frame(index)) for index in range(first, first + _FRAMES)]


@pytest.mark.parametrize("height_mm", [750.0, 1500.0])
def test_every_touch_of_two_people_has_its_hand_and_its_person(height_mm: float) -> None:
    scene = lab_scene("two-people", height_mm, seed=7)
    width_mm, depth_mm = scene.area.size_mm
    hands: Counter[tuple[int, int | None]] = Counter()
    people: Counter[tuple[int, int]] = Counter()
    for frame in played(scene):
        whose = {hand.hand_id: hand.person for hand in frame.hands}
        for cursor in frame.cursors:
            for tip in scene.truth(frame.index).tips:
                if hypot((cursor.x - tip.x) * width_mm, (cursor.y - tip.y) * depth_mm) < _NEAR_MM:
                    hands[tip.hand, cursor.hand] += 1
                    people[tip.person, whose[cursor.hand or 0]] += 1
    assert sum(hands.values()) > 60
    assert len(hands) == len({hand for hand, _ in hands}) == len({found for _, found in hands}) == 4
    assert len(people) == len({person for person, _ in people}) == len({found for _, found in people}) == 2
