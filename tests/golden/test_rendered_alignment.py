"""The whole way of an alignment: rendered fingers on the corners of an area, seen by a noisy sensor."""

import numpy as np
from touchd.align.session import AlignSession
from touchd.model import Intrinsics
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.table import Table

EMPTY_FRAMES, HELD_FRAMES, LIFTED_FRAMES = 20, 28, 9
FRAME_NS = 33_333_333


def test_fingers_held_on_the_corners_of_a_rendered_area_give_its_corners_and_size() -> None:
    camera = TableCamera(800.0, 5.0, 2.0, Intrinsics(575.8, 575.8, 319.5, 239.5, 0.05, -0.1))
    area = Area((0.0, 0.0), (576.0, 416.0))
    table = Table(camera, seed=1)
    pipeline = Pipeline(table.sensor, PipelineSettings(CalibrationSettings(frames=EMPTY_FRAMES)), "the table")
    pipeline.calibrate()
    hands: list[list[Hand]] = [[] for _ in range(EMPTY_FRAMES)]
    for corner in ((0, 0), (1, 0), (1, 1), (0, 1)):
        hands += [[pointing_hand(HandPose(area.at(*corner)))]] * HELD_FRAMES + [[]] * LIFTED_FRAMES
    session = None
    for index, present in enumerate(hands):
        frame = pipeline.step(table.render(present, index * FRAME_NS, index))
        if session is not None:
            session.feed(frame)
        elif pipeline.ready is not None:
            session = AlignSession(4, pipeline.ready.area, pipeline.ready.surface_map)
    assert session is not None
    found = session.alignment
    assert found is not None
    mm_per_px = camera.height_mm / camera.intrinsics.fx
    off_mm = np.linalg.norm(np.array(found.corners_px) - area_corners_px(camera, area), axis=1) * mm_per_px
    assert off_mm.max() < 6.0
    np.testing.assert_allclose(found.size_mm, area.size_mm, atol=6.0)
    assert found.residual_mm < 2.0
