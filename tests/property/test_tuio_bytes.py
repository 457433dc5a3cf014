import math
import struct
from collections.abc import Sequence

from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from touchd.model import Cursor
from touchd.outputs.profiles import BLOB_2D, CURSOR_2D, CURSOR_25D, Profile
from touchd.outputs.things import AirCursor, Blob, Thing
from touchd.outputs.tuio import FSEQ_MAX, SESSION_ID_MAX, TuioEncoder, first_fseq, wire_session_id

from clients.bundles import Bundle, read_bundle

F32_MAX = struct.unpack(">f", b"\x7f\x7f\xff\xff")[0]
F32_MIN_NORMAL = struct.unpack(">f", b"\x00\x80\x00\x00")[0]
SMALLEST_LIMIT = 800  # holds a long source name, 60 ids and a cursor or blob

sources = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=255)
coordinates = st.one_of(st.floats(0.0, 1.0), st.floats(-0.1, 1.1), st.floats())
rates = st.one_of(st.floats(-5.0, 5.0), st.floats())
fseqs = st.one_of(st.integers(1, FSEQ_MAX), st.integers(FSEQ_MAX - 5, FSEQ_MAX))
offsets = st.one_of(st.integers(0, SESSION_ID_MAX - 1), st.integers(SESSION_ID_MAX - 70, SESSION_ID_MAX - 1))


def cursors_with(session_ids: st.SearchStrategy[int], most: int) -> st.SearchStrategy[list[Cursor]]:
    made = st.builds(
        Cursor,
        session_id=session_ids,
        x=coordinates,
        y=coordinates,
        vx=rates,
        vy=rates,
        accel=rates,
        height_mm=st.just(4.0),
        area_mm2=st.just(60.0),
        angle=st.just(0.0),
    )
    return st.lists(made, max_size=most, unique_by=lambda cursor: cursor.session_id)


ids = st.integers(1, SESSION_ID_MAX)
places, motions = [coordinates] * 2, [rates] * 2
fingertips = st.lists(
    st.builds(AirCursor, ids, *places, coordinates, *motions, rates, rates),
    max_size=30,
    unique_by=lambda a: a.session_id,
)
things_on_the_surface = st.lists(
    st.builds(Blob, ids, *places, rates, *[coordinates] * 3, *motions, rates, rates, rates),
    max_size=30,
    unique_by=lambda b: b.session_id,
)


def still(session_id: int) -> Cursor:
    return Cursor(session_id, 0.5, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0)


def still_one(profile: Profile, session_id: int) -> Thing:
    if profile is CURSOR_25D:
        return AirCursor(session_id, 0.5, 0.5, 0.25, 0.0, 0.0, 0.0, 0.0)
    if profile is BLOB_2D:
        return Blob(session_id, 0.5, 0.5, 0.0, 0.25, 0.25, 0.0625, 0.0, 0.0, 0.0, 0.0, 0.0)
    return still(session_id)


def expected_bytes(source: str, offset: int, fseq: int, things: Sequence[Thing], profile: str = "2Dcur") -> bytes:
    """Return the bundle as python-osc builds it, with every argument's type given."""
    seen = [c for c in sorted(things, key=lambda c: c.session_id) if math.isfinite(c.x + c.y)][:60]
    ids = [1 + (offset + c.session_id - 1) % (2**31 - 1) for c in seen]
    builder = OscBundleBuilder(IMMEDIATELY)
    address = f"/tuio/{profile}"
    add(builder, address, "ss", "source", source)
    add(builder, address, "s" + "i" * len(ids), "alive", *ids)
    for session_id, c in zip(ids, seen, strict=True):
        values = expected_values(c)
        add(builder, address, "si" + "f" * len(values), "set", session_id, *map(plain, values))
    add(builder, address, "si", "fseq", fseq)
    dgram: bytes = builder.build().dgram
    return dgram


def expected_values(c: Thing) -> tuple[float, ...]:
    """Return the floats of a set in the order of the specification."""
    match c:
        case Cursor():
            return share(c.x), share(c.y), c.vx, c.vy, c.accel
        case AirCursor():
            return share(c.x), share(c.y), share(c.z), c.vx, c.vy, c.vz, c.accel
        case Blob():
            size = share(c.width), share(c.height), share(c.area)
            return share(c.x), share(c.y), c.angle, *size, c.vx, c.vy, c.turn, c.accel, c.turn_accel


def share(value: float) -> float:
    return 0.0 if math.isnan(value) else min(max(value, 0.0), 1.0)


def add(builder: OscBundleBuilder, address: str, types: str, *arguments: str | float) -> None:
    message = OscMessageBuilder(address)
    for kind, argument in zip(types, arguments, strict=True):
        message.add_arg(argument, kind)
    builder.add_content(message.build())


def plain(value: float) -> float:
    return value if F32_MIN_NORMAL <= abs(value) <= F32_MAX else 0.0


@settings(deadline=None)
@given(sources, offsets, fseqs, cursors_with(st.integers(1, SESSION_ID_MAX), most=70))
def test_the_bytes_are_those_of_an_independent_encoder(
    source: str, offset: int, fseq: int, cursors: list[Cursor]
) -> None:
    (datagram,) = TuioEncoder(source, offset, fseq).next_frame(cursors).split(4096)
    assert datagram == expected_bytes(source, offset, fseq, cursors)


@settings(deadline=None)
@given(sources, offsets, fseqs, fingertips)
def test_the_bytes_of_fingertips_are_those_of_an_independent_encoder(
    source: str, offset: int, fseq: int, cursors: list[AirCursor]
) -> None:
    (datagram,) = TuioEncoder(source, offset, fseq, CURSOR_25D).next_frame(cursors).split(4096)
    assert datagram == expected_bytes(source, offset, fseq, cursors, "25Dcur")


@settings(deadline=None)
@given(sources, offsets, fseqs, things_on_the_surface)
def test_the_bytes_of_blobs_are_those_of_an_independent_encoder(
    source: str, offset: int, fseq: int, blobs: list[Blob]
) -> None:
    (datagram,) = TuioEncoder(source, offset, fseq, BLOB_2D).next_frame(blobs).split(4096)
    assert datagram == expected_bytes(source, offset, fseq, blobs, "2Dblb")


@settings(deadline=None)
@given(cursors_with(st.integers(1, SESSION_ID_MAX), most=70))
def test_every_number_sent_is_finite_and_every_coordinate_in_the_area(cursors: list[Cursor]) -> None:
    (datagram,) = TuioEncoder("a@b", 0, 1).next_frame(cursors).split(4096)
    for values in read_bundle(datagram).sets.values():
        assert all(math.isfinite(value) for value in values)
        assert all(math.copysign(1.0, value) == 1.0 for value in values if value == 0.0)
        assert all(0.0 <= value <= 1.0 for value in values[:2])


crowds = st.lists(st.sets(st.integers(1, 90), max_size=75), min_size=1, max_size=5)
limits = st.integers(SMALLEST_LIMIT, 4096)


profiles = st.sampled_from([CURSOR_2D, CURSOR_25D, BLOB_2D])


@settings(deadline=None)
@given(profiles, sources, fseqs, crowds, limits)
def test_a_cut_frame_keeps_the_limit_and_sets_each_thing_once_under_one_fseq(
    profile: Profile, source: str, fseq: int, crowds: list[set[int]], limit: int
) -> None:
    encoder = TuioEncoder(source, 0, fseq, profile)
    for crowd in crowds:
        frame = encoder.next_frame([still_one(profile, i) for i in crowd])
        datagrams = frame.split(limit)
        assert max(map(len, datagrams)) <= limit
        bundles = [read_bundle(datagram, profile.name) for datagram in datagrams]
        assert [i for bundle in bundles for i in bundle.sets] == sorted(crowd)[:60]
        assert {bundle.fseq for bundle in bundles} == {frame.fseq}
        assert {bundle.source for bundle in bundles} == {source}


@settings(deadline=None)
@given(profiles, crowds, limits)
def test_each_datagram_lists_the_old_things_and_those_set_so_far(
    profile: Profile, crowds: list[set[int]], limit: int
) -> None:
    encoder = TuioEncoder("a@b", 0, 1, profile)
    before: set[int] = set()
    for crowd in crowds:
        now = set(sorted(crowd)[:60])
        so_far = before & now
        frame = encoder.next_frame([still_one(profile, i) for i in crowd])
        bundles = [read_bundle(datagram, profile.name) for datagram in frame.split(limit)]
        for bundle in bundles:
            so_far |= set(bundle.sets)
            assert list(bundle.alive) == sorted(so_far)
        assert set(bundles[-1].alive) == now
        before = now


class TextbookClient:
    """Believes every bundle: what is alive is there, what is not has left."""

    def __init__(self) -> None:
        self.live: set[int] = set()
        self.pressed: list[int] = []

    def take(self, bundle: Bundle) -> None:
        new = set(bundle.alive) - self.live
        assert new <= set(bundle.sets), "a press at (0, 0)"
        self.pressed += sorted(new)
        self.live = set(bundle.alive)


@settings(deadline=None)
@given(st.lists(st.sets(st.integers(0, 75), max_size=60), min_size=1, max_size=5), limits)
def test_a_client_presses_each_cursor_once_however_frames_are_cut(crowds: list[set[int]], limit: int) -> None:
    encoder, client = TuioEncoder("a@b", 0, 1), TextbookClient()
    expected: list[int] = []
    before: set[int] = set()
    for crowd in crowds:
        now = {i + 1 for i in crowd}
        expected += sorted(now - before)
        for datagram in encoder.next_frame([still(i) for i in now]).split(limit):
            client.take(read_bundle(datagram))
        assert client.live == now
        before = now
    assert client.pressed == expected


@settings(deadline=None)
@given(fseqs, st.integers(1, 20))
def test_fseq_rises_by_one_and_is_never_zero_or_negative(first: int, frames: int) -> None:
    encoder = TuioEncoder("a@b", 0, first)
    numbers = [read_bundle(encoder.next_frame([]).split(1472)[0]).fseq for _ in range(frames)]
    assert numbers == [(first - 1 + step) % FSEQ_MAX + 1 for step in range(frames)]
    assert min(numbers) >= 1


@settings(deadline=None)
@given(st.floats(0.0, 1e10), st.one_of(st.just(0), fseqs))
def test_no_client_takes_the_first_frame_of_a_run_for_a_late_one(unix_time_s: float, stored: int) -> None:
    first = first_fseq(unix_time_s, stored)
    assert 1 <= first <= FSEQ_MAX
    assert stored == 0 or not 0 <= stored - first <= 100  # what real clients drop


@settings(deadline=None)
@given(offsets, st.sets(st.integers(1, SESSION_ID_MAX), max_size=20))
def test_session_ids_stay_apart_and_in_range(offset: int, session_ids: set[int]) -> None:
    on_the_wire = {wire_session_id(offset, i) for i in session_ids}
    assert len(on_the_wire) == len(session_ids)
    assert all(1 <= i <= SESSION_ID_MAX for i in on_the_wire)
