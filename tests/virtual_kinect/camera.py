"""The camera of a Kinect v1: commands, registers and the depth stream.

Standard library alone: Debian's own Python imports this, too.
"""

import struct
from dataclasses import dataclass

from virtual_kinect.faults import Reply
from virtual_kinect.model import Clock, Device, Setup
from virtual_kinect.shapes import DEPTH_ENDPOINT, RELEASE_1414, Shape
from virtual_kinect.stream import DepthStream, Film, StreamSettings

_HEADER = struct.Struct("<2sHHH")
_READ, _WRITE, _FIXED, _ALGORITHM = 0x02, 0x03, 0x04, 0x16
_CONST_SHIFT, _REGISTRATION, _PADDING = 0x00, 0x40, 0x41  # of 0x16; C libfreenect asks for all three
_DEPTH_ON, _DEPTH_BITS, _DEPTH_SIZE, _DEPTH_FPS, _DEPTH_MIRROR = 0x06, 0x12, 0x13, 0x14, 0x17
_NOT_READY_BYTES = 512


@dataclass(frozen=True, slots=True)
class Constants:
    """A camera's own constants, from which raw shift becomes millimetres."""

    emitter_cm: float = 7.5
    rgb_cm: float = 2.3
    reference_cm: float = 120.0
    pixel_mm: float = 0.1042
    const_shift: int = 200


class Camera(Device):
    """The camera; ``written`` lists every (register, value) that was written."""

    def __init__(
        self, shape: Shape, ports: tuple[int, ...], film: Film, clock: Clock, constants: Constants | None = None
    ) -> None:
        super().__init__(shape, ports)
        self.own_driver = "gspca_kinect"
        self.constants = constants or Constants()
        self.film = film
        self.first_ticks = 0  # of the next stream; near 2**32 its clock wraps
        self._clock = clock
        self.written: list[tuple[int, int]] = []
        self.close_down()

    def close_down(self) -> None:
        super().close_down()
        self.registers: dict[int, int] = {}
        self.stream: DepthStream | None = None
        self._reply: bytes | None = None
        self._polls = 0

    def vendor(self, setup: Setup, data: bytes) -> bytes | None:
        if setup[:2] == (0x40, 0x00):
            return self._command(data)
        if setup[:2] == (0xC0, 0x00):
            return self._poll()
        return None

    def _poll(self) -> bytes:
        """Answer a program that asks for the reply: not at once, as a real camera does not, either."""
        faults = self.faults
        if faults.reply is Reply.EMPTY or self._reply is None:
            return b""
        if faults.reply is Reply.NOT_READY:
            return bytes(_NOT_READY_BYTES)
        if self._polls < faults.polls_before_reply:
            self._polls += 1
            return bytes(faults.length_before_reply)
        reply, self._reply = self._reply, None
        return reply

    def _command(self, data: bytes) -> bytes | None:
        if len(data) < _HEADER.size:
            return None
        magic, words, command, tag = _HEADER.unpack_from(data)
        payload = data[_HEADER.size :]
        self._reply, self._polls = None, 0
        if magic != b"GM" or len(payload) != 2 * words:
            return b""  # a command that makes no sense is taken and never answered
        answer = self._answer(command, [value for (value,) in struct.iter_unpack("<H", payload)])
        if answer is not None:
            self._reply = self._with_header(command, tag, answer)
        return b""

    def _with_header(self, command: int, tag: int, answer: bytes) -> bytes:
        fault = self.faults.reply
        magic = b"XX" if fault is Reply.WRONG_MAGIC else b"RB"
        command = command ^ 0x80 if fault is Reply.WRONG_COMMAND else command
        tag = (tag + 1) % 2**16 if fault is Reply.WRONG_TAG else tag
        return _HEADER.pack(magic, len(answer) // 2, command, tag) + answer

    def _answer(self, command: int, words: list[int]) -> bytes | None:
        if command == _WRITE and len(words) == 2:
            self._write(*words)
            return bytes(2)
        if command == _READ and len(words) == 1:
            return struct.pack("<HH", words[0], self.registers.get(words[0], 0))
        if command == _FIXED and words == [0] * 5:
            constants = self.constants
            floats = (constants.emitter_cm, constants.rgb_cm, constants.reference_cm, constants.pixel_mm)
            length = 322 if self.shape.device_release == RELEASE_1414 else 334
            return (bytes(94) + struct.pack("<ffff", *floats)).ljust(length, b"\0")
        if command == _ALGORITHM and len(words) == 5:
            shift = struct.pack("<HH", 0, self.constants.const_shift)
            return {_CONST_SHIFT: shift, _REGISTRATION: bytes(118), _PADDING: bytes(8)}.get(words[0])
        return None

    def _write(self, register: int, value: int) -> None:
        self.registers[register] = value
        self.written.append((register, value))
        if register == _DEPTH_ON:
            self.stream = self._started() if value == 2 and self.registers.get(_DEPTH_SIZE) == 1 else None

    def _started(self) -> DepthStream | None:
        bits = {3: 11, 2: 10}.get(self.registers.get(_DEPTH_BITS, 0))
        fps = self.registers.get(_DEPTH_FPS, 0)
        if bits is None or not 1 <= fps <= 30:
            return None
        settings = StreamSettings(self._clock.microframe() + 1, bits, fps, self.first_ticks)
        return DepthStream(self.film, settings, lambda: self.registers.get(_DEPTH_MIRROR, 0) == 1)

    def iso_packets(self, endpoint: int, first: int, count: int) -> list[bytes]:
        """Return what the endpoint sends from microframe ``first`` on; a Kinect for Windows wants alternate 1."""
        self.check()
        awake = self.alternate == self.shape.alternates - 1
        if endpoint != DEPTH_ENDPOINT or self.stream is None or not awake:
            return [b""] * count
        return [self._packet_at(self.stream, microframe) for microframe in range(first, first + count)]

    def _packet_at(self, stream: DepthStream, microframe: int) -> bytes:
        number = stream.number_at(microframe)
        if number is None:
            return b""
        last = self.faults.unplug_before_packet
        if last is not None and number >= last:
            self.pull_out()
        return self.faults.damaged(number, stream.packet(number))
