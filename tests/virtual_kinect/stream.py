"""Depth pictures as the camera sends them: packed pixels, cut into packets, laid out over USB's microframes.

Standard library alone: Debian's own Python imports this, too.
"""

import struct
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

WIDTH, HEIGHT = 640, 480
PIXELS = WIDTH * HEIGHT
PICTURE_BYTES = 2 * PIXELS  # little-endian uint16
MICROFRAMES_PER_S = 8000
TICKS_PER_S = 60_000_000
TICKS_PER_MICROFRAME = TICKS_PER_S // MICROFRAMES_PER_S
FRAME_TICKS = 2_002_155  # between depth frames of a real recording at "30 fps": 33.37 ms
PAYLOAD_BYTES = 1748
START, MIDDLE, END = 0x71, 0x72, 0x75
_LANE_BITS = 128  # eight pixels of 16 bits


def pack(picture: bytes, bits: int) -> bytes:
    """Return a picture of little-endian uint16 pixels as a big-endian stream of ``bits`` (10 or 11) a pixel.

    The whole picture is one integer of 16-bit lanes. Neighbouring lanes are moved together, three times, until each
    lane of 128 bits holds its eight pixels at its low end; then the unused bytes of every lane are left out.
    """
    words = array("H", picture)
    words.byteswap()
    value = int.from_bytes(words.tobytes(), "big")
    lane, width = 16, bits
    while lane < _LANE_BITS:
        low = _low_bits(lane, width)
        value = (value & low) | ((value >> (lane - width)) & (low << width))
        lane, width = 2 * lane, 2 * width
    lanes = value.to_bytes(PICTURE_BYTES, "big")
    packed = bytearray(PIXELS * bits // 8)
    for i in range(bits):
        packed[i::bits] = lanes[16 - bits + i :: 16]
    return bytes(packed)


@lru_cache(maxsize=6)
def _low_bits(lane: int, width: int) -> int:
    """Return a mask of the low ``width`` bits of every second lane."""
    return int.from_bytes(((1 << width) - 1).to_bytes(lane // 4, "big") * (PIXELS * 16 // (2 * lane)), "big")


def mirrored(picture: bytes) -> bytes:
    """Return the picture with left and right exchanged."""
    words = array("H", picture)
    return b"".join(words[at : at + WIDTH][::-1].tobytes() for at in range(0, PICTURE_BYTES // 2, WIDTH))


def in_10_bits(picture: bytes) -> bytes:
    """Return the picture without the lowest of its 11 bits, so that "no reading" is 1023."""
    return array("H", [value >> 1 for value in array("H", picture)]).tobytes()


class Pictures(Protocol):
    """Pictures of 640 x 480 little-endian uint16, by index."""

    def __len__(self) -> int: ...

    def __getitem__(self, index: int, /) -> bytes: ...


class Film:
    """Pictures played in a loop, packed when first asked for; the packed ones are kept.

    ``order`` names the pictures in the order in which they are shown, each as often as wanted; absent: each once.
    """

    def __init__(self, pictures: Pictures, order: Sequence[int] | None = None) -> None:
        self._pictures = pictures
        self._order = order or range(len(pictures))
        self.packed = lru_cache(maxsize=256)(self._packed)

    def picture_of(self, frame: int) -> int:
        """Return the index of the picture that frame ``frame`` of the stream shows."""
        return self._order[frame % len(self._order)]

    def _packed(self, picture: int, bits: int, mirror: bool) -> bytes:
        pixels = self._pictures[picture]
        pixels = mirrored(pixels) if mirror else pixels
        return pack(in_10_bits(pixels) if bits == 10 else pixels, bits)


@dataclass(frozen=True, slots=True)
class StreamSettings:
    """How depth is sent: what the registers said when the stream was switched on at microframe ``start``."""

    start: int
    bits: int = 11
    fps: int = 30
    first_ticks: int = 0  # the device's clock at the first frame; it wraps at 2**32

    @property
    def packets_per_frame(self) -> int:
        return -(-PIXELS * self.bits // (8 * PAYLOAD_BYTES))

    @property
    def frame_ticks(self) -> int:
        return FRAME_TICKS * 30 // self.fps


class DepthStream:
    """The packets of endpoint 0x82 by microframe. Those of a frame are spread evenly over the frame's time.

    A packet depends on its microframe alone, so that nobody needs to fetch them in order, or at all.
    """

    def __init__(self, film: Film, settings: StreamSettings, mirror: Callable[[], bool]) -> None:
        self._film = film
        self.settings = settings
        self._mirror = mirror
        self._per_frame = settings.packets_per_frame
        self._ticks = settings.frame_ticks
        self._frame = -1
        self._pixels = b""

    def number_at(self, microframe: int) -> int | None:
        """Return the number of the packet that is sent in a microframe, counted from the stream's start."""
        since = microframe - self.settings.start
        if since < 0:
            return None
        number = self._newest(since)
        return number if since == 0 or number != self._newest(since - 1) else None

    def _newest(self, microframes: int) -> int:
        return microframes * TICKS_PER_MICROFRAME * self._per_frame // self._ticks

    def packet(self, number: int) -> bytes:
        """Return packet ``number`` from the stream's start: a header of 12 bytes and its part of the picture."""
        frame, part = divmod(number, self._per_frame)
        if frame != self._frame:
            self._frame = frame
            self._pixels = self._film.packed(self._film.picture_of(frame), self.settings.bits, self._mirror())
        flag = START if part == 0 else END if part == self._per_frame - 1 else MIDDLE
        ticks = (self.settings.first_ticks + frame * self._ticks) % 2**32
        header = struct.pack("<2sBBBBHI", b"RB", 0, flag, 0, number % 256, 0, ticks)
        return header + self._pixels[part * PAYLOAD_BYTES : (part + 1) * PAYLOAD_BYTES]
