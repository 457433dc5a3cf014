import pytest
from touchd.listen.checker import Appeared, Checker

from clients.bad_senders import CURSOR, alive, bundle, frame, fseq, message, placed, source
from clients.listening import ADDRESS, ELSEWHERE, STILL, Listening, moving


@pytest.fixture
def heard() -> Listening:
    return Listening()


def test_a_sender_without_a_mistake_breaks_no_rule(heard: Listening) -> None:
    heard.hear(frame(-1), *moving(1, 50), frame(51), frame(-1))
    assert heard.broken() == []
    assert heard.seen[0] == "add 1"
    assert heard.seen[-1] == "remove 1"


def test_a_sender_is_told_once_by_name_and_address() -> None:
    checker = Checker()
    assert checker.feed(frame(1), ADDRESS, 1) == (Appeared("bad@table (127.0.0.1:40000)"),)
    assert checker.feed(frame(2), ADDRESS, 2) == ()


def test_letters_that_a_terminal_would_obey_are_not_printed() -> None:
    (note,) = Checker().feed(frame(1, name="\x1b[2J" + "x" * 100), ("::1", 5), 1)
    assert note == Appeared("?[2J" + "x" * 75 + "… ([::1]:5)")


# What the network does


def test_what_was_lost_is_counted_and_no_fault(heard: Listening) -> None:
    heard.hear(*moving(1, 10), frame(13, listed=[1, 2]), *moving(14, 20))
    assert heard.broken() == []
    assert heard.checker.totals()[0].lost == 2


def test_what_came_late_is_counted_and_no_fault(heard: Listening) -> None:
    posts = moving(1, 20)
    posts[7], posts[8], posts[12] = posts[8], posts[7], posts[13]
    heard.hear(*posts)
    assert heard.broken() == []
    assert (heard.checker.totals()[0].late, heard.checker.totals()[0].lost) == (1, 1)


def test_three_late_frames_in_a_row_are_no_restart(heard: Listening) -> None:
    heard.hear(*moving(1, 10), *moving(14, 14), *moving(11, 13), *moving(15, 20))
    assert heard.broken() == []
    assert (heard.checker.totals()[0].late, heard.checker.totals()[0].lost) == (3, 0)


def test_datagrams_that_the_network_doubles_are_no_fault(heard: Listening) -> None:
    heard.hear(*(copy for datagram in moving(1, 20) for copy in (datagram, datagram)))
    assert heard.broken() == []


def test_gaps_at_every_frame_are_the_senders_habit_and_excuse_nothing(heard: Listening) -> None:
    heard.hear(*(frame(number, STILL) for number in range(1, 40, 3)), frame(43, listed=[1, 2]))
    assert heard.broken() == ["phantom"]


def test_the_parts_of_a_growing_alive_may_come_in_any_order(heard: Listening) -> None:
    first = frame(2, {1: (0.1, 0.1)})
    second = frame(2, {2: (0.2, 0.2)}, listed=[1, 2])
    third = frame(2, {3: (0.3, 0.3)}, listed=[1, 2, 3])
    heard.hear(frame(1), third, first, second, frame(3, {i: (i / 10, i / 10) for i in (1, 2, 3)}))
    assert heard.broken() == []


# Frame numbers


def test_a_restart_far_below_is_advice_as_clients_accept_it(heard: Listening) -> None:
    heard.hear(*moving(900, 903), *moving(1, 10))
    assert heard.broken() == ["fseq-far-back"]
    assert heard.told("fseq-far-back") == "fseq went back from 903 to 1 and counts on from there"


def test_a_restart_just_below_from_another_port_is_a_fault(heard: Listening) -> None:
    heard.hear(*moving(1, 60))
    heard.hear(*moving(1, 5), address=ELSEWHERE)
    assert heard.broken() == ["fseq-back"]
    assert len(heard.checker.senders) == 1


def test_the_wrap_at_31_bits_is_no_step_back(heard: Listening) -> None:
    top = 2**31 - 1
    heard.hear(*(frame(number, {1: (0.5, 0.5)}) for number in (top - 1, top, 1, 2, 3)))
    assert heard.broken() == []
    assert heard.checker.totals()[0].lost == 0


def test_an_fseq_that_stands_still_is_advice(heard: Listening) -> None:
    heard.hear(*(frame(5, {1: (number / 10, 0.5)}) for number in range(9)))
    assert heard.broken() == ["fseq-stands"]
    assert heard.told("fseq-stands") == "fseq is 5 again in a new frame"


def test_a_negative_fseq_other_than_minus_one_is_advice(heard: Listening) -> None:
    heard.hear(frame(1), frame(-2))
    assert heard.broken() == ["fseq-negative"]


def test_news_in_a_bundle_marked_as_repetition_is_advice(heard: Listening) -> None:
    heard.hear(frame(1, STILL), frame(-1, STILL), frame(-1, {**STILL, 2: (0.1, 0.1)}), frame(2))
    assert heard.broken() == ["fseq-redundant-news"]
    assert heard.told("fseq-redundant-news") == "cursor 2 begins in a bundle with fseq -1"


def test_one_counter_for_two_profiles_is_no_fault_of_numbering(heard: Listening) -> None:
    objects = "/tuio/2Dobj"
    for number in range(1, 20, 2):
        heard.hear(frame(number))
        heard.hear(bundle(source(address=objects), alive(address=objects), fseq(number + 1, objects)))
    assert heard.broken() == ["mixed-profiles"]


def test_a_lost_frame_may_have_been_another_profiles(heard: Listening) -> None:
    def objects(number: int, *listed: int) -> bytes:
        address = "/tuio/2Dobj"
        return bundle(source(address=address), alive(*listed, address=address), fseq(number, address))

    heard.hear(frame(1), objects(2), frame(3), objects(4), frame(7), objects(8, 5))  # 6 was to set object 5
    assert heard.broken() == ["mixed-profiles"]


# Messages


@pytest.mark.parametrize(
    ("datagram", "rule", "found"),
    [
        (bundle(source(), fseq(1)), "no-alive", "the bundle of 2Dcur has no alive"),
        (bundle(source(), alive()), "no-fseq", "the bundle of 2Dcur has no fseq"),
        (bundle(alive(), fseq(1)), "no-source", "the bundle of 2Dcur has no source"),
        (bundle(source(), alive(), alive(), fseq(1)), "order", "alive stands twice in the bundle"),
        (bundle(alive(), source(), fseq(1)), "order", "source comes after alive"),
        (bundle(source(), alive(1), fseq(1), placed(1, 0.5, 0.5)), "order", "set comes after fseq"),
        (
            bundle(source(), alive(1, 1), placed(1, 0.5, 0.5), fseq(1)),
            "twice-alive",
            "cursor 1 is listed twice in alive",
        ),
        (
            bundle(source(), alive(), placed(4, 0.5, 0.5), fseq(1)),
            "not-alive",
            "cursor 4 is set but not listed in alive",
        ),
        (frame(1, {0: (0.5, 0.5)}), "low-id", "cursor 0 has a session id below 1"),
        (frame(1, {1: (1.5, 0.5)}), "out-of-range", "x of cursor 1 is 1.5, outside 0..1"),
        (frame(1, {1: (0.5, -0.01)}), "out-of-range", "y of cursor 1 is -0.01, outside 0..1"),
        (frame(1, {1: (float("inf"), 0.5)}), "not-finite", "x of cursor 1 is inf"),
        (
            bundle(source(), alive(), message(CURSOR, "s", "end"), fseq(1)),
            "unknown-word",
            "a message of 2Dcur begins with 'end'",
        ),
        (
            bundle(source(), alive(), message(CURSOR, ""), fseq(1)),
            "unknown-word",
            "a message of 2Dcur begins with no argument",
        ),
        (
            bundle(source(), alive(), message(CURSOR, "sf", "fseq", 1.0)),
            "types",
            "the argument of fseq is a float (f) in place of an int (i)",
        ),
        (bundle(source(), alive(), message(CURSOR, "s", "fseq")), "arguments", "fseq has 0 arguments in place of 1"),
        (
            bundle(message("/accelerometer", "f", 0.5)),
            "unknown-address",
            '"/accelerometer" is the address of no TUIO 1.1 profile',
        ),
        (bundle(source(), alive(), fseq(1), time_tag=2**32), "time-tag", "the bundle's time tag is 0x0000000100000000"),
        (bundle(), "empty-bundle", "a bundle has no messages"),
        (alive(1), "no-bundle", 'a message to "/tuio/2Dcur" is in no bundle'),
        (b"hello", "malformed", "byte 5 of 5: 5 bytes are no multiple of 4"),
    ],
)
def test_a_mistake_in_a_datagram_is_named(heard: Listening, datagram: bytes, rule: str, found: str) -> None:
    heard.hear(datagram)
    assert heard.broken() == [rule]
    assert heard.told(rule) == found


@pytest.mark.parametrize(
    ("profile", "floats", "ints"),
    [
        ("2Dobj", 8, 2), ("2Dcur", 5, 1), ("2Dblb", 11, 1), ("25Dobj", 10, 2), ("25Dcur", 7, 1), ("25Dblb", 13, 1),
        ("3Dobj", 14, 2), ("3Dcur", 7, 1), ("3Dblb", 18, 1),
    ],
)  # fmt: skip
def test_every_profile_is_held_to_its_own_arguments(heard: Listening, profile: str, floats: int, ints: int) -> None:
    address = f"/tuio/{profile}"
    right = message(address, "s" + "i" * ints + "f" * floats, "set", *[1] * ints, *[0.5] * floats)
    short = message(address, "s" + "i" * ints + "f" * (floats - 1), "set", *[1] * ints, *[0.5] * (floats - 1))
    heard.hear(bundle(source(address=address), alive(1, address=address), right, fseq(1, address)))
    assert heard.broken() == []
    heard.hear(bundle(source(address=address), alive(1, address=address), short, fseq(2, address)))
    assert heard.broken() == ["arguments"]


def air(number: int, z: float, *, rising: float = 0.0, x: float = 0.5) -> bytes:
    """Return a frame of 25Dcur with one fingertip at that height."""
    address = "/tuio/25Dcur"
    tip = message(address, "sifffffff", "set", 1, x, 0.5, z, 0.0, 0.0, rising, 0.0)
    return bundle(source(address=address), alive(1, address=address), tip, fseq(number, address))


def test_a_height_beyond_0_to_1_is_named(heard: Listening) -> None:
    heard.hear(air(1, 0.0))
    heard.hear(air(2, 1.0))
    assert heard.broken() == []
    heard.hear(air(3, 1.5))
    assert heard.broken() == ["out-of-range"]
    assert heard.told("out-of-range") == "z of cursor 1 is 1.5, outside 0..1"


def test_a_fingertip_that_rises_and_does_not_move_otherwise_has_no_stale_velocity(heard: Listening) -> None:
    for number in range(1, 31):
        heard.hear(air(number, number / 100.0, rising=0.3))
    assert heard.broken() == []
    for number in range(31, 61):
        heard.hear(air(number, 0.3, rising=0.3))
    assert heard.broken() == ["stale-velocity"]


def test_a_datagram_over_the_network_is_advised_to_fit_a_packet(heard: Listening) -> None:
    crowd = frame(1, dict.fromkeys(range(1, 31), (0.5, 0.5)))
    assert 1472 < len(crowd) < 4096
    heard.hear(crowd)
    assert heard.broken() == []
    heard.hear(frame(2, dict.fromkeys(range(1, 31), (0.5, 0.5))), address=("192.0.2.7", 5))
    assert "fragmented" in heard.broken()
