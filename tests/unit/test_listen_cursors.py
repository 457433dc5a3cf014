import pytest

from clients.bad_senders import alive, bundle, frame, fseq, placed, source
from clients.listening import ADDRESS, ELSEWHERE, STILL, Listening, moving


@pytest.fixture
def heard() -> Listening:
    return Listening()


def test_a_cursor_from_before_that_is_never_set_is_advice(heard: Listening) -> None:
    heard.hear(frame(1, listed=[7]), frame(2, listed=[7]), frame(3))
    assert heard.broken() == ["late-joiner"]


def test_joining_in_the_middle_of_a_split_frame_is_no_mistake_of_the_sender(heard: Listening) -> None:
    both = {1: (0.1, 0.1), 2: (0.2, 0.2)}
    heard.hear(frame(1, {2: (0.2, 0.2)}, listed=[1, 2]), frame(2, both), frame(3, both))
    assert heard.broken() == []


def test_a_sender_of_changes_alone_is_advised_once_it_is_a_habit(heard: Listening) -> None:
    heard.hear(frame(1), frame(2, STILL), frame(3, listed=[1]), frame(4, listed=[1]))
    heard.take(heard.checker.finish(heard.t_ns))
    assert heard.findings == []
    heard.hear(frame(5, listed=[1]), frame(6))
    assert heard.broken() == ["changes-only"]


def test_a_session_id_that_comes_again_is_advice(heard: Listening) -> None:
    heard.hear(frame(1, STILL), frame(2), frame(3), frame(4), frame(5), frame(6, STILL), frame(7))
    assert heard.broken() == ["reused-id"]
    assert heard.told("reused-id") == "cursor 1 begins again after its end"


@pytest.mark.parametrize("absent", [0, 1, 2])
def test_a_cursor_that_flickers_is_advice(heard: Listening, absent: int) -> None:
    heard.hear(frame(1, STILL), *(frame(2 + i) for i in range(absent)), frame(2 + absent, {2: (0.505, 0.5)}))
    assert heard.broken() == ["flicker"]
    assert heard.told("flicker") == "cursor 1 ended and began again as 2 at the same place"


def test_a_second_tap_at_the_same_place_is_no_flicker(heard: Listening) -> None:
    heard.hear(frame(1, STILL), *(frame(2 + i) for i in range(3)), frame(5, {2: (0.5, 0.5)}))
    assert heard.broken() == []


def test_cursors_that_swap_places_do_not_flicker(heard: Listening) -> None:
    heard.hear(frame(1, {1: (0.1, 0.5), 2: (0.9, 0.5)}), frame(2, {2: (0.1, 0.5), 1: (0.9, 0.5)}))
    assert heard.broken() == []


def at_rest(number: int, speed: float) -> bytes:
    return bundle(source(), alive(1), placed(1, 0.5, 0.5, speed), fseq(number))


def test_a_velocity_that_a_resting_finger_keeps_is_advice(heard: Listening) -> None:
    heard.hear(*(at_rest(number, 0.25) for number in range(1, 40)))
    assert heard.broken() == ["stale-velocity"]
    assert heard.told("stale-velocity") == "cursor 1 has rested for 0.5 s with a velocity of 0.25"


def test_a_velocity_that_fades_out_is_right(heard: Listening) -> None:
    heard.hear(*(at_rest(number, 0.25 if number < 20 else 0.0) for number in range(1, 60)))
    assert heard.broken() == []


# Silence


def test_a_steady_sender_that_falls_silent_has_stalled(heard: Listening) -> None:
    heard.hear(*(frame(number, STILL) for number in range(1, 10)))
    heard.wait(2.0)
    heard.hear(frame(10, STILL), frame(11))
    assert heard.broken() == ["stalled"]
    assert heard.told("stalled") == "nothing came for 2.0 s, with 1 cursor alive"


def test_the_silence_of_a_sender_of_changes_is_advice(heard: Listening) -> None:
    heard.hear(*moving(1, 9))
    heard.wait(2.0)
    heard.hear(*moving(10, 12), frame(13))
    assert heard.broken() == ["silent"]


def test_a_silence_of_lost_datagrams_is_no_fault(heard: Listening) -> None:
    heard.hear(*(frame(number, STILL) for number in range(1, 10)))
    heard.wait(2.0)
    heard.hear(frame(130, STILL), frame(131))
    assert heard.broken() == []


@pytest.mark.parametrize("address", [ADDRESS, ELSEWHERE])
def test_a_sender_that_was_killed_and_comes_back_with_a_clear_is_no_fault(
    heard: Listening, address: tuple[str, int]
) -> None:
    heard.hear(*(frame(number, STILL) for number in range(1, 10)))
    heard.wait(5.0)
    heard.hear(frame(-1), frame(700), frame(701, {2: (0.5, 0.5)}), frame(702), address=address)
    assert heard.broken() == []


def test_a_new_run_from_another_port_is_no_stall(heard: Listening) -> None:
    heard.hear(*(frame(number, STILL) for number in range(1, 10)))
    heard.wait(5.0)
    heard.hear(frame(10), frame(11), address=ELSEWHERE)
    assert heard.broken() == []


def test_a_sender_that_is_gone_with_its_touches_at_the_end_leaves_them_stuck(heard: Listening) -> None:
    heard.hear(*moving(1, 9))
    heard.wait(3.0)
    assert heard.broken() == ["stuck"]
    assert heard.told("stuck") == "nothing came in the last 3.0 s, with 1 cursor alive"


def test_listening_may_end_in_the_middle_of_a_touch(heard: Listening) -> None:
    heard.hear(*moving(1, 9))
    heard.wait(0.9)
    assert heard.broken() == []


def test_idle_senders_may_be_silent(heard: Listening) -> None:
    heard.hear(*moving(1, 9), frame(10))
    heard.wait(60.0)
    heard.hear(frame(11))
    heard.wait(60.0)
    assert heard.broken() == []


# Neighbours


def test_a_sender_with_a_socket_for_each_datagram_is_one_sender(heard: Listening) -> None:
    for number in range(1, 50):
        heard.hear(frame(number, {1: (number / 100, 0.5)}), address=("127.0.0.1", 40_000 + number))
    heard.hear(frame(50))
    assert heard.broken() == []
    assert len(heard.checker.senders) == 1


def test_two_idle_senders_at_one_port_are_advice(heard: Listening) -> None:
    for number in range(1, 5):
        heard.hear(frame(number, name="one@a"))
        heard.hear(frame(number, name="two@b"), address=ELSEWHERE)
    assert heard.broken() == ["shared-port"]


def test_two_senders_of_one_name_on_one_computer_are_a_fault(heard: Listening) -> None:
    for number in range(1, 5):
        heard.hear(frame(number))
        heard.hear(frame(500 + number), address=ELSEWHERE)
    assert heard.broken() == ["same-name"]
    assert heard.told("same-name") == "127.0.0.1:40000 sends under the same name"


def test_a_sender_under_another_name_that_takes_over_is_no_neighbour(heard: Listening) -> None:
    heard.hear(*moving(1, 5), frame(6))
    heard.hear(frame(1, name="two@b"), frame(2, name="two@b"), address=ELSEWHERE)
    assert heard.broken() == []


def test_bundles_without_a_source_are_of_whoever_sent_from_there_before(heard: Listening) -> None:
    heard.hear(frame(1), bundle(alive(), fseq(2)), b"junk!", frame(3))
    assert [sender.name for sender in heard.checker.senders] == ["bad@table"]


def test_a_sender_that_changes_its_name_with_each_datagram_does_not_fill_the_memory(heard: Listening) -> None:
    for number in range(300):
        heard.hear(frame(number + 1, name=f"name{number}@a"))
    assert len(heard.checker.senders) == 100
