"""Which of several Kinects a source takes."""

import logging

import pytest

from virtual_kinect.bus import Kinect, KinectPlan, Model, Part
from virtual_kinect.driven import PICTURES, Driven
from virtual_kinect.stream import Film

A = KinectPlan(serial="A0036")
B = KinectPlan(serial="A0077", ports=(2,))


@pytest.fixture(autouse=True)
def _log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)


def test_before_a_camera_was_opened_none_is_identified() -> None:
    there = Driven(A)
    source = there.source()
    assert (source.identified, source.name) == (False, "Kinect")
    next(source.frames())
    assert (source.identified, source.name, source.sensor.serial) == (True, "Kinect A0036", "A0036")


@pytest.mark.parametrize("wanted", ["A0077", "usb:1-2.4"])
def test_the_kinect_that_the_config_names_is_opened_and_the_other_left_alone(wanted: str) -> None:
    there = Driven(A, B)
    source = there.source(wanted)
    next(source.frames())
    assert source.sensor.serial == "A0077"
    assert there.camera.claims == 0


def test_the_kinect_that_the_surface_was_learned_with_is_opened_first() -> None:
    source = Driven(A, B).source(preferred="A0077")
    next(source.frames())
    assert source.sensor.serial == "A0077"


def test_another_kinect_takes_over_only_after_10_s(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A, B)
    source = there.source()
    frames = source.frames()
    next(frames)
    there.unplug()
    next(frames)
    assert source.sensor.serial == "A0077"
    assert 10.0 < there.clock.s < 12.0
    assert caplog.messages[2:] == [
        "Kinect A0036: it went away while streaming: check its cable and power",
        "Kinect A0036, which the surface was learned with, is not plugged in: plug it in, else Kinect A0077 takes its"
        " place after 10 s",
        "Kinect A0077: found at usb:1-2.4, opening it",
        "Kinect A0077: streaming",
    ]


def test_a_kinect_whose_cable_was_loose_for_a_moment_is_not_replaced_by_another() -> None:
    there = Driven(A, B)
    source = there.source()
    frames = source.frames()
    sensor = (next(frames), source.sensor)[1]
    there.clock.at(there.clock.s + 1.0, there.unplug)
    there.clock.at(there.clock.s + 9.0, there.plug)
    there.reach(frames, there.clock.s + 9.0)
    assert source.sensor is sensor


def test_another_camera_is_another_sensor() -> None:
    there = Driven(A)
    source = there.source()
    frames = source.frames()
    sensor = (next(frames), source.sensor)[1]
    there.unplug()
    there.bus.plug(Kinect(B, Film(PICTURES), there.clock))
    next(frames)
    assert source.sensor is not sensor
    assert source.sensor.serial == "A0077"


def test_the_audio_device_of_a_kinect_just_plugged_in_is_waited_for() -> None:
    there = Driven(KinectPlan(Model.XBOX_1473, "B0042"))
    kinect = there.kinects[0]
    audio = kinect.device(Part.AUDIO)
    kinect.devices.remove(audio)
    there.clock.at(0.9, lambda: kinect.devices.append(audio))
    source = there.source()
    next(source.frames())
    assert source.sensor.serial == "B0042"
