import errno
import logging

import pytest
from touchd.errors import DeviceLost, SourceError
from touchd.sources.kinect.camera import CameraSettings, KinectCamera
from touchd.sources.kinect.commands import Led, Register, read_register, register_value

from virtual_kinect.bus import KinectPlan, Model, Part
from virtual_kinect.camera import Constants
from virtual_kinect.driven import Driven
from virtual_kinect.faults import Faults, Reply

K4W = KinectPlan(Model.K4W, "B0042")
NO_ANSWER = "does not answer command 0x04 (fixed parameters) (100 tries): unplug the camera and plug it in again"


def opened(there: Driven) -> KinectCamera:
    return KinectCamera(there.look().kinects[0], there.open_stream, there.pause)


def test_the_kernels_driver_is_detached_and_the_camera_claimed_and_let_go() -> None:
    there = Driven()
    camera = opened(there)
    assert there.camera.kernel_driver is None
    assert there.balance()[:2] == [1, 1]
    camera.close()
    assert there.balance() == [0, 0, 0]


def test_a_kinect_for_windows_is_put_into_its_alternate_setting() -> None:
    there = Driven(K4W)
    camera = opened(there)
    assert there.camera.alternate == 1
    camera.close()


def test_the_constants_are_the_cameras_own() -> None:
    there = Driven(KinectPlan(constants=Constants(7.6, 2.3, 121.0, 0.1043, 201)))
    camera = opened(there)
    found = camera.constants()
    camera.close()
    assert found.doubts == ()
    plane = found.zero_plane
    distances = plane.emitter_distance_cm, plane.reference_distance_cm, plane.reference_pixel_size_mm
    assert distances == pytest.approx((7.6, 121.0, 0.1043))
    assert plane.const_shift == 201.0


@pytest.mark.parametrize("length", [0, 512])
def test_a_reply_may_take_its_time(length: int) -> None:
    there = Driven()
    there.set_faults(Faults(polls_before_reply=99, length_before_reply=length))
    camera = opened(there)
    assert register_value(camera.ask(read_register(Register.DEPTH_RATE))) == 0
    camera.close()


@pytest.mark.parametrize(
    ("reply", "kind", "sentence"),
    [
        (Reply.EMPTY, DeviceLost, f"Kinect A0036: it {NO_ANSWER}"),
        (Reply.NOT_READY, DeviceLost, f"Kinect A0036: it {NO_ANSWER}"),
        (
            Reply.WRONG_TAG,
            SourceError,
            "the Kinect's reply to command 0x04 (fixed parameters) has tag 1 instead of 0: if this repeats, unplug the"
            " Kinect and plug it in again",
        ),
        (
            Reply.WRONG_COMMAND,
            SourceError,
            "the Kinect's reply to command 0x04 (fixed parameters) is to command 0x84: if this repeats, unplug the"
            " Kinect and plug it in again",
        ),
        (
            Reply.WRONG_MAGIC,
            SourceError,
            "the Kinect's reply to command 0x04 (fixed parameters) begins with b'XX' instead of b'RB': if this repeats,"
            " unplug the Kinect and plug it in again",
        ),
    ],
)
def test_a_reply_that_never_comes_or_is_wrong_is_told(reply: Reply, kind: type[SourceError], sentence: str) -> None:
    there = Driven(KinectPlan(serial="A0036"))
    there.set_faults(Faults(reply=reply))
    camera = opened(there)
    with pytest.raises(SourceError) as caught:
        camera.constants()
    camera.close()
    assert (type(caught.value), str(caught.value)) == (kind, sentence)
    assert there.balance() == [0, 0, 0]


def test_a_camera_that_another_program_holds_is_left_as_it_was() -> None:
    there = Driven()
    there.set_faults(Faults(claim_errno=errno.EBUSY))
    with pytest.raises(SourceError, match="another program holds it"):
        opened(there)
    assert there.balance() == [0, 0, 0]


def test_starting_turns_depth_on_and_closing_turns_it_off() -> None:
    there = Driven()
    camera = opened(there)
    camera.start(CameraSettings(ir_brightness=20), lambda *_: None)
    assert there.camera.stream is not None
    assert there.camera.written[-1] == (0x15, 20)
    camera.close()
    assert there.camera.written[-1] == (0x06, 0)
    assert there.balance() == [0, 0, 0]


@pytest.mark.parametrize(
    ("near", "written"), [(True, [(0x15, 0x07), (0x2EF, 0)]), (False, [(0x15, 0x1E), (0x2EF, 0x190)])]
)
def test_near_mode_of_a_kinect_for_windows(near: bool, written: list[tuple[int, int]]) -> None:
    there = Driven(K4W)
    camera = opened(there)
    camera.start(CameraSettings(near_mode=near), lambda *_: None)
    assert there.camera.written[-2:] == written
    assert 0.1 in there.pauses
    camera.close()


def test_near_mode_of_another_kinect_is_refused_before_anything_is_started() -> None:
    there = Driven(KinectPlan(serial="A0036"))
    camera = opened(there)
    with pytest.raises(SourceError) as caught:
        camera.start(CameraSettings(near_mode=True), lambda *_: None)
    assert str(caught.value) == (
        "Kinect A0036: source.near_mode is for the Kinect for Windows alone, and this is a Kinect for Xbox 360, model"
        " 1414; remove it from the config"
    )
    assert there.streams == []
    camera.close()


def test_a_motor_that_does_not_work_is_told_once_and_asked_no_more(caplog: pytest.LogCaptureFixture) -> None:
    there = Driven(KinectPlan(serial="A0036"))
    there.set_faults(Faults(control_errno=errno.ETIMEDOUT), Part.MOTOR)
    camera = opened(there)
    with caplog.at_level(logging.INFO):
        camera.show(Led.GREEN)
        assert camera.acceleration_g() is None
    there.set_faults(Faults(), Part.MOTOR)
    camera.show(Led.RED)
    camera.close()
    assert caplog.messages == ["Kinect A0036: its LED and accelerometer cannot be used: Connection timed out"]
    assert there.motor.leds == []


def test_an_accelerometer_that_sends_too_little_costs_no_more_than_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    there = Driven()
    monkeypatch.setattr(there.motor, "vendor", lambda *_: b"\0")
    camera = opened(there)
    assert camera.acceleration_g() is None
    camera.close()


def test_the_accelerometer_says_which_way_is_up() -> None:
    there = Driven()
    there.motor.acceleration = (0, -819, 410)
    camera = opened(there)
    assert camera.acceleration_g() == pytest.approx((0.0, -1.0, 410 / 819))
    camera.close()


def test_a_camera_that_is_gone_can_still_be_closed() -> None:
    there = Driven()
    camera = opened(there)
    camera.start(CameraSettings(), lambda *_: None)
    there.unplug()
    camera.close()
    assert there.balance() == [0, 0, 0]
