import struct

import pytest
from touchd.errors import SourceError
from touchd.sources.kinect import commands
from touchd.sources.kinect.commands import Command, Model, Part, Register, Step

REMEDY = "if this repeats, unplug the Kinect and plug it in again"


def reply(payload: bytes, opcode: int, tag: int, magic: bytes = b"RB", words: int | None = None) -> bytes:
    return struct.pack("<2sHHH", magic, len(payload) // 2 if words is None else words, opcode, tag) + payload


def written(steps: tuple[Step, ...]) -> list[tuple[int, int]]:
    assert all(step.command.opcode == 3 for step in steps)
    return [(step.command.words[0], step.command.words[1]) for step in steps]


def test_a_command_is_its_header_and_little_endian_words() -> None:
    sent = commands.write_register(Register.PROJECTOR_CYCLE, 0x1234).as_bytes(tag=0x0A0B)
    assert sent == b"GM\x02\x00\x03\x00\x0b\x0a\x05\x01\x34\x12"
    assert commands.FIXED_PARAMETERS.as_bytes(1) == b"GM\x05\x00\x04\x00\x01\x00" + bytes(10)
    assert commands.CONST_SHIFT.as_bytes(1) == b"GM\x05\x00\x16\x00\x01\x00" + struct.pack("<5H", 0, 0, 1, 30, 0)
    assert commands.read_register(Register.IR_BRIGHTNESS).as_bytes(1) == b"GM\x01\x00\x02\x00\x01\x00\x15\x00"


def test_tags_count_on_beyond_16_bits() -> None:
    command = commands.read_register(Register.IR_BRIGHTNESS)
    assert command.as_bytes(0x10001)[6:8] == b"\x01\x00"
    assert commands.reply_payload(command, 0x10001, reply(bytes(4), 2, 1)) == bytes(4)


def test_a_register_s_value_is_the_reply_s_second_word() -> None:
    command = commands.read_register(Register.IR_BRIGHTNESS)
    payload = commands.reply_payload(command, 9, reply(b"\x15\x00\x32\x01", 2, 9))
    assert payload is not None
    assert commands.register_value(payload) == 0x132


@pytest.mark.parametrize("length", [0, 512])
def test_no_reply_yet_is_no_error(length: int) -> None:
    assert commands.reply_payload(commands.FIXED_PARAMETERS, 1, bytes(length)) is None


@pytest.mark.parametrize("length", [322, 334, 2])
def test_parameters_may_have_any_length(length: int) -> None:
    got = commands.reply_payload(commands.FIXED_PARAMETERS, 1, reply(bytes(length), 4, 1))
    assert got == bytes(length)


WRITE = commands.write_register(Register.DEPTH_STREAM, 2)


@pytest.mark.parametrize(
    ("command", "answer", "what"),
    [
        (WRITE, b"RB\x01", "command 0x03 (write register) has 3 bytes where at least 8 are needed"),
        (WRITE, reply(bytes(2), 3, 7, b"GM"), "command 0x03 (write register) begins with b'GM' instead of b'RB'"),
        (WRITE, reply(bytes(2), 4, 7), "command 0x03 (write register) is to command 0x04"),
        (WRITE, reply(bytes(2), 3, 6), "command 0x03 (write register) has tag 6 instead of 7"),
        (WRITE, reply(bytes(2), 3, 7, words=2), "command 0x03 (write register) announces 2 words and has 1"),
        (WRITE, reply(b"", 3, 7), "command 0x03 (write register) brings 0 bytes where 2 are needed"),
        (
            commands.read_register(Register.IR_BRIGHTNESS),
            reply(bytes(2), 2, 7),
            "command 0x02 (read register) brings 2 bytes where 4 are needed",
        ),
    ],
)
def test_a_reply_that_cannot_be_right_is_an_error_that_says_what_it_has(
    command: Command, answer: bytes, what: str
) -> None:
    with pytest.raises(SourceError) as caught:
        commands.reply_payload(command, 7, answer)
    assert str(caught.value) == f"the Kinect's reply to {what}: {REMEDY}"


def test_depth_is_started_and_stopped_as_the_device_wants_it() -> None:
    assert written(commands.START_DEPTH) == [
        (0x105, 0),
        (0x06, 0),
        (0x12, 3),
        (0x13, 1),
        (0x14, 30),
        (0x06, 2),
        (0x17, 0),
    ]
    assert written(commands.STOP_DEPTH) == [(0x06, 0)]


def test_near_mode_waits_between_its_two_registers() -> None:
    assert written(commands.NEAR_MODE_ON) == [(0x15, 7), (0x2EF, 0)]
    assert written(commands.NEAR_MODE_OFF) == [(0x15, 0x1E), (0x2EF, 0x190)]
    for steps in (commands.NEAR_MODE_ON, commands.NEAR_MODE_OFF):
        assert [step.wait_s for step in steps] == [0.1, 0.0]


def test_infrared_brightness_is_1_to_50() -> None:
    assert written(commands.ir_brightness(1)) == [(0x15, 1)]
    assert written(commands.ir_brightness(50)) == [(0x15, 50)]
    for level in (0, 51):
        with pytest.raises(SourceError) as caught:
            commands.ir_brightness(level)
        assert str(caught.value) == f"the Kinect's infrared brightness cannot be {level}: choose 1 to 50"


def test_models_are_told_apart_by_product_and_release() -> None:
    assert commands.camera_model(0x02AE, 0x010B) is Model.XBOX_1414
    assert commands.camera_model(0x02AE, 0x0114) is Model.XBOX_1473
    assert commands.camera_model(0x02BF, 0x010B) is Model.WINDOWS


def test_every_product_is_a_part_of_a_kinect() -> None:
    parts = {part: {p for p, of in commands.PART_OF_PRODUCT.items() if of is part} for part in Part}
    assert parts == {
        Part.CAMERA: {0x02AE, 0x02BF},
        Part.MOTOR: {0x02B0},
        Part.AUDIO: {0x02AD, 0x02BE, 0x02C3, 0x02BB},
        Part.HUB: {0x02C2},
    }


def test_the_led_is_switched_by_a_request_without_data() -> None:
    request = commands.led_request(commands.Led.GREEN_BLINKING)
    assert (request.request_type, request.request, request.value, request.length) == (0x40, 0x06, 4, 0)


def test_the_accelerometer_s_counts_become_g() -> None:
    answer = struct.pack(">BBhhhbB", 0, 0, 0, 819, -1638, 0, 0)
    assert len(answer) == commands.ACCELEROMETER.length
    assert commands.acceleration_g(answer) == (0.0, 1.0, -2.0)


def test_a_short_answer_of_the_accelerometer_is_an_error() -> None:
    with pytest.raises(SourceError) as caught:
        commands.acceleration_g(bytes(7))
    assert str(caught.value) == f"the Kinect's accelerometer sent 7 bytes where 10 are needed: {REMEDY}"
