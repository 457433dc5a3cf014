"""OSC datagrams, read strictly: what is malformed is named with its place, and nothing raises.

Source of the format: the OSC 1.0 specification (opensoundcontrol.org), with the further type tags that it lists as
widespread.
"""

import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

IMMEDIATELY = 1  # the time tag that means "at once"

Argument: TypeAlias = int | float | str | bytes | None

_BUNDLE = b"#bundle\0"
_INT = struct.Struct(">i")
_DEEPEST = 8  # bundles in bundles; nobody means more
_FIXED = {"i": "i", "f": "f", "h": "q", "d": "d", "t": "Q", "c": "I", "r": "I", "m": "I"}
_STRINGS = "sS"
_BLOB = "b"
_WITHOUT_DATA = "TFNI[]"


@dataclass(frozen=True, slots=True)
class OscMessage:
    """A message. ``tags`` are its type tags without the comma; every tag has an argument, None where it has no data."""

    address: str
    tags: str
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class OscBundle:
    """The messages that stand directly in one bundle. ``time_tag`` is None for a message that is in no bundle."""

    time_tag: int | None
    messages: tuple[OscMessage, ...]


@dataclass(frozen=True, slots=True)
class Malformed:
    """Why a datagram is no OSC: the byte at which it fails, and how, as the end of a sentence."""

    offset: int
    problem: str


def decode(datagram: bytes) -> tuple[OscBundle, ...] | Malformed:
    """Return the bundles of a datagram, an outer one before those in it, or what is wrong with it."""
    found: list[OscBundle] = []
    try:
        _packet(datagram, 0, len(datagram), found, 0)
    except _Bad as bad:
        return Malformed(bad.offset, bad.problem)
    return tuple(found)


class _Bad(Exception):
    def __init__(self, offset: int, problem: str) -> None:
        super().__init__(problem)
        self.offset = offset
        self.problem = problem


def _packet(data: bytes, start: int, end: int, found: list[OscBundle], depth: int) -> None:
    if start == end:
        raise _Bad(start, "there is nothing where a bundle or a message should begin")
    if (end - start) % 4:
        raise _Bad(end, f"{end - start} bytes are no multiple of 4")
    if data.startswith(_BUNDLE, start, end):
        _bundle(data, start, end, found, depth)
    elif depth == 0:
        found.append(OscBundle(None, (_message(data, start, end),)))
    else:
        raise _Bad(start, "a bundle was expected")


def _bundle(data: bytes, start: int, end: int, found: list[OscBundle], depth: int) -> None:
    if depth == _DEEPEST:
        raise _Bad(start, f"bundles are nested more than {_DEEPEST} deep")
    if end - start < 16:
        raise _Bad(end, "the bundle ends before its time tag does")
    messages: list[OscMessage] = []
    nested: list[OscBundle] = []
    at = start + 16
    while at < end:
        size = _INT.unpack_from(data, at)[0]  # the bundle's length is a multiple of 4, so these 4 bytes are there
        if size <= 0 or size % 4:
            raise _Bad(at, f"the element's size is {size}, which is no positive multiple of 4")
        if size > end - at - 4:
            raise _Bad(at, f"the element's size is {size}, but only {end - at - 4} bytes are left")
        at += 4
        if data[at : at + 1] == b"#":
            _packet(data, at, at + size, nested, depth + 1)
        else:
            messages.append(_message(data, at, at + size))
        at += size
    found.append(OscBundle(int.from_bytes(data[start + 8 : start + 16], "big"), tuple(messages)))
    found.extend(nested)


def _message(data: bytes, start: int, end: int) -> OscMessage:
    if data[start : start + 1] != b"/":
        raise _Bad(start, f'found {data[start : start + 8]!r} where "#bundle" or an address with its "/" should begin')
    address, at = _ascii(data, start, end, "address")
    if at == end:
        raise _Bad(at, "the message has no type tags")
    if data[at : at + 1] != b",":
        raise _Bad(at, f'the type tags begin with {data[at : at + 1]!r} in place of ","')
    tags, at = _ascii(data, at, end, "type tags")
    arguments, at = _arguments(data, at, end, tags[1:])
    if at != end:
        raise _Bad(at, f"{end - at} bytes follow the last argument of the type tags {tags!r}")
    return OscMessage(address, tags[1:], arguments)


def _arguments(data: bytes, at: int, end: int, tags: str) -> tuple[tuple[Argument, ...], int]:
    arguments: list[Argument] = []
    for run in _runs(tags):
        if isinstance(run, struct.Struct):
            if run.size > end - at:
                raise _Bad(at, f"the arguments end before the type tags {',' + tags!r} do")
            arguments += run.unpack_from(data, at)
            at += run.size
        elif run in _STRINGS:
            raw, at = _string(data, at, end, "string")
            arguments.append(raw.decode("utf-8", "replace"))
        elif run == _BLOB:
            blob, at = _blob(data, at, end)
            arguments.append(blob)
        elif run in _WITHOUT_DATA:
            arguments.append(None)
        else:
            raise _Bad(at, f"the type tags {',' + tags!r} have the unknown letter {run!r}")
    return tuple(arguments), at


@lru_cache(maxsize=512)
def _runs(tags: str) -> tuple[str | struct.Struct, ...]:
    """Return the tags with every run of fixed-size arguments as one struct: a set is then read at one go."""
    runs: list[str | struct.Struct] = []
    fixed = ""
    for tag in tags:
        if tag in _FIXED:
            fixed += _FIXED[tag]
            continue
        if fixed:
            runs.append(struct.Struct(">" + fixed))
            fixed = ""
        runs.append(tag)
    if fixed:
        runs.append(struct.Struct(">" + fixed))
    return tuple(runs)


def _ascii(data: bytes, start: int, end: int, what: str) -> tuple[str, int]:
    raw, at = _string(data, start, end, what)
    text = raw.decode("latin-1")
    for place, letter in enumerate(text):
        if not "!" <= letter <= "~":
            raise _Bad(start + place, f"the {what} has the byte 0x{ord(letter):02x}, which is no printable ASCII")
    return text, at


def _string(data: bytes, start: int, end: int, what: str) -> tuple[bytes, int]:
    """Return the bytes of the string at ``start`` and where the next item begins."""
    stop = data.find(b"\0", start, end)
    if stop < 0:
        raise _Bad(start, f"the {what} has no zero byte at its end")
    following = start + (stop - start) // 4 * 4 + 4
    if any(data[stop:following]):
        raise _Bad(stop, f"the {what} is not padded with zero bytes to a multiple of 4")
    return data[start:stop], following


def _blob(data: bytes, start: int, end: int) -> tuple[bytes, int]:
    if end - start < 4:
        raise _Bad(start, "the blob has no size")
    size = _INT.unpack_from(data, start)[0]
    padded = (size + 3) // 4 * 4
    if size < 0 or padded > end - start - 4:
        raise _Bad(start, f"the blob's size is {size}, but only {end - start - 4} bytes are left")
    return data[start + 4 : start + 4 + size], start + 4 + padded
