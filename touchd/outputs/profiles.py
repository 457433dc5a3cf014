"""The TUIO 1.1 profiles that touchd sends, as bytes: what differs between them, and no more.

Source of the format: the TUIO 1.1 protocol specification (tuio.org) and the OSC 1.0 specification.
"""

import math
import struct
from collections.abc import Sequence

from touchd.outputs.things import AirCursor, Blob, Thing

MAX_CURSORS = 60  # with the longest source name they still fit one datagram of 4096 bytes as 2Dcur

_INT = struct.Struct(">i")
_F32_MAX = (2.0 - 2.0**-23) * 2.0**127
_F32_MIN_NORMAL = 2.0**-126


def _padded(text: bytes) -> bytes:
    return text + b"\0" * (4 - len(text) % 4)


def _element(message: bytes) -> bytes:
    return _INT.pack(len(message)) + message


class Profile:
    """The messages of one TUIO profile as bundle elements: a message with its length before it.

    ``name`` is the last part of the profile's OSC address, ``set_floats`` how many floats follow the session id in
    its set message. Nothing else differs between the profiles of cursors, fingertips and blobs.
    """

    def __init__(self, name: str, set_floats: int) -> None:
        self.name = name
        self._address = _padded(f"/tuio/{name}".encode("ascii"))
        tags = _padded(b",si" + b"f" * set_floats)
        length = len(self._address) + len(tags) + 4 + 4 + 4 * set_floats
        self._set_head = _INT.pack(length) + self._address + tags + _padded(b"set")
        self._set = struct.Struct(f">{len(self._set_head)}si{set_floats}f")
        fseq = self._address + _padded(b",si") + _padded(b"fseq")
        self._fseq_head = _INT.pack(len(fseq) + 4) + fseq
        self._alive_heads = tuple(self._alive_head(count) for count in range(MAX_CURSORS + 1))
        self.set_bytes = self._set.size

    def source(self, name: bytes) -> bytes:
        """Return the source element."""
        return _element(self._address + _padded(b",ss") + _padded(b"source") + _padded(name))

    def alive(self, session_ids: Sequence[int]) -> bytes:
        """Return the alive element of up to ``MAX_CURSORS`` session ids as they stand on the wire."""
        count = len(session_ids)
        return self._alive_heads[count] + struct.pack(f">{count}i", *session_ids)

    def alive_bytes(self, count: int) -> int:
        """Return the size of the alive element of ``count`` session ids."""
        return len(self._alive_heads[count]) + 4 * count

    def set(self, session_id: int, values: tuple[float, ...]) -> bytes:
        """Return the set element; every value must be a number that float32 can hold."""
        return self._set.pack(self._set_head, session_id, *values)

    def fseq(self, number: int) -> bytes:
        """Return the fseq element."""
        return self._fseq_head + _INT.pack(number)

    def _alive_head(self, count: int) -> bytes:
        body = self._address + _padded(b",s" + b"i" * count) + _padded(b"alive")
        return _INT.pack(len(body) + 4 * count) + body


CURSOR_2D = Profile("2Dcur", set_floats=5)
CURSOR_25D = Profile("25Dcur", set_floats=7)
BLOB_2D = Profile("2Dblb", set_floats=11)
PROFILES = {profile.name: profile for profile in (CURSOR_2D, CURSOR_25D, BLOB_2D)}


def wire_values(thing: Thing) -> tuple[float, ...] | None:
    """Return the floats of a thing's set message, or None where its place is no finite number."""
    if not (math.isfinite(thing.x) and math.isfinite(thing.y)):
        return None
    place = _clamped(thing.x), _clamped(thing.y)
    velocity = _sendable(thing.vx), _sendable(thing.vy)
    accel = _sendable(thing.accel)
    if isinstance(thing, AirCursor):
        return *place, _clamped(thing.z), *velocity, _sendable(thing.vz), accel
    if isinstance(thing, Blob):
        size = _clamped(thing.width), _clamped(thing.height), _clamped(thing.area)
        turn, turn_accel = _sendable(thing.turn), _sendable(thing.turn_accel)
        return *place, _sendable(thing.angle), *size, *velocity, turn, accel, turn_accel
    return *place, *velocity, accel


def _clamped(coordinate: float) -> float:
    if _F32_MIN_NORMAL <= coordinate <= 1.0:
        return coordinate
    return 1.0 if coordinate > 1.0 else 0.0


def _sendable(value: float) -> float:
    """Return ``value``, or 0.0 where float32 would make NaN, infinity, -0.0 or a subnormal number of it."""
    if _F32_MIN_NORMAL <= value <= _F32_MAX or -_F32_MAX <= value <= -_F32_MIN_NORMAL:
        return value
    return 0.0
