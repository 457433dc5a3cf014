import math
import random
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_bundle import OscBundle as OracleBundle
from touchd.listen.checker import Checker
from touchd.listen.osc import Malformed, decode
from touchd.listen.rules import FLICKER, Finding, Severity
from touchd.model import Cursor
from touchd.outputs.tuio import TuioEncoder

from clients.bad_senders import bundle, message

ADDRESS = ("127.0.0.1", 40_000)

ids = st.integers(1, 2**31 - 1)
unit = st.floats(0.0, 1.0, width=32)
cursors = st.lists(
    st.builds(Cursor, ids, unit, unit, unit, unit, unit, st.just(4.0), st.just(60.0), st.just(0.0)),
    max_size=20,
    unique_by=lambda cursor: cursor.session_id,
)
words = st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=9)
addresses = st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=9).map("/".__add__)
arguments = st.one_of(
    st.tuples(st.just("i"), st.integers(-(2**31), 2**31 - 1)),
    st.tuples(st.just("h"), st.integers(-(2**63), 2**63 - 1)),
    st.tuples(st.just("f"), st.floats(allow_nan=False, width=32)),
    st.tuples(st.just("d"), st.floats(allow_nan=False)),
    st.tuples(st.just("s"), words),
    st.tuples(st.just("b"), st.binary(min_size=1, max_size=9)),
)
messages = st.tuples(addresses, st.lists(arguments, max_size=8))


def sent(cursors: list[Cursor]) -> bytes:
    return TuioEncoder("a@b", 0, 1).next_frame(cursors).split(4096)[0]


@settings(deadline=None)
@given(st.lists(messages, max_size=6), st.integers(0, 2**64 - 1))
def test_what_an_independent_encoder_wrote_is_read_as_it_was_meant(
    wanted: list[tuple[str, list[tuple[str, str | float]]]], time_tag: int
) -> None:
    encoded = [
        message(address, "".join(tag for tag, _ in pairs), *(value for _, value in pairs)) for address, pairs in wanted
    ]
    decoded = decode(bundle(*encoded, time_tag=time_tag))
    assert not isinstance(decoded, Malformed)
    (read,) = decoded
    assert read.time_tag == time_tag
    assert [(each.address, list(zip(each.tags, each.arguments, strict=True))) for each in read.messages] == wanted


@settings(deadline=None)
@given(cursors)
def test_touchds_bundles_are_read_as_python_osc_reads_them(cursors: list[Cursor]) -> None:
    datagram = sent(cursors)
    decoded = decode(datagram)
    assert not isinstance(decoded, Malformed)
    assert [list(each.arguments) for each in decoded[0].messages] == [each.params for each in OracleBundle(datagram)]


@settings(deadline=None)
@given(st.one_of(st.binary(max_size=200), st.binary(max_size=200).map(b"#bundle\0\0\0\0\0\0\0\0\1".__add__)))
def test_random_bytes_are_bundles_or_are_told_where_they_fail(datagram: bytes) -> None:
    decoded = decode(datagram)
    if isinstance(decoded, Malformed):
        assert 0 <= decoded.offset <= len(datagram)
        assert decoded.problem


def mutated(datagram: bytes, seed: int) -> bytes:
    """Return the datagram with a few bytes changed, cut out or doubled."""
    chance = random.Random(seed)
    data = bytearray(datagram)
    for _ in range(chance.randrange(1, 4)):
        at = chance.randrange(len(data))
        how = chance.randrange(4)
        if how == 0:
            data[at] = chance.randrange(256)
        elif how == 1:
            data[at : at + 4 * chance.randrange(1, 5)] = b""
        elif how == 2:
            data[at:at] = data[at : at + 4 * chance.randrange(1, 5)]
        else:
            data[at // 4 * 4 : at // 4 * 4 + 4] = struct.pack(">f", chance.choice((math.nan, math.inf, -1.0, 3e38)))
        if not data:
            return b""
    return bytes(data)


@settings(deadline=None)
@given(st.lists(st.tuples(cursors, st.integers(0, 2**32)), max_size=6))
def test_the_checker_takes_damaged_bundles_without_an_exception(posts: list[tuple[list[Cursor], int]]) -> None:
    checker = Checker()
    for number, (live, seed) in enumerate(posts):
        datagram = mutated(sent(live), seed)
        notes = checker.feed(datagram, ADDRESS, number)
        told = [note for note in notes if isinstance(note, Finding) and note.rule.name == "malformed"]
        assert bool(told) == isinstance(decode(datagram), Malformed)
    checker.finish(len(posts))
    assert checker.datagrams == len(posts)


@settings(deadline=None)
@given(st.lists(st.binary(max_size=120), max_size=5))
def test_the_checker_takes_any_bytes_without_an_exception(datagrams: list[bytes]) -> None:
    checker = Checker()
    for number, datagram in enumerate(datagrams):
        for note in checker.feed(datagram, ADDRESS, number):
            if isinstance(note, Finding):
                assert note.sentence().isprintable()
    assert checker.datagrams == len(datagrams)


@settings(deadline=None)
@given(st.lists(st.integers(0, 60), min_size=1, max_size=25), st.integers(0, 2**32), st.sampled_from((800, 1472, 4096)))
def test_a_network_that_loses_and_reorders_makes_no_fault_of_touchds(counts: list[int], seed: int, limit: int) -> None:
    whole, *rest = run_of_touchd([60, *counts], limit)
    posts = [*whole, *through_a_bad_network([datagram for each in rest for datagram in each], random.Random(seed))]
    checker = Checker()
    notes = [note for index, post in enumerate(posts) for note in checker.feed(post, ADDRESS, index * 16_000_000)]
    notes += checker.finish(len(posts) * 16_000_000)
    assert [
        note.sentence() for note in notes if isinstance(note, Finding) and note.rule.severity is Severity.FAULT
    ] == []


@settings(deadline=None)
@given(st.lists(st.integers(0, 60), min_size=2, max_size=12), st.integers(0, 40), st.sampled_from((800, 1472, 4096)))
def test_joining_touchd_at_any_datagram_finds_nothing_wrong(counts: list[int], joined: int, limit: int) -> None:
    posts = [datagram for each in run_of_touchd(counts, limit) for datagram in each][joined:]
    checker = Checker()
    notes = [note for index, post in enumerate(posts) for note in checker.feed(post, ADDRESS, index * 16_000_000)]
    notes += checker.finish(len(posts) * 16_000_000)
    assert [note.sentence() for note in notes if isinstance(note, Finding) and note.rule != FLICKER] == []


def run_of_touchd(counts: list[int], limit: int) -> list[tuple[bytes, ...]]:
    """Return each frame's datagrams, the clears at the end as one of them."""
    encoder = TuioEncoder("touchd-a-b@c", 0, 1000)
    live: list[Cursor] = []
    born = 0
    sent = []
    for count in counts:
        live = live[max(0, len(live) - count) :]
        while len(live) < count:
            born += 1
            live.append(Cursor(born, born % 97 / 97, born % 89 / 89, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0))
        sent.append(encoder.next_frame(live).split(limit))
    return [*sent, encoder.next_frame(()).split(limit), (encoder.clear(),) * 3]


def through_a_bad_network(datagrams: list[bytes], chance: random.Random) -> list[bytes]:
    """Return them with 5 % lost, some doubled, and some held up behind the next few."""
    kept = [
        (place + chance.choice((0.0, 0.0, 0.0, 1.5, 3.5)), datagram)
        for place, datagram in enumerate(datagrams)
        if chance.random() > 0.05
        for _ in range(1 + (chance.random() < 0.02))
    ]
    return [datagram for _, datagram in sorted(kept, key=lambda each: each[0])]
