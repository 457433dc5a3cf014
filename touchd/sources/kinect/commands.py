"""What is said to a Kinect besides its stream: which devices it is made of, commands, registers, LED, accelerometer.

Commands go to the camera's endpoint 0 and are answered there. (Source of all numbers: the OpenKinect project.)
"""

from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum
from struct import Struct, pack, unpack_from

from touchd.errors import SourceError

VENDOR_ID = 0x045E
NO_SERIAL = "0000000000000000"  # what models 1473 and Kinect for Windows give as the camera's serial

INTERFACE = 0
KINECT_FOR_WINDOWS_ALTERNATE_SETTING = 1
DEPTH_ENDPOINT = 0x82
DEPTH_PACKET_BYTES = 1920  # the most that a microframe can bring

TO_DEVICE, FROM_DEVICE = 0x40, 0xC0  # bmRequestType
COMMAND_REQUEST = 0
REPLY_BYTES = 512  # to ask for; an answer of just as many means that there is none yet

LEAST_IR_BRIGHTNESS, MOST_IR_BRIGHTNESS = 1, 50
_NEAR_MODE_WAIT_S = 0.1

_HEADER = Struct("<2sHHH")  # magic, length of what follows in words, command, tag
_ASKED, _ANSWERED = b"GM", b"RB"
_REMEDY = "if this repeats, unplug the Kinect and plug it in again"


class Part(Enum):
    """The USB devices that a Kinect is made of."""

    CAMERA = "camera"
    MOTOR = "motor"  # with the LED and the accelerometer; a device of its own on model 1414 alone
    AUDIO = "audio"
    HUB = "hub"


PART_OF_PRODUCT = {
    0x02AE: Part.CAMERA,
    0x02BF: Part.CAMERA,
    0x02B0: Part.MOTOR,
    0x02AD: Part.AUDIO,
    0x02BE: Part.AUDIO,
    0x02C3: Part.AUDIO,
    0x02BB: Part.AUDIO,
    0x02C2: Part.HUB,
}


class Model(StrEnum):
    """The models that were sold."""

    XBOX_1414 = "Kinect for Xbox 360, model 1414"
    XBOX_1473 = "Kinect for Xbox 360, model 1473"
    WINDOWS = "Kinect for Windows"


_WINDOWS_CAMERA = 0x02BF
_RELEASE_OF_1414 = 0x010B


def camera_model(product_id: int, device_release: int) -> Model:
    """Return the model of a camera by its idProduct and bcdDevice."""
    if product_id == _WINDOWS_CAMERA:
        return Model.WINDOWS
    return Model.XBOX_1414 if device_release == _RELEASE_OF_1414 else Model.XBOX_1473


class Opcode(IntEnum):
    """What a command does."""

    READ_REGISTER = 0x02
    WRITE_REGISTER = 0x03
    FIXED_PARAMETERS = 0x04  # made in the factory: distances
    ALGORITHM_PARAMETERS = 0x16  # of which we read the constant shift


class Register(IntEnum):
    """The registers that we write, and what is known of them."""

    DEPTH_STREAM = 0x06  # 0 off, 2 on
    DEPTH_FORMAT = 0x12  # 3: 11 bits a pixel, packed; 2: 10 bits
    DEPTH_RESOLUTION = 0x13  # 1: 640 by 480
    DEPTH_RATE = 0x14  # frames a second
    IR_BRIGHTNESS = 0x15  # 1 to 50
    DEPTH_MIRROR = 0x17  # 1: left and right exchanged
    PROJECTOR_CYCLE = 0x105  # 0: the projector stays on
    NEAR_LIMIT = 0x2EF  # Kinect for Windows: 0 in near mode, 0x190 else


@dataclass(frozen=True, slots=True)
class Command:
    """A command with its payload of uint16 words; its reply brings ``least_reply_bytes`` beside the header, or more."""

    opcode: Opcode
    words: tuple[int, ...]
    least_reply_bytes: int = 0

    def as_bytes(self, tag: int) -> bytes:
        """Return what to send; the reply repeats ``tag``, of which the low 16 bits count."""
        header = _HEADER.pack(_ASKED, len(self.words), self.opcode, tag & 0xFFFF)
        return header + pack(f"<{len(self.words)}H", *self.words)

    def __str__(self) -> str:
        return f"command 0x{self.opcode:02x} ({self.opcode.name.lower().replace('_', ' ')})"


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a sequence: a command, and how long to wait after it."""

    command: Command
    wait_s: float = 0.0


def write_register(register: Register, value: int) -> Command:
    """Return the command that writes a register."""
    return Command(Opcode.WRITE_REGISTER, (register, value), least_reply_bytes=2)


def read_register(register: Register) -> Command:
    """Return the command that reads a register; :func:`register_value` reads its reply."""
    return Command(Opcode.READ_REGISTER, (register,), least_reply_bytes=4)


# How much these bring differs between models: touchd.sources.kinect.constants reads them with care.
FIXED_PARAMETERS = Command(Opcode.FIXED_PARAMETERS, (0, 0, 0, 0, 0))
CONST_SHIFT = Command(Opcode.ALGORITHM_PARAMETERS, (0, 0, 1, 30, 0))  # parameter 0, of 640 by 480 at 30 frames/s


def _writes(*values: tuple[Register, int]) -> tuple[Step, ...]:
    return tuple(Step(write_register(register, value)) for register, value in values)


# The isochronous transfers must have been submitted before.
START_DEPTH = _writes(
    (Register.PROJECTOR_CYCLE, 0),
    (Register.DEPTH_STREAM, 0),
    (Register.DEPTH_FORMAT, 3),
    (Register.DEPTH_RESOLUTION, 1),
    (Register.DEPTH_RATE, 30),
    (Register.DEPTH_STREAM, 2),
    (Register.DEPTH_MIRROR, 0),
)
STOP_DEPTH = _writes((Register.DEPTH_STREAM, 0))
# For Model.WINDOWS alone.
NEAR_MODE_ON = (
    Step(write_register(Register.IR_BRIGHTNESS, 0x07), _NEAR_MODE_WAIT_S),
    Step(write_register(Register.NEAR_LIMIT, 0)),
)
NEAR_MODE_OFF = (
    Step(write_register(Register.IR_BRIGHTNESS, 0x1E), _NEAR_MODE_WAIT_S),
    Step(write_register(Register.NEAR_LIMIT, 0x190)),
)


def ir_brightness(level: int) -> tuple[Step, ...]:
    """Return the steps that set the projector's brightness. Raises SourceError unless ``level`` is 1 to 50."""
    if not LEAST_IR_BRIGHTNESS <= level <= MOST_IR_BRIGHTNESS:
        raise SourceError(
            f"the Kinect's infrared brightness cannot be {level}: choose {LEAST_IR_BRIGHTNESS} to {MOST_IR_BRIGHTNESS}"
        )
    return _writes((Register.IR_BRIGHTNESS, level))


def reply_payload(command: Command, tag: int, reply: bytes) -> bytes | None:
    """Return what a reply brings beside its header; None if it has not come yet: read again, but not for ever.

    Raises SourceError for a reply that is damaged, too short, or to another command.
    """
    if len(reply) in {0, REPLY_BYTES}:
        return None
    if len(reply) < _HEADER.size:
        raise _bad_reply(command, f"has {len(reply)} bytes where at least {_HEADER.size} are needed")
    magic, words, opcode, answered_tag = _HEADER.unpack_from(reply)
    payload = reply[_HEADER.size :]
    if magic != _ANSWERED:
        raise _bad_reply(command, f"begins with {magic!r} instead of {_ANSWERED!r}")
    if opcode != command.opcode:
        raise _bad_reply(command, f"is to command 0x{opcode:02x}")
    if answered_tag != tag & 0xFFFF:
        raise _bad_reply(command, f"has tag {answered_tag} instead of {tag & 0xFFFF}")
    if words != len(payload) // 2:
        raise _bad_reply(command, f"announces {words} words and has {len(payload) // 2}")
    if len(payload) < command.least_reply_bytes:
        raise _bad_reply(command, f"brings {len(payload)} bytes where {command.least_reply_bytes} are needed")
    return payload


def _bad_reply(command: Command, what: str) -> SourceError:
    return SourceError(f"the Kinect's reply to {command} {what}: {_REMEDY}")


def register_value(payload: bytes) -> int:
    """Return the value in the payload of a reply to :func:`read_register`: its second word."""
    (value,) = unpack_from("<H", payload, 2)
    return int(value)


@dataclass(frozen=True, slots=True)
class MotorRequest:
    """A control transfer to the motor device: ``length`` is how many bytes to read, 0 where nothing comes back."""

    request_type: int
    request: int
    value: int
    length: int


class Led(IntEnum):
    """What the LED of a model 1414 can show."""

    OFF = 0
    GREEN = 1
    RED = 2
    YELLOW = 3
    GREEN_BLINKING = 4
    RED_YELLOW_BLINKING = 6


ACCELEROMETER = MotorRequest(FROM_DEVICE, 0x32, 0, 10)
_COUNTS_PER_G = 819.0
_AXES = Struct(">2xhhh")


def led_request(led: Led) -> MotorRequest:
    """Return the request that switches the LED."""
    return MotorRequest(TO_DEVICE, 0x06, led, 0)


def acceleration_g(reply: bytes) -> tuple[float, float, float]:
    """Return the acceleration in g along the Kinect's own three axes, in the order in which it sends them.

    Raises SourceError for a reply that is too short to hold it.
    """
    if len(reply) < _AXES.size:
        raise SourceError(
            f"the Kinect's accelerometer sent {len(reply)} bytes where {ACCELEROMETER.length} are needed: {_REMEDY}"
        )
    x, y, z = _AXES.unpack_from(reply)
    return x / _COUNTS_PER_G, y / _COUNTS_PER_G, z / _COUNTS_PER_G
