"""A source whose Kinect does not do what it should."""

import errno
import logging

import pytest
from touchd.sources.kinect.stream import TRANSFERS

from virtual_kinect.bus import KinectPlan
from virtual_kinect.driven import Driven, take
from virtual_kinect.faults import Faults, Reply

A = KinectPlan(serial="A0036")


@pytest.fixture(autouse=True)
def _log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)


def test_a_second_without_a_frame_is_a_lost_camera(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    there.clock.at(5.0, lambda: there.set_faults(Faults(silent=True)))
    there.clock.at(6.5, lambda: there.set_faults(Faults()))
    frames = there.source().frames()
    there.reach(frames, 5.1)
    lost = "Kinect A0036: no frame came for 1 s: check its cable and power supply"
    assert caplog.messages[2:] == [lost, "Kinect A0036: streaming"]
    assert 6.0 < there.clock.s < 7.5


def test_the_first_frame_may_take_three_seconds(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    there.set_faults(Faults(silent=True))
    there.clock.at(2.9, lambda: there.set_faults(Faults()))
    next(there.source().frames())
    assert caplog.messages == ["Kinect A0036: found at usb:1-1.4, opening it", "Kinect A0036: streaming"]


def test_a_camera_that_accepts_everything_and_sends_nothing_is_told_and_tried_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    there = Driven(A)
    there.set_faults(Faults(silent=True))
    there.clock.at(60.0, lambda: there.set_faults(Faults()))
    source = there.source()
    next(source.frames())
    assert caplog.messages[1:] == [
        "Kinect A0036: no frame came for 3 s: check its cable and power supply",
        "Kinect A0036: streaming",
    ]
    assert there.camera.claims > 5


def test_when_it_was_we_who_did_not_look_the_camera_is_not_lost(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    frames = there.source().frames()
    take(frames, 30)
    there.clock.pass_s(20.0)
    take(frames, 30)
    assert caplog.messages[1:] == ["Kinect A0036: streaming"]
    assert there.camera.claims == 1


def test_pauses_grow_to_two_seconds_and_are_short_again_after_frames_came() -> None:
    there = Driven(A)
    there.set_faults(Faults(claim_errno=errno.EBUSY))
    there.clock.at(20.0, lambda: there.set_faults(Faults()))
    there.clock.at(25.0, lambda: there.set_faults(Faults(claim_errno=errno.EBUSY, silent=True)))
    there.clock.at(30.0, lambda: there.set_faults(Faults()))
    frames = there.source().frames()
    next(frames)
    waits = [pause for pause in there.pauses if pause > 0.1]
    assert waits[:4] == [0.5, 1.0, 2.0, 2.0]
    there.pauses.clear()
    there.reach(frames, 25.5)
    assert [pause for pause in there.pauses if pause > 0.1][:4] == [0.25, 0.5, 1.0, 2.0]


@pytest.mark.parametrize(
    ("faults", "sentence"),
    [
        (
            Faults(claim_errno=errno.EBUSY),
            "Kinect A0036: another program holds it: stop that program, 'touchd doctor' says which it may be",
        ),
        (
            Faults(iso_memory_bytes=500_000),
            "Kinect A0036: the system takes no more transfers for its stream (Input/Output Error), most likely because"
            " USB memory has run out: echo 64 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb; if that does"
            " not help, plug other cameras into another USB controller",
        ),
        (
            Faults(reply=Reply.EMPTY),
            "Kinect A0036: it does not answer command 0x04 (fixed parameters) (100 tries): unplug the camera and plug"
            " it in again",
        ),
        (
            Faults(control_errno=errno.ETIMEDOUT),
            "Kinect A0036: it gives no proper answer while sending command 0x04 (fixed parameters) (Connection timed"
            " out): check its cable and power",
        ),
    ],
)
def test_what_goes_wrong_is_told_once_and_heals_by_itself(
    faults: Faults, sentence: str, caplog: pytest.LogCaptureFixture
) -> None:
    there = Driven(A)
    there.set_faults(faults)
    there.clock.at(30.0, lambda: there.set_faults(Faults()))
    source = there.source()
    there.clock.at(15.0, lambda: caplog.messages.append(str(source.waiting)))
    next(source.frames())
    assert caplog.messages == [
        "Kinect A0036: found at usb:1-1.4, opening it",
        sentence,
        "Kinect A0036: streaming",
    ]
    assert source.reconnects == 0


@pytest.mark.parametrize("controls", range(1, 20, 3))
def test_pulled_out_while_it_is_being_opened_it_is_opened_when_it_is_back(controls: int) -> None:
    there = Driven(A)
    there.set_faults(Faults(unplug_after_controls=controls))
    there.clock.at(10.0, lambda: there.set_faults(Faults()))
    there.clock.at(10.1, there.plug)
    frames = there.source().frames()
    next(frames)
    assert there.clock.s > 10.0
    frames.close()  # type: ignore[attr-defined]
    assert there.balance() == [0, 0, 0]


def test_nothing_leaks_over_1000_reconnects() -> None:
    there = Driven(A)
    source = there.source()
    frames = source.frames()
    for _ in range(1000):
        next(frames)
        there.unplug()
        there.clock.at(there.clock.s + 0.1, there.plug)
    next(frames)
    assert source.reconnects == 1000
    assert there.balance() == [2, 1, TRANSFERS]  # the camera and the motor, once
    source.close()
    assert list(frames) == []
    assert there.balance() == [0, 0, 0]
