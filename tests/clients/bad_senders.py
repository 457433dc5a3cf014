"""Small TUIO senders, each with one mistake of those that break real clients, with python-osc's messages.

A sender is a list of posts: the loopback address to send from, and the datagram.
"""

import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from pythonosc.osc_message_builder import OscMessageBuilder

CURSOR = "/tuio/2Dcur"
HERE = "127.0.0.1"
THERE = "127.0.0.2"
SOURCE = "bad@table"

Point: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Post:
    """A datagram, and the address that it is sent from."""

    datagram: bytes
    host: str = HERE


def message(address: str, types: str, *arguments: str | float) -> bytes:
    """Return an OSC message with the types given, whatever they should be."""
    builder = OscMessageBuilder(address)
    for kind, argument in zip(types, arguments, strict=True):
        builder.add_arg(argument, kind)
    dgram: bytes = builder.build().dgram
    return dgram


def bundle(*messages: bytes, time_tag: int = 1) -> bytes:
    """Return the messages as one bundle with the time tag "immediately", or another."""
    elements = b"".join(struct.pack(">i", len(each)) + each for each in messages)
    return b"#bundle\0" + struct.pack(">Q", time_tag) + elements


def source(name: str = SOURCE, address: str = CURSOR) -> bytes:
    return message(address, "ss", "source", name)


def alive(*session_ids: int, address: str = CURSOR) -> bytes:
    return message(address, "s" + "i" * len(session_ids), "alive", *session_ids)


def placed(session_id: int, x: float, y: float, speed: float = 0.0) -> bytes:
    return message(CURSOR, "sifffff", "set", session_id, x, y, speed, 0.0, 0.0)


def fseq(number: int, address: str = CURSOR) -> bytes:
    return message(address, "si", "fseq", number)


def frame(
    number: int,
    cursors: Mapping[int, Point] | None = None,
    listed: Iterable[int] | None = None,
    name: str = SOURCE,
) -> bytes:
    """Return a bundle that sets ``cursors`` and lists as alive these, or those ``listed``."""
    at = cursors or {}
    sets = [placed(session_id, *where) for session_id, where in at.items()]
    return bundle(source(name), alive(*(at if listed is None else listed)), *sets, fseq(number))


def empty_object_frame(number: int) -> bytes:
    address = "/tuio/2Dobj"
    return bundle(source(address=address), alive(address=address), fseq(number, address))


def set_with(types: str, *arguments: str | float) -> list[Post]:
    """A frame of cursor 1 whose set has these types and arguments."""
    return [Post(bundle(source(), alive(1), message(CURSOR, types, "set", 1, *arguments), fseq(1)))]


def fseq_restarts_just_below() -> list[Post]:
    return [Post(frame(number)) for number in (*range(1, 41), *range(1, 6))]


def a_counter_for_each_profile() -> list[Post]:
    return [Post(datagram) for number in range(1, 6) for datagram in (frame(1000 + number), empty_object_frame(number))]


def one_name_on_two_hosts() -> list[Post]:
    return [Post(frame(number, {number % 2 + 1: (0.5, 0.5)}), (HERE, THERE)[number % 2]) for number in range(1, 7)]


def two_senders_to_one_port() -> list[Post]:
    return [
        post
        for number in range(1, 4)
        for post in (Post(frame(number, {1: (0.5, 0.5)}, name="one@a")), Post(frame(number, name="two@b"), THERE))
    ]


def alive_without_a_set() -> list[Post]:
    return [Post(frame(1)), Post(frame(2, listed=[7])), Post(frame(3, {7: (0.5, 0.5)}))]


def split_with_the_complete_alive_in_each() -> list[Post]:
    first, second = {1: (0.1, 0.1)}, {2: (0.2, 0.2)}
    return [Post(frame(1)), Post(frame(2, first, listed=[1, 2])), Post(frame(2, second, listed=[1, 2]))]


def split_with_its_own_ids_in_each() -> list[Post]:
    return [Post(frame(1)), Post(frame(2, {1: (0.1, 0.1)})), Post(frame(2, {2: (0.2, 0.2)}))]


def set_before_alive() -> list[Post]:
    return [Post(bundle(source(), placed(1, 0.5, 0.5), alive(1), fseq(1)))]


def without_m() -> list[Post]:
    return set_with("siffff", 0.5, 0.5, 0.0, 0.0)


def an_int_for_a_float() -> list[Post]:
    return set_with("sififff", 0.5, 0, 0.0, 0.0, 0.0)


def doubles() -> list[Post]:
    return set_with("siddddd", 0.5, 0.5, 0.0, 0.0, 0.0)


def a_64_bit_session_id() -> list[Post]:
    listed = message(CURSOR, "sh", "alive", 2**31)
    at = message(CURSOR, "shfffff", "set", 2**31, 0.5, 0.5, 0.0, 0.0, 0.0)
    return [Post(bundle(source(), listed, at, fseq(1)))]


def another_profile_on_the_port() -> list[Post]:
    return [Post(frame(1)), Post(empty_object_frame(2))]


def tuio_2_on_the_port() -> list[Post]:
    return [Post(frame(1)), Post(bundle(message("/tuio2/frm", "ii", 2, 0), message("/tuio2/alv", "")))]


def over_4098_bytes() -> list[Post]:
    return [Post(frame(1, dict.fromkeys(range(1, 71), (0.5, 0.5))))]


def not_a_number() -> list[Post]:
    return set_with("sifffff", 0.5, float("nan"), 0.0, 0.0, 0.0)


BadSender: TypeAlias = Callable[[], list[Post]]

# By bad sender: the rule that names its mistake, and what the monitor must say after the sender's name and address.
SENTENCES: Mapping[BadSender, tuple[str, str]] = {
    fseq_restarts_just_below: (
        "fseq-back",
        ", fseq 3: fseq went back from 40 to 1 and counts on from there. C++, Java and .NET clients drop everything "
        "until it catches up, and JS adds touches twice. Begin each run above the last fseq, for example with the "
        "time in hundredths of a second.",
    ),
    a_counter_for_each_profile: (
        "fseq-apart",
        ", fseq 3: 2Dobj counts its own frames: fseq 3 follows fseq 1003 of another profile. Clients keep one counter "
        "and drop one of the profiles. Use one counter for all profiles.",
    ),
    one_name_on_two_hosts: (
        "same-name",
        ": OTHER sends under the same name. The C++ client merges them, and cursors flap. Give each sender a name of "
        "its own before the @.",
    ),
    two_senders_to_one_port: (
        "two-senders",
        ": two@b (OTHER) sends to the same port. All but the C++ client end one's cursors at the other's alive. Send "
        "to a port for each, or stop one.",
    ),
    alive_without_a_set: (
        "phantom",
        ", fseq 2: cursor 7 is listed as alive but was never set. Qt and python-tuio press at (0, 0). Set a cursor "
        "in the bundle that first lists it.",
    ),
    split_with_the_complete_alive_in_each: (
        "split-complete",
        ", fseq 2: cursor 2 is listed before the datagram of a split frame that sets it. Qt and python-tuio press "
        "those at (0, 0). List in each datagram only the old cursors and those set so far.",
    ),
    split_with_its_own_ids_in_each: (
        "split-own",
        ", fseq 2: cursor 1 is not listed in every datagram of a split frame. Every client deletes those cursors. "
        "List in each datagram the old cursors and all those set so far.",
    ),
    set_before_alive: (
        "order",
        ", fseq 1: alive comes after set. Touches are lost, or pressed at (0, 0). Send source, alive, every set, then "
        "fseq.",
    ),
    without_m: (
        "arguments",
        ", fseq 1: set lacks m; 2Dcur has 6: s x y X Y m. Touches are lost, pressed at (0, 0), or end the listening "
        "thread of Java and Kivy. Send all arguments of the specification, with zeros for the unknown.",
    ),
    an_int_for_a_float: (
        "types",
        ", fseq 1: y of set is an int (i) in place of a float (f). Touches are lost, pressed at (0, 0), or end the "
        "listening thread of Java and Kivy. Give every argument the type of the specification explicitly.",
    ),
    doubles: (
        "types",
        ", fseq 1: x of set is a double (d) in place of a float (f). Touches are lost, pressed at (0, 0), or end the "
        "listening thread of Java and Kivy. Give every argument the type of the specification explicitly.",
    ),
    a_64_bit_session_id: (
        "types",
        ", fseq 1: a session id in alive is a 64-bit int (h) in place of an int (i). Touches are lost, pressed at "
        "(0, 0), or end the listening thread of Java and Kivy. Give every argument the type of the specification "
        "explicitly.",
    ),
    another_profile_on_the_port: (
        "mixed-profiles",
        ", fseq 2: 2Dobj comes to a port that gets 2Dcur as well. Kivy doubles touches or its thread ends, and Qt "
        "logs a warning for each message. Send each profile to a port of its own.",
    ),
    tuio_2_on_the_port: (
        "tuio-2",
        ': "/tuio2/frm" is an address of TUIO 2.0. TUIO 1.1 clients do not know it; Kivy\'s thread can end at it. '
        "Send TUIO 2.0 to a port of its own.",
    ),
    over_4098_bytes: (
        "too-large",
        ": a datagram has 4388 bytes. The C++ client aborts above 4098. Send at most 4096 bytes, and split larger "
        "frames with a growing alive.",
    ),
    not_a_number: (
        "not-finite",
        ", fseq 1: y of cursor 1 is nan. It stays in the C++ client for the cursor's whole life. Leave out a cursor "
        "without a position.",
    ),
}
