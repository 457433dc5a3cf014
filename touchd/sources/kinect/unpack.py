"""A depth picture as it travels: 480 rows of 880 bytes, cut into 242 payloads, unpacked into 16-bit pixels.

Pixels of 11 bits follow each other without gaps, the highest bit first, so that 8 pixels fill 11 bytes.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchd.geometry import KINECT_INVALID, KINECT_SIZE
from touchd.model import Image16, frozen_array

PACKETS_PER_FRAME = 242
PAYLOAD_BYTES = 1748  # of each packet but a frame's last, which has the 1132 that are left
WIDTH, HEIGHT = KINECT_SIZE
ROW_BYTES = WIDTH * 11 // 8
PICTURE_BYTES = HEIGHT * ROW_BYTES

Bytes8 = NDArray[np.uint8]

_GROUPS_PER_ROW = WIDTH // 8
_GROUP_BYTES = 11
_LOW_22_BITS = np.uint64(0x3F_FFFF)
_PIXEL_IN_EACH_HALF = np.uint64(0x0000_07FF_0000_07FF)
# Unpacking after every transfer, on cold caches, takes 1.2 ms a frame; once ahead and once at the end 0.6 ms.
_ROWS_AHEAD = 400
# Shifts as uint64 scalars: a Python int would be converted anew in every call.
_BY_11, _BY_16, _BY_20, _BY_22, _BY_32 = (np.uint64(bits) for bits in (11, 16, 20, 22, 32))


def payload_bytes(slot: int) -> int:
    """Return how many bytes of picture a frame's packet number ``slot`` (0..241) carries."""
    return min(PAYLOAD_BYTES, PICTURE_BYTES - slot * PAYLOAD_BYTES)


def pixels_of(slot: int) -> slice:
    """Return the pixels, counted along the rows, that have at least one bit in packet number ``slot``."""
    first_bit = 8 * slot * PAYLOAD_BYTES
    return slice(first_bit // 11, -((first_bit + 8 * payload_bytes(slot)) // -11))


class RowUnpacker:
    """Unpacks rows; holds the room that this needs, so that nothing is allocated while frames flow."""

    def __init__(self) -> None:
        self._words = np.empty((HEIGHT * _GROUPS_PER_ROW, 2), np.uint64)
        self._spare = np.empty(2 * HEIGHT * _GROUPS_PER_ROW, np.uint64)

    def unpack_rows(self, packed: Bytes8, first_row: int, last_row: int, out: Image16) -> None:
        """Unpack the rows from ``first_row`` up to, not including, ``last_row``.

        ``packed``: a whole picture's bytes (422400,) uint8. ``out``: (480, 640) uint16, contiguous; other rows stay.
        """
        count = (last_row - first_row) * _GROUPS_PER_ROW
        if count <= 0:
            return
        start = first_row * ROW_BYTES
        pairs = self._words[:count]
        # Four pixels are 44 bits. A group's first four are at the top of its bytes 0 to 7, its last four at the
        # bottom of its bytes 3 to 10.
        np.right_shift(_big_endian_words(packed, start, count), _BY_20, out=pairs[:, 0])
        pairs[:, 1] = _big_endian_words(packed, start + 3, count)
        words, spare = pairs.reshape(-1), self._spare[: 2 * count]
        # Two pixels into each 32-bit half, the earlier ones into the lower half ...
        np.right_shift(words, _BY_22, out=spare)
        np.bitwise_and(spare, _LOW_22_BITS, out=spare)
        np.left_shift(words, _BY_32, out=words)
        np.bitwise_or(words, spare, out=words)
        # ... and in each half the earlier pixel into the lower 16 bits, which come first in a little-endian memory.
        pixels = out[first_row:last_row].reshape(-1).view("<u8")
        np.right_shift(words, _BY_11, out=pixels)
        np.bitwise_and(pixels, _PIXEL_IN_EACH_HALF, out=pixels)
        np.bitwise_and(words, _PIXEL_IN_EACH_HALF, out=words)
        np.left_shift(words, _BY_16, out=words)
        np.bitwise_or(pixels, words, out=pixels)


def _big_endian_words(packed: Bytes8, start: int, count: int) -> NDArray[np.uint64]:
    """Return a view (count,) of the 8 bytes at ``start`` and at every eleventh byte from there."""
    return np.ndarray((count,), ">u8", packed.data, start, (_GROUP_BYTES,))


class PictureBuffer:
    """Gathers a frame's payloads and unpacks them on the way.

    The packed bytes have one buffer, used for every frame. Each finished picture is an array of its own that whoever
    gets it may keep; a frame that is given up leaves its array to the next one.
    """

    def __init__(self) -> None:
        self._packed = np.zeros(PICTURE_BYTES, np.uint8)
        self._bytes = self._packed.data
        self._unpacker = RowUnpacker()
        self._out: Image16 = np.empty((HEIGHT, WIDTH), np.uint16)
        self._rows = 0

    def begin(self) -> None:
        """Forget what was gathered."""
        self._rows = 0

    def put(self, slot: int, payload: memoryview | bytes) -> None:
        """Store the payload of packet number ``slot``; it must have :func:`payload_bytes` bytes."""
        start = slot * PAYLOAD_BYTES
        self._bytes[start : start + len(payload)] = payload

    def holds(self, slot: int, payload: memoryview | bytes) -> bool:
        """Return whether packet number ``slot`` was stored with this very payload."""
        start = slot * PAYLOAD_BYTES
        return self._bytes[start : start + payload_bytes(slot)] == payload

    def unpack_ahead(self, slots: int) -> None:
        """Unpack, once they are most of the picture, the rows that lie wholly in the first ``slots`` packets.

        These packets stay as they are from now on. So little is left to do when the last packet is there.
        """
        rows = slots * PAYLOAD_BYTES // ROW_BYTES
        if rows - self._rows >= _ROWS_AHEAD:
            self._unpacker.unpack_rows(self._packed, self._rows, rows, self._out)
            self._rows = rows

    def finish(self, missing: Sequence[int]) -> Image16:
        """Return the picture (480, 640) uint16, read-only, without a reading where packets are ``missing``."""
        raw = self._out
        self._unpacker.unpack_rows(self._packed, self._rows, HEIGHT, raw)
        pixels = raw.reshape(-1)
        for slot in missing:
            pixels[pixels_of(slot)] = KINECT_INVALID
        self._out = np.empty((HEIGHT, WIDTH), np.uint16)
        self._rows = 0
        return frozen_array(raw)
