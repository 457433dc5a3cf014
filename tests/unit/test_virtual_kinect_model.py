import errno
import struct

import pytest

from virtual_kinect.bus import Bus, Kinect, KinectPlan, Model, Part
from virtual_kinect.desk import ASK, FETCH, FILM, ask, error_of, plugged, send, start
from virtual_kinect.faults import Faults, Reply
from virtual_kinect.model import DeviceClock, Handle, Setup


def test_a_1414_tells_its_constants_in_322_bytes() -> None:
    reply = ask(plugged().camera, 0x04, 0, 0, 0, 0, 0, tag=9)
    assert len(reply) == 322
    assert struct.unpack_from("<ffff", reply, 94) == pytest.approx((7.5, 2.3, 120.0, 0.1042))


@pytest.mark.parametrize("model", [Model.XBOX_1473, Model.K4W])
def test_later_models_tell_their_constants_in_334_bytes(model: Model) -> None:
    assert len(ask(plugged(KinectPlan(model)).camera, 0x04, 0, 0, 0, 0, 0)) == 334


def test_the_constant_shift_is_an_algorithm_parameter() -> None:
    assert ask(plugged().camera, 0x16, 0, 0, 1, 30, 0) == struct.pack("<HH", 0, 200)


def test_registers_keep_what_was_written() -> None:
    camera = plugged().camera
    ask(camera, 0x03, 0x15, 25)
    assert ask(camera, 0x02, 0x15) == struct.pack("<HH", 0x15, 25)


def test_nothing_is_sent_before_the_stream_is_switched_on_and_after_it_is_switched_off() -> None:
    there = plugged()
    assert there.camera.iso_packets(0x82, 1, 8) == [b""] * 8
    start(there.camera)
    assert there.camera.iso_packets(0x82, 1, 1)[0][3] == 0x71
    assert there.camera.iso_packets(0x81, 1, 8) == [b""] * 8
    start(there.camera, ((0x06, 0),))
    assert there.camera.iso_packets(0x82, 1, 8) == [b""] * 8


def test_the_registers_choose_10_bits_and_the_frame_rate() -> None:
    camera = plugged().camera
    start(camera, ((0x12, 2), (0x13, 1), (0x14, 15), (0x06, 2)))
    assert camera.stream
    assert camera.stream.settings.packets_per_frame == 220
    assert camera.stream.settings.frame_ticks == 2 * 2_002_155


def test_a_kinect_for_windows_sends_nothing_on_its_first_alternate_setting() -> None:
    there = plugged(KinectPlan(Model.K4W))
    start(there.camera)
    handle = Handle(there.camera)
    there.camera.kernel_driver = None
    handle.claim()
    assert there.camera.iso_packets(0x82, 1, 1) == [b""]
    handle.set_alternate(1)
    assert there.camera.iso_packets(0x82, 1, 1) != [b""]


@pytest.mark.parametrize(
    ("reply", "expected"),
    [
        (Reply.EMPTY, b""),
        (Reply.NOT_READY, bytes(512)),
        (Reply.WRONG_TAG, struct.pack("<2sHHH", b"RB", 1, 3, 6) + b"\0\0"),
        (Reply.WRONG_COMMAND, struct.pack("<2sHHH", b"RB", 1, 0x83, 5) + b"\0\0"),
        (Reply.WRONG_MAGIC, struct.pack("<2sHHH", b"XX", 1, 3, 5) + b"\0\0"),
    ],
)
def test_replies_go_wrong_as_they_are_asked_to(reply: Reply, expected: bytes) -> None:
    camera = plugged().camera
    camera.faults = Faults(reply=reply, polls_before_reply=0)
    send(camera, 0x03, 0x06, 0, tag=5)
    assert camera.control(FETCH, b"", 512) == expected
    if reply in {Reply.EMPTY, Reply.NOT_READY}:
        assert {camera.control(FETCH, b"", 512) for _ in range(1000)} == {expected}


def test_a_reply_can_take_its_time_with_512_bytes_of_nothing() -> None:
    camera = plugged().camera
    camera.faults = Faults(polls_before_reply=3, length_before_reply=512)
    send(camera, 0x03, 0x06, 0)
    assert [len(camera.control(FETCH, b"", 512)) for _ in range(5)] == [512, 512, 512, 10, 0]


def test_what_is_no_command_is_never_answered() -> None:
    camera = plugged().camera
    for wrong in (b"GM" + bytes(6), struct.pack("<2sHHH", b"XX", 0, 4, 0), struct.pack("<2sHHH", b"GM", 5, 4, 0)):
        camera.control(ASK, wrong, 0)
        assert {camera.control(FETCH, b"", 512) for _ in range(5)} == {b""}


def test_unknown_requests_stall() -> None:
    there = plugged()
    assert error_of(lambda: there.camera.control(Setup(0x40, 0x99), b"", 0)) == errno.EPIPE
    assert there.kinect.audio
    audio = there.kinect.audio
    assert error_of(lambda: audio.control(Setup(0xC0, 0), b"", 8)) == errno.EPIPE


def test_the_motor_has_an_led_and_an_accelerometer() -> None:
    motor = plugged().kinect.motor
    assert motor
    motor.acceleration = (10, 800, -20)
    motor.control(Setup(0x40, 0x06, 4), b"", 0)
    motor.control(Setup(0x40, 0x31, 2**16 - 20), b"", 0)
    reply = motor.control(Setup(0xC0, 0x32), b"", 10)
    assert (motor.leds, motor.tilts) == ([4], [-20])
    assert struct.unpack_from(">hhh", reply, 2) == (10, 800, -20)
    assert (len(reply), struct.unpack_from("b", reply, 8)) == (10, (-20,))


def test_the_camera_is_busy_while_the_kernel_or_another_program_has_it() -> None:
    camera = plugged().camera
    mine, other = Handle(camera), Handle(camera)
    assert error_of(mine.claim) == errno.EBUSY
    mine.detach_kernel_driver()
    mine.claim()
    assert error_of(other.claim) == errno.EBUSY
    mine.close()
    other.claim()


def test_an_operation_fails_with_the_error_that_was_asked_for() -> None:
    camera = plugged().camera
    handle = Handle(camera)
    camera.faults = Faults(open_errno=errno.EACCES, claim_errno=errno.EBUSY, control_errno=errno.ETIMEDOUT)
    assert error_of(lambda: Handle(camera)) == errno.EACCES
    assert error_of(handle.claim) == errno.EBUSY
    assert error_of(lambda: camera.control(FETCH, b"", 512)) == errno.ETIMEDOUT


def test_without_the_power_supply_only_the_motor_is_there() -> None:
    kinect = Kinect(KinectPlan(parts=(Part.MOTOR,)), FILM, DeviceClock())
    assert [hex(device.shape.product_id) for device in Bus([kinect]).devices] == ["0x2", "0x2c2", "0x2b0"]


def test_two_1473_have_the_same_camera_serial_and_audio_siblings_with_their_own() -> None:
    clock = DeviceClock()
    plans = [KinectPlan(Model.XBOX_1473, serial, (port,)) for port, serial in enumerate(("B0042", "B0077"), 1)]
    bus = Bus(Kinect(plan, FILM, clock) for plan in plans)
    serials = [(device.name, device.shape.serial) for device in bus.devices if device.shape.serial]
    nameless = "0000000000000000"
    assert serials == [("1-1.2", "B0042"), ("1-1.4", nameless), ("1-2.2", "B0077"), ("1-2.4", nameless)]
    assert [device.name for device in bus.devices if bus.parent(device) is bus.kinects[1].devices[0]] == [
        "1-2.2",
        "1-2.4",
    ]


def test_everything_fails_on_an_unplugged_kinect_until_it_is_plugged_in_again_elsewhere() -> None:
    there = plugged()
    start(there.camera)
    handle = Handle(there.camera)
    address = there.camera.address
    there.bus.unplug(there.kinect)
    assert error_of(lambda: Handle(there.camera)) == errno.ENODEV
    assert error_of(handle.claim) == errno.ENODEV
    assert error_of(lambda: there.camera.control(FETCH, b"", 512)) == errno.ENODEV
    assert error_of(lambda: there.camera.iso_packets(0x82, 1, 1)) == errno.ENODEV
    there.bus.plug(there.kinect)
    assert there.camera.address not in {0, address}
    assert (there.camera.stream, there.camera.registers) == (None, {})


def test_a_thousand_pluggings_never_give_an_address_twice_at_a_time() -> None:
    there = plugged()
    other = Kinect(KinectPlan(ports=(2,)), FILM, there.clock)
    for _ in range(1000):
        there.bus.plug(other)
        addresses = [device.address for device in there.bus.devices]
        assert len(set(addresses)) == len(addresses)
        assert max(addresses) <= 127
        there.bus.unplug(other)


def test_a_kinect_can_be_pulled_out_in_the_middle_of_the_commands() -> None:
    there = plugged()
    there.camera.faults = Faults(unplug_after_controls=3)
    ask(there.camera, 0x03, 0x06, 0)
    assert error_of(lambda: send(there.camera, 0x03, 0x06, 0)) == errno.ENODEV
    assert there.bus.devices == [there.bus.root]
