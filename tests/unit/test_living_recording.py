"""A real Kinect's recording of a desk and people, played over and over: nothing breaks, and the status tells."""

from dataclasses import replace
from pathlib import Path

import pytest
from touchd.formats.recording import open_recording
from touchd.model import State, TouchFrame
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings

ROUNDS = 6
LEARNING = 26


@pytest.fixture(scope="module", params=["fingertip", "shell"])
def played(desk_recording: Path, request: pytest.FixtureRequest) -> tuple[Pipeline, list[TouchFrame]]:
    recording = open_recording(desk_recording)
    frames = [recording.read(index) for index in range(len(recording))]
    pipeline = Pipeline(
        recording.sensor,
        PipelineSettings(calibration=CalibrationSettings(frames=LEARNING), method=request.param),
        "a test",
    )
    pipeline.calibrate()
    results = []
    for index in range(ROUNDS * len(frames)):
        frame = frames[index % len(frames)]
        results.append(pipeline.step(replace(frame, index=index, t_ns=index * 33_333_333)))
    return pipeline, results


def test_nothing_breaks_and_people_before_the_camera_are_not_taken_for_a_move(
    played: tuple[Pipeline, list[TouchFrame]],
) -> None:
    pipeline, results = played
    assert {(result.state, result.why) for result in results[LEARNING:]} == {(State.TRACKING, None)}
    assert pipeline.vitals is not None
    assert pipeline.vitals.moves == 0


def test_after_it_all_the_surface_reads_as_it_did(played: tuple[Pipeline, list[TouchFrame]]) -> None:
    vitals = played[0].vitals
    assert vitals is not None
    # A raw step is 2.4 mm here, and more on what lies farther off.
    assert vitals.drift_mm < 2.4
