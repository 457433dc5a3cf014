"""TUIO 1.1 as bytes: what is in a frame's bundle and how it is cut into datagrams. No socket and no clock.

What a message looks like is in ``profiles``.

Source of the format: the TUIO 1.1 protocol specification (tuio.org) and the OSC 1.0 specification. Where they
leave freedom, the comments here name the client that can bear only one way.
"""

import struct
from collections.abc import Iterator, Sequence
from operator import attrgetter

from touchd.errors import OutputError
from touchd.outputs.profiles import CURSOR_2D, MAX_CURSORS, Profile, wire_values
from touchd.outputs.things import Thing

MAX_SOURCE_BYTES = 255
FSEQ_MAX = 2**31 - 1
SESSION_ID_MAX = 2**31 - 1

_BUNDLE_HEAD = b"#bundle\0" + struct.pack(">Q", 1)  # time tag 1: "immediately"
_REDUNDANT = -1  # the fseq that marks a bundle as no new frame
_TICKS_A_SECOND = 100  # faster than any frame rate, and than people can begin touches
_CLOCK_IS_SET_S = 1_577_836_800.0  # 2020-01-01: a clock before that was never set
_OLDEST_FIRST = attrgetter("session_id")


def first_fseq(unix_time_s: float, stored: int) -> int:
    """Return the fseq to start a run with, in 1..2**31-1, ahead of everything an earlier run sent.

    ``stored`` is the last fseq that an earlier run kept, 0 for none. The clock's value, int(unix time · 100)
    mod 2**31, is taken if it is ahead of ``stored``, else the value after ``stored``. "Ahead" is meant around
    the wrap, as in serial number arithmetic (RFC 1982): the clock's value wraps every 248 days, and 5 is
    ahead of 2**31 - 5. So a restart just after the wrap does not depend on a stored value that is right to
    the last frame. A clock that was never set cannot tell a wrap; its value counts only if it is the greater.
    """
    from_clock = max(1, int(unix_time_s * _TICKS_A_SECOND) % 2**31)
    if stored < 1:
        return from_clock
    after_stored = _following(stored)
    if unix_time_s < _CLOCK_IS_SET_S:
        return max(from_clock, after_stored)
    return from_clock if (from_clock - after_stored) % 2**31 < 2**30 else after_stored


def later_fseq(one: int, other: int) -> int:
    """Return the one of two frame numbers that comes later around the wrap; 0 stands for none and is never later."""
    if not one or not other:
        return one or other
    return one if (one - other) % FSEQ_MAX < FSEQ_MAX // 2 else other


def session_offset(unix_time_s: float) -> int:
    """Return what a run adds to the core's session ids so that they differ from those of earlier runs.

    The offset grows by 100 a second of wall-clock time. A run that begins fewer than 100 touches a second on
    average, as hands do, therefore stays below the offset of every later run, until the ids come round after
    248 days. Where the clock stands still between runs ids may repeat, but the empty bundle at the start of a
    run has then already ended what clients still held.
    """
    return int(unix_time_s * _TICKS_A_SECOND) % SESSION_ID_MAX


def wire_session_id(offset: int, session_id: int) -> int:
    """Return the session id on the wire, in 1..2**31-1, of the core's ``session_id`` (from 1)."""
    return 1 + (offset + session_id - 1) % SESSION_ID_MAX


def default_source(host: str, instance: str, address: str) -> str:
    """Return the source name ``touchd-<host>-<instance>@<address>``, with a "-" for what may not stand in it.

    The part before the @ must tell daemons apart: the C++ client merges senders of one name.
    """
    name = _printable(f"touchd-{host}-{instance}").replace("@", "-")
    return f"{name}@{_printable(address)}"


def _printable(text: str) -> str:
    return "".join(c if "!" <= c <= "~" else "-" for c in text)


def _following(fseq: int) -> int:
    return fseq % FSEQ_MAX + 1


class EncodedFrame:
    """One frame under one fseq, ready to be cut into datagrams for destinations of any limit."""

    __slots__ = ("_datagrams", "_head", "_known", "_profile", "_sets", "_tail", "fseq", "session_ids")

    def __init__(
        self,
        profile: Profile,
        source: bytes,
        fseq: int,
        sets: dict[int, bytes],
        known: frozenset[int],
    ) -> None:
        """Hold the elements ``sets`` by wire session id; ``known`` are the ids of the frame before."""
        self.fseq = fseq
        self.session_ids = tuple(sets)
        self._profile = profile
        self._head = _BUNDLE_HEAD + source
        self._tail = profile.fseq(fseq)
        self._sets = tuple(sets.values())
        self._known = known
        self._datagrams: dict[int, tuple[bytes, ...]] = {}

    def split(self, max_bytes: int) -> tuple[bytes, ...]:
        """Return the frame's datagrams, each of at most ``max_bytes``; asking again for a limit is free.

        Each datagram is a whole bundle. Where there are several, each lists as alive the cursors of the frame
        before that still live, and those set so far; only the last lists all. A complete alive in each would
        make Qt and python-tuio press at (0, 0), and one of its own ids alone would end the other cursors.

        :raises ValueError: when not even a bundle with one cursor fits ``max_bytes``.
        """
        datagrams = self._datagrams.get(max_bytes)
        if datagrams is None:
            datagrams = self._datagrams[max_bytes] = tuple(self._cut(max_bytes))
        return datagrams

    def _cut(self, max_bytes: int) -> Iterator[bytes]:
        start = 0
        while True:
            end, listed = self._fitting(start, max_bytes)
            alive = self._profile.alive(listed)
            yield b"".join((self._head, alive, *self._sets[start:end], self._tail))
            start = end
            if start == len(self._sets):
                return

    def _fitting(self, start: int, max_bytes: int) -> tuple[int, Sequence[int]]:
        """Return where the datagram that begins with cursor ``start`` ends, and the ids it lists as alive."""
        ids, known, profile = self.session_ids, self._known, self._profile
        room = max_bytes - len(self._head) - len(self._tail)
        if room >= profile.alive_bytes(len(ids)) + (len(ids) - start) * profile.set_bytes:
            return len(ids), ids
        listed = start + sum(session_id in known for session_id in ids[start:])
        end = start
        while end < len(ids):
            grown = listed + (ids[end] not in known)
            if profile.alive_bytes(grown) + (end + 1 - start) * profile.set_bytes > room:
                break
            end, listed = end + 1, grown
        if end == start:
            raise ValueError(f"A TUIO bundle does not fit a datagram of {max_bytes} bytes; allow more.")
        return end, [*ids[:end], *(session_id for session_id in ids[end:] if session_id in known)]


class TuioEncoder:
    """Turns the cursors, fingertips or blobs of each frame into TUIO 1.1 bundles of one profile, with one fseq counter.

    Everything that a destination port gets must come from one encoder, as clients keep one fseq per sender.
    """

    def __init__(self, source: str, session_offset: int, first_fseq: int, profile: Profile = CURSOR_2D) -> None:
        """Start with ``first_fseq`` (1..2**31-1) as the first frame's fseq, and no cursors known to anyone.

        :raises OutputError: when ``source`` cannot be an OSC string of at most 255 bytes.
        """
        self._profile = profile
        self._source = self._profile.source(_source_name(source))
        self._offset = session_offset
        self._fseq = (first_fseq - 2) % FSEQ_MAX + 1  # the one before
        self._known: frozenset[int] = frozenset()

    @property
    def profile(self) -> str:
        """The name of the profile that is sent."""
        return self._profile.name

    @property
    def last_fseq(self) -> int:
        """The fseq of the last frame: what to keep for :func:`first_fseq` of the next run."""
        return self._fseq

    def next_frame(self, things: Sequence[Thing]) -> EncodedFrame:
        """Take the next fseq and encode ``things``, of the profile, under it: a set for every one, moved or not.

        One whose x or y is no finite number is left out. Of more than ``MAX_CURSORS`` the oldest, those with the
        lowest session ids, stay.
        """
        sets: dict[int, bytes] = {}
        for thing in sorted(things, key=_OLDEST_FIRST):
            values = wire_values(thing)
            if values is not None:
                session_id = wire_session_id(self._offset, thing.session_id)
                sets[session_id] = self._profile.set(session_id, values)
                if len(sets) == MAX_CURSORS:
                    break
        self._fseq = _following(self._fseq)
        frame = EncodedFrame(self._profile, self._source, self._fseq, sets, self._known)
        self._known = frozenset(sets)
        return frame

    def clear(self) -> bytes:
        """Return the redundant empty bundle (fseq -1) that ends every cursor in every client."""
        self._known = frozenset()
        return b"".join((_BUNDLE_HEAD, self._source, self._profile.alive(()), self._profile.fseq(_REDUNDANT)))


def _source_name(source: str) -> bytes:
    if not source or _printable(source) != source:
        raise OutputError(
            f"The TUIO source name {source!r} is empty or has other than printable ASCII characters; "
            "write it as name@address."
        )
    if len(source) > MAX_SOURCE_BYTES:
        raise OutputError(
            f"The TUIO source name {source[:20]!r}… has {len(source)} characters; give it at most {MAX_SOURCE_BYTES}."
        )
    return source.encode("ascii")
