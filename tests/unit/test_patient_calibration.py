from dataclasses import replace

import numpy as np
import pytest
from touchd.geometry import KINECT_INVALID, kinect_v1_sensor
from touchd.model import Frame, State
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings

SENSOR = replace(kinect_v1_sensor(), size=(64, 48))
FRAME_NS = 33_333_333
FRAMES = 10
GIVE_UP_FRAMES = 60
SETTINGS = PipelineSettings(calibration=CalibrationSettings(frames=FRAMES, give_up_s=GIVE_UP_FRAMES * FRAME_NS / 1e9))


class Scene:
    """Feeds a pipeline with pictures of a table and says what it made of the last one."""

    def __init__(self) -> None:
        self.pipeline = Pipeline(SENSOR, SETTINGS, "a test")
        self.index = 0

    def show(self, hand_at: int | None = None, table: int = 700) -> State:
        raw = np.full((48, 64), table, np.uint16)
        if hand_at is not None:
            raw[10:30, hand_at : hand_at + 10] = 600
        self.last = self.pipeline.step(Frame(self.index, self.index * FRAME_NS, raw))
        self.index += 1
        return self.last.state


@pytest.fixture
def scene() -> Scene:
    scene = Scene()
    scene.pipeline.calibrate_patiently()
    return scene


def test_a_still_scene_is_learned_at_once(scene: Scene) -> None:
    states = [scene.show() for _ in range(FRAMES + 1)]
    assert states == [State.CALIBRATING] * FRAMES + [State.TRACKING]


def test_motion_starts_it_anew_and_is_named(scene: Scene) -> None:
    for _ in range(FRAMES - 2):
        scene.show()
    scene.show(hand_at=20)
    assert scene.last.why == "frame 1 of 10; began anew because something moved over 7% of the area"
    states = [scene.show() for _ in range(FRAMES + 1)]
    assert states == [State.CALIBRATING] * FRAMES + [State.TRACKING]


def test_with_a_surface_from_before_it_gives_up_after_the_set_time_and_goes_on_with_that(scene: Scene) -> None:
    while scene.show() is not State.TRACKING:
        pass
    ready = scene.pipeline.ready
    scene.pipeline.calibrate_patiently()
    states = [scene.show(hand_at=index % 40) for index in range(GIVE_UP_FRAMES + 10)]
    assert states[: GIVE_UP_FRAMES + 1] == [State.CALIBRATING] * (GIVE_UP_FRAMES + 1)
    assert states[-1] is State.TRACKING
    assert scene.pipeline.ready is ready
    assert scene.last.why is not None
    assert scene.last.why.startswith("calibration gave up (frame 1 of 10; began anew because something moved over")
    assert scene.last.why.endswith("): the surface from before is in force")


def test_without_a_surface_it_says_why_and_goes_on_trying(scene: Scene) -> None:
    for index in range(GIVE_UP_FRAMES + 2):
        scene.show(hand_at=index % 40)
    assert scene.last.state is State.NO_SURFACE
    assert scene.last.why is not None
    assert scene.last.why.startswith("still calibrating: frame 1 of 10; began anew because something moved")
    states = [scene.show() for _ in range(FRAMES + 2)]
    assert states[-1] is State.TRACKING


def test_a_covered_camera_gives_no_surface(scene: Scene) -> None:
    for _ in range(FRAMES):
        scene.show(table=KINECT_INVALID)
    assert scene.last.why == (
        "frame 0 of 10; began anew because the camera sees next to nothing of the area; is it covered?"
    )


def test_a_successful_calibration_takes_back_that_the_last_one_gave_up(scene: Scene) -> None:
    while scene.show() is not State.TRACKING:
        pass
    scene.pipeline.calibrate_patiently()
    while scene.show(hand_at=scene.index % 40) is not State.TRACKING:
        pass
    scene.pipeline.calibrate_patiently()
    while scene.show() is not State.TRACKING:
        pass
    assert scene.last.why is None


def test_during_recalibration_there_are_no_touches_and_ids_go_on_after_it(scene: Scene) -> None:
    while scene.show() is not State.TRACKING:
        pass
    scene.pipeline.calibrate_patiently()
    scene.show()
    assert scene.last.cursors == ()
    assert scene.pipeline.next_session_id == 1
