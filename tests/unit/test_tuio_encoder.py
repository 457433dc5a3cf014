import math

import pytest
from touchd.errors import OutputError
from touchd.model import Cursor
from touchd.outputs.profiles import MAX_CURSORS
from touchd.outputs.tuio import (
    FSEQ_MAX,
    SESSION_ID_MAX,
    TuioEncoder,
    default_source,
    first_fseq,
    session_offset,
    wire_session_id,
)

from clients.bundles import read_bundle

SOURCE = "touchd-cave-main@10.0.0.5"
NOW_S = 1_790_000_000.0
CLOCK_WRAPS_S = 90 * 2**31 / 100  # the clock's fseq is 0 then, in the year 2031
DAY_S = 86_400.0


def encoder(offset: int = 0, fseq: int = 1000) -> TuioEncoder:
    return TuioEncoder(SOURCE, offset, fseq)


def cursor(session_id: int, x: float = 0.5, y: float = 0.25, vx: float = 0.0) -> Cursor:
    return Cursor(session_id, x, y, vx, -0.5, 2.0, height_mm=4.0, area_mm2=60.0, angle=0.1)


def crowd(count: int, first: int = 1) -> list[Cursor]:
    return [cursor(i) for i in range(first, first + count)]


def test_a_frame_has_source_alive_a_set_for_every_cursor_and_fseq() -> None:
    (datagram,) = encoder().next_frame([cursor(1), cursor(2, x=0.75)]).split(4096)
    bundle = read_bundle(datagram)
    assert bundle.source == SOURCE
    assert bundle.alive == (1, 2)
    assert bundle.sets == {1: (0.5, 0.25, 0.0, -0.5, 2.0), 2: (0.75, 0.25, 0.0, -0.5, 2.0)}
    assert bundle.fseq == 1000


def test_a_cursor_that_rests_is_set_again_in_every_frame() -> None:
    tuio = encoder()
    frames = [tuio.next_frame([cursor(7)]) for _ in range(3)]
    assert [list(read_bundle(frame.split(4096)[0]).sets) for frame in frames] == [[7], [7], [7]]


def test_a_frame_without_cursors_is_an_empty_alive() -> None:
    (datagram,) = encoder().next_frame([]).split(1472)
    bundle = read_bundle(datagram)
    assert (bundle.alive, bundle.sets) == ((), {})


def test_fseq_rises_by_one_a_frame_however_often_a_frame_is_cut() -> None:
    tuio = encoder(fseq=41)
    first, second = tuio.next_frame(crowd(60)), tuio.next_frame([])
    for limit in (4096, 1472, 4096):
        assert {read_bundle(datagram).fseq for datagram in first.split(limit)} == {41}
    assert read_bundle(second.split(4096)[0]).fseq == 42
    assert tuio.last_fseq == 42


def test_fseq_goes_from_its_greatest_value_to_one() -> None:
    tuio = encoder(fseq=FSEQ_MAX - 1)
    assert [tuio.next_frame([]).fseq for _ in range(4)] == [FSEQ_MAX - 1, FSEQ_MAX, 1, 2]


def test_the_value_to_keep_before_the_first_frame_is_the_one_before_it() -> None:
    assert encoder(fseq=500).last_fseq == 499
    assert encoder(fseq=1).last_fseq == FSEQ_MAX


def test_clear_is_an_empty_bundle_with_fseq_minus_one_and_takes_no_number() -> None:
    tuio = encoder(fseq=5)
    bundle = read_bundle(tuio.clear())
    assert (bundle.source, bundle.alive, bundle.sets, bundle.fseq) == (SOURCE, (), {}, -1)
    assert tuio.next_frame([]).fseq == 5


def test_after_a_clear_no_cursor_counts_as_known() -> None:
    tuio = encoder()
    tuio.next_frame(crowd(60))
    tuio.clear()
    first = read_bundle(tuio.next_frame(crowd(60)).split(1472)[0])
    assert set(first.alive) == set(first.sets)


def test_the_offset_of_the_run_is_added_to_session_ids() -> None:
    frame = encoder(offset=900).next_frame([cursor(1), cursor(5)])
    assert frame.session_ids == (901, 905)


def test_session_ids_on_the_wire_come_round_to_one_and_stay_below_two_to_the_31() -> None:
    assert wire_session_id(0, 1) == 1
    assert wire_session_id(SESSION_ID_MAX - 1, 1) == SESSION_ID_MAX
    assert wire_session_id(SESSION_ID_MAX - 1, 2) == 1
    assert wire_session_id(SESSION_ID_MAX - 1, SESSION_ID_MAX) == SESSION_ID_MAX - 1


@pytest.mark.parametrize("count", [61, 64, 300])
def test_of_more_than_sixty_cursors_the_oldest_stay_whatever_their_order(count: int) -> None:
    frame = encoder().next_frame(crowd(count)[::-1])
    assert set(frame.session_ids) == set(range(1, MAX_CURSORS + 1))


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
def test_a_cursor_that_is_nowhere_is_left_out(x: float) -> None:
    frame = encoder().next_frame([cursor(1, x=x), cursor(2, y=x), cursor(3)])
    bundle = read_bundle(frame.split(4096)[0])
    assert bundle.alive == (3,)
    assert set(bundle.sets) == {3}


def test_a_cursor_that_is_nowhere_takes_no_place_of_the_sixty() -> None:
    frame = encoder().next_frame([cursor(1, x=math.nan), *crowd(60, first=2)])
    assert frame.session_ids == tuple(range(2, 62))


@pytest.mark.parametrize(("x", "sent"), [(-0.004, 0.0), (1.004, 1.0), (1e300, 1.0), (0.0, 0.0), (1.0, 1.0), (0.5, 0.5)])
def test_coordinates_are_clamped_to_the_area(x: float, sent: float) -> None:
    bundle = read_bundle(encoder().next_frame([cursor(1, x=x)]).split(4096)[0])
    assert bundle.sets[1][0] == sent


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e39, -1e39, 0.0, -0.0, -1e-60, 1e-40])
def test_what_float32_has_no_plain_number_for_is_sent_as_plus_zero(value: float) -> None:
    (datagram,) = encoder().next_frame([cursor(1, vx=value)]).split(4096)
    sent = read_bundle(datagram).sets[1][2]
    assert (sent, math.copysign(1.0, sent)) == (0.0, 1.0)


def test_minus_zero_as_a_coordinate_is_sent_as_plus_zero() -> None:
    sent = read_bundle(encoder().next_frame([cursor(1, x=-0.0, y=-1e-60)]).split(4096)[0]).sets[1]
    assert [math.copysign(1.0, value) for value in sent[:2]] == [1.0, 1.0]


def test_sixty_cursors_fit_one_loopback_datagram_even_with_the_longest_source_name() -> None:
    frame = TuioEncoder("n" * 255, 0, 1).next_frame(crowd(60))
    assert [len(datagram) for datagram in frame.split(4096)] == [4020]


def test_cutting_a_frame_again_for_the_same_limit_returns_the_same_datagrams() -> None:
    frame = encoder().next_frame(crowd(60))
    assert frame.split(1472) is frame.split(1472)


def test_a_frame_of_new_cursors_grows_its_alive_from_datagram_to_datagram() -> None:
    bundles = [read_bundle(datagram) for datagram in encoder().next_frame(crowd(60)).split(1472)]
    so_far: list[int] = []
    for bundle in bundles:
        so_far += bundle.sets
        assert bundle.alive == tuple(so_far)
    assert so_far == list(range(1, 61))
    assert len(bundles) == 4


def test_old_cursors_are_alive_from_the_first_datagram_on_and_left_ones_in_none() -> None:
    tuio = encoder()
    tuio.next_frame(crowd(40))
    bundles = [read_bundle(d) for d in tuio.next_frame(crowd(60, first=11)).split(1472)]
    old, new, left = set(range(11, 41)), set(range(41, 71)), set(range(1, 11))
    assert len(bundles) > 1
    for bundle in bundles:
        assert old <= set(bundle.alive)
        assert not left & set(bundle.alive)
    assert set(bundles[-1].alive) == old | new


def test_a_limit_that_not_even_one_cursor_fits_is_refused() -> None:
    with pytest.raises(ValueError, match="A TUIO bundle does not fit a datagram of 100 bytes; allow more"):
        encoder().next_frame([cursor(1)]).split(100)


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("", "The TUIO source name '' is empty or has other than printable ASCII characters; "),
        ("tisch-küche@1", "The TUIO source name 'tisch-küche@1' is empty or has other than printable ASCII"),
        ("a\0b", "The TUIO source name 'a\\x00b' is empty or has other than printable ASCII"),
        ("n" * 256, "The TUIO source name 'nnnnnnnnnnnnnnnnnnnn'… has 256 characters; give it at most 255."),
    ],
)
def test_a_source_name_that_is_no_osc_string_is_refused(source: str, complaint: str) -> None:
    with pytest.raises(OutputError) as refused:
        TuioEncoder(source, 0, 1)
    assert str(refused.value).startswith(complaint)


def test_the_default_source_tells_host_instance_and_address() -> None:
    assert default_source("cave", "left", "10.0.0.5") == "touchd-cave-left@10.0.0.5"


def test_the_default_source_has_one_at_sign_and_only_printable_ascii() -> None:
    assert default_source("my box", "a@b", "küche") == "touchd-my-box-a-b@k-che"


def test_daemons_on_one_host_have_different_names_before_the_at_sign() -> None:
    names = {default_source("cave", instance, "10.0.0.5").partition("@")[0] for instance in ("left", "right")}
    assert len(names) == 2


def test_fseq_starts_from_the_clock_when_nothing_was_kept() -> None:
    assert first_fseq(NOW_S, 0) == int(NOW_S * 100) % 2**31


def test_fseq_starts_from_the_clock_when_it_is_ahead_of_what_was_kept() -> None:
    earlier = first_fseq(NOW_S, 0)
    assert first_fseq(NOW_S + 3600.0, earlier + 3600 * 30) == earlier + 360_000


def test_fseq_starts_after_the_kept_value_when_the_clock_is_behind_it() -> None:
    kept = first_fseq(NOW_S, 0)
    assert first_fseq(NOW_S - 3600.0, kept) == kept + 1


def test_fseq_starts_after_the_kept_value_when_the_clock_was_never_set() -> None:
    assert first_fseq(12.5, 2_000_000_000) == 2_000_000_001
    assert first_fseq(12.5, 900) == 1250
    assert first_fseq(12.5, 0) == 1250
    assert first_fseq(0.0, 0) == 1
    assert first_fseq(0.0, FSEQ_MAX) == 1


def test_fseq_follows_the_clock_over_its_wrap() -> None:
    before = first_fseq(CLOCK_WRAPS_S - 1.0, 0)
    assert before == 2**31 - 100
    assert first_fseq(CLOCK_WRAPS_S, before) == 1
    assert first_fseq(CLOCK_WRAPS_S + 10.0, before) == 1000


def test_a_later_run_has_session_ids_beyond_all_that_an_earlier_one_can_have_used() -> None:
    an_hour_of_busy_hands = 3600 * 60
    first, second = session_offset(NOW_S), session_offset(NOW_S + 3600.0)
    assert wire_session_id(first, an_hour_of_busy_hands) < wire_session_id(second, 1)


def test_session_offsets_stay_in_range() -> None:
    assert all(0 <= session_offset(NOW_S + day * DAY_S) < SESSION_ID_MAX for day in range(400))
