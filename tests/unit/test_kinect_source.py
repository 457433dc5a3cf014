import errno
import itertools
import logging
from dataclasses import replace

import numpy as np
import pytest
from touchd.metrics import MetricsSnapshot
from touchd.model import Frame, State
from touchd.sources.kinect.camera import CameraSettings
from touchd.sources.kinect.source import KinectSource
from touchd.status.data import Status, source_facts
from touchd.status.text import check

from statuses import HEALTHY
from virtual_kinect.bus import KinectPlan, Model, Part
from virtual_kinect.driven import PICTURES, Driven, ModelStream, shown, take
from virtual_kinect.faults import Faults

A = KinectPlan(serial="A0036")
B = KinectPlan(serial="A0077", ports=(2,))


@pytest.fixture(autouse=True)
def _log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)


def is_right(frame: Frame, first: Frame) -> bool:
    """Return whether a frame shows the picture that its number says, counted from the one that the first shows."""
    begin = next(number for number in range(len(PICTURES)) if np.array_equal(first.raw, shown(number)))
    return bool(np.array_equal(frame.raw, shown(begin + frame.index - first.index)) or frame.missing_packets)


def status_of(source: KinectSource) -> Status:
    """Return the status of a daemon that fares well with this source."""
    metrics = MetricsSnapshot(600, 0, 30.0, None, None, None)
    return replace(
        HEALTHY,
        source=source_facts(source.name, "kinect", source.waiting, source.reconnects, metrics, 0, source.packet_loss),
    )


def test_frames_are_right_to_the_pixel_and_none_is_missing() -> None:
    there = Driven(A)
    source = there.source()
    frames = take(source.frames(), 3 * len(PICTURES))
    assert [frame.index for frame in frames] == list(range(len(frames)))
    assert all(is_right(frame, frames[0]) for frame in frames)
    assert {frame.missing_packets for frame in frames} == {0}
    gaps_ms = {round((b.t_ns - a.t_ns) / 1e6) for a, b in itertools.pairwise(frames)}
    assert gaps_ms <= set(range(29, 38))  # a transfer's 4 ms around 33.4


def test_a_frame_says_which_way_is_up() -> None:
    there = Driven(A)
    there.motor.acceleration = (0, 819, 0)
    assert take(there.source().frames(), 9)[-1].accel_g == (0.0, 1.0, 0.0)


def test_every_change_is_one_line_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    source = there.source()
    there.unplug()
    there.clock.at(10.0, there.plug)
    there.clock.at(12.0, there.unplug)
    there.clock.at(20.0, there.plug)
    states = [source.waiting]
    frames = source.frames()
    there.reach(frames, 22.0)
    states.append(source.waiting)
    assert caplog.messages == [
        "no Kinect is plugged in: connect its USB cable and its power supply",
        "Kinect A0036: found at usb:1-1.4, opening it",
        "Kinect A0036: streaming",
        "Kinect A0036: it went away while streaming: check its cable and power",
        "no Kinect is plugged in: connect its USB cable and its power supply",
        "Kinect A0036: found at usb:1-1.4, opening it",
        "Kinect A0036: streaming",
    ]
    assert states == ["looking for a Kinect", None]
    assert source.reconnects == 1


def test_a_kinect_that_is_plugged_in_again_is_back_within_a_second() -> None:
    there = Driven(A)
    there.clock.at(2.0, there.unplug)
    there.clock.at(30.0, there.plug)
    frames = there.source().frames()
    there.reach(frames, 30.0)
    assert there.clock.s < 31.0


def test_the_same_camera_is_the_same_sensor_and_its_frames_go_on_counting() -> None:
    there = Driven(A)
    there.clock.at(2.0, there.unplug)
    there.clock.at(3.0, there.plug)
    source = there.source()
    frames = source.frames()
    before = next(frames).index, source.sensor
    there.reach(frames, 2.9)
    after = next(frames)
    assert source.sensor is before[1]
    assert after.index > before[0] + 50
    assert not take(frames, 20)[-1].missing_packets


def test_frames_that_were_not_fetched_in_time_are_gaps_in_the_count() -> None:
    there = Driven(A)
    frames = there.source().frames()
    first = next(frames)
    there.clock.pass_s(0.5)
    later = take(frames, 10)
    assert later[-1].index > 15
    assert all(is_right(frame, first) for frame in later)


def test_frames_that_are_handed_over_together_keep_their_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    one_by_one = ModelStream.pump
    monkeypatch.setattr(ModelStream, "pump", lambda self, wait_s: [one_by_one(self, wait_s) for _ in range(50)])
    times = [frame.t_ns for frame in take(Driven(A).source().frames(), 60)]
    assert {round((b - a) / 1e6) for a, b in itertools.pairwise(times)} == {33}


def test_a_partial_frame_says_how_many_packets_are_missing() -> None:
    there = Driven(A)
    there.set_faults(Faults(drop_packets=(4 * 242 + 10, 4 * 242 + 100, 5 * 242 + 20)))
    missing = [frame.missing_packets for frame in take(there.source().frames(), 12)]
    assert missing[missing.index(2) :][:3] == [2, 1, 0]
    assert sum(missing) == 3


def test_30_percent_packet_loss_still_brings_frames_and_is_told_every_10_s(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    there.set_faults(Faults(drop=0.3))
    source = there.source()
    frames = source.frames()
    there.reach(frames, 35.0)
    told = [line for line in caplog.messages if "packets were lost" in line]
    assert len(told) == 3
    assert told[1] == (
        "Kinect A0036: 30.0 % of its packets were lost in the last 10 s: plug it into another USB port, without a hub"
        " and away from other cameras; see whether this computer is too busy"
    )
    assert source.packet_loss == pytest.approx(0.3, abs=0.1)
    assert source.waiting is None


def test_the_status_warns_of_30_percent_packet_loss_until_the_camera_is_gone() -> None:
    there = Driven(A)
    there.set_faults(Faults(drop=0.3))
    source = there.source()
    frames = source.frames()
    verdicts = []
    for seconds in (9.0, 21.0):
        there.reach(frames, seconds)
        verdicts.append(check(status_of(source)))
    there.unplug()
    there.clock.at(there.clock.s + 1.0, source.close)
    list(frames)
    verdicts.append(check(status_of(source)))
    assert [verdict for verdict, _ in verdicts] == [0, 1, 0]
    assert verdicts[1][1].startswith("warning: Kinect A0036: 30.0% of its packets were lost in the last 10 s: plug it")


def test_what_a_short_stall_of_our_own_costs_is_not_told(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    source = there.source()
    frames = source.frames()
    take(frames, 30)
    there.clock.pass_s(0.1)
    there.reach(frames, 21.0)
    assert source.packet_loss == 0.0
    assert not [line for line in caplog.messages if "lost" in line]


def test_closed_it_stops_the_stream_and_lets_everything_go() -> None:
    there = Driven(A)
    source = there.source()
    frames = source.frames()
    take(frames, 3)
    source.close()
    assert len(list(frames)) <= 1
    assert there.camera.written[-1] == (0x06, 0)
    assert there.motor.leds[-1] == 0
    assert there.balance() == [0, 0, 0]


def test_the_led_tells_how_the_daemon_fares_and_the_motor_is_never_moved() -> None:
    there = Driven(A)
    source = there.source()
    frames = source.frames()
    for state in (State.CALIBRATING, State.TRACKING, State.PAUSED, State.NO_FRAMES, State.TRACKING):
        source.show(state)
        take(frames, 3)
    there.clock.at(there.clock.s + 0.1, lambda: there.set_faults(Faults(silent=True)))
    there.clock.at(there.clock.s + 5.0, lambda: there.set_faults(Faults()))
    there.reach(frames, there.clock.s + 1.0)
    take(frames, 3)
    blinking, green, yellow, red = 4, 1, 3, 2
    assert there.motor.leds[:7] == [blinking, green, yellow, red, green, red, green]
    assert there.motor.tilts == []


def test_a_motor_that_is_not_answering_costs_no_frame(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(A)
    there.set_faults(Faults(control_errno=errno.EPIPE), Part.MOTOR)
    frames = take(there.source().frames(), 60)
    assert [frame.index for frame in frames] == list(range(60))
    assert frames[-1].accel_g is None
    assert "Kinect A0036: its LED and accelerometer cannot be used: Broken pipe" in caplog.messages


def test_brightness_and_near_mode_are_set() -> None:
    there = Driven(KinectPlan(Model.K4W, "B0042"))
    next(there.source(settings=CameraSettings(ir_brightness=9, near_mode=True)).frames())
    assert there.camera.registers[0x2EF] == 0
    assert there.camera.registers[0x15] == 9
