from collections.abc import Iterator

import pytest
from touchd.model import Cursor, Hover, State, TableObject, TouchFrame
from touchd.outputs.blobs import Blobs
from touchd.outputs.fingertips import Fingertips
from touchd.outputs.output import Output
from touchd.outputs.profiles import BLOB_2D, CURSOR_25D
from touchd.outputs.screen import Screen, ScreenMap
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender

from clients.bundles import Mailbox, read_bundle

SECOND_NS = 1_000_000_000
FRAME_NS = 33_333_333
CLEAR = ((), -1)
IDLE_STATES = [State.NO_FRAMES, State.PAUSED, State.NO_SURFACE, State.CALIBRATING]


@pytest.fixture
def box() -> Iterator[Mailbox]:
    with Mailbox() as opened:
        yield opened


@pytest.fixture
def output(box: Mailbox) -> Iterator[TuioUdpOutput]:
    made = TuioUdpOutput(TuioEncoder("touchd-test-main@127.0.0.1", 0, 100), UdpSender([box.destination]))
    yield made
    made.close()


def frame(*session_ids: int, state: State = State.TRACKING) -> TouchFrame:
    cursors = tuple(Cursor(i, 0.5, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0) for i in session_ids)
    return TouchFrame(0, 0, state, cursors)


def post(box: Mailbox) -> list[tuple[tuple[int, ...], int]]:
    """Return alive and fseq of each bundle that came, all of whose cursors are set."""
    bundles = [read_bundle(datagram) for datagram in box.take()]
    assert all(set(bundle.alive) == set(bundle.sets) for bundle in bundles)
    return [(bundle.alive, bundle.fseq) for bundle in bundles]


def test_start_clears_three_times_what_an_earlier_run_may_have_left(box: Mailbox, output: TuioUdpOutput) -> None:
    output.start()
    assert post(box) == [CLEAR] * 3


def test_each_frame_with_cursors_is_sent_and_three_without_lest_one_be_lost(
    box: Mailbox, output: TuioUdpOutput
) -> None:
    for index, ids in enumerate([(1,), (1,), (1, 2), (2,), (), (), (), (), ()]):
        output.publish(frame(*ids), index * FRAME_NS)
    assert post(box) == [
        *[((1,), 100), ((1,), 101), ((1, 2), 102), ((2,), 103)],
        *[((), 104), ((), 105), ((), 106)],
    ]


def test_an_idle_table_sends_an_empty_alive_once_a_second_with_rising_fseq(box: Mailbox, output: TuioUdpOutput) -> None:
    for index in range(61):  # two seconds at 30 frames a second
        output.publish(frame(), index * SECOND_NS // 30)
    assert post(box) == [((), 100), ((), 101), ((), 102)]


def test_without_frames_ticks_send_the_empty_alive(box: Mailbox, output: TuioUdpOutput) -> None:
    for tenth in range(25):
        output.tick(tenth * SECOND_NS // 10)
    assert post(box) == [((), 100), ((), 101), ((), 102)]


def test_a_tick_says_nothing_while_a_finger_is_down(box: Mailbox, output: TuioUdpOutput) -> None:
    output.publish(frame(1), 0)
    output.tick(10 * SECOND_NS)
    assert post(box) == [((1,), 100)]


def test_the_second_counts_from_whatever_was_sent_last(box: Mailbox, output: TuioUdpOutput) -> None:
    output.publish(frame(1), 0)
    output.publish(frame(), SECOND_NS // 2)
    output.tick(SECOND_NS)
    assert post(box) == [((1,), 100), ((), 101)]
    output.tick(SECOND_NS * 3 // 2)
    assert post(box) == [((), 102)]


@pytest.mark.parametrize("state", IDLE_STATES)
def test_a_state_without_tracking_removes_live_cursors_and_clears_three_times(
    box: Mailbox, output: TuioUdpOutput, state: State
) -> None:
    output.publish(frame(1, 2), 0)
    output.publish(frame(state=state), FRAME_NS)
    assert post(box) == [((1, 2), 100), ((), 101), CLEAR, CLEAR, CLEAR]


@pytest.mark.parametrize("state", IDLE_STATES)
def test_a_state_without_tracking_goes_on_with_the_sign_of_life(
    box: Mailbox, output: TuioUdpOutput, state: State
) -> None:
    for index in range(61):  # two seconds at 30 frames a second
        output.publish(frame(state=state), index * SECOND_NS // 30)
    output.publish(frame(7), 2 * SECOND_NS + FRAME_NS)
    assert post(box) == [((), 100), ((), 101), ((), 102), ((7,), 103)]


def test_cursors_of_a_state_without_tracking_are_not_sent(box: Mailbox, output: TuioUdpOutput) -> None:
    output.publish(frame(1, state=State.PAUSED), 0)
    assert post(box) == [((), 100)]
    output.publish(frame(1), FRAME_NS)
    output.publish(frame(1, state=State.PAUSED), 2 * FRAME_NS)
    assert post(box) == [((1,), 101), ((), 102), CLEAR, CLEAR, CLEAR]


def test_close_ends_live_cursors_as_a_frame_and_clears_three_times(box: Mailbox, output: TuioUdpOutput) -> None:
    output.publish(frame(1), 0)
    output.close()
    assert post(box) == [((1,), 100), ((), 101), CLEAR, CLEAR, CLEAR]
    assert output.last_fseq == 101


def test_after_the_close_nothing_is_sent_and_nothing_is_raised(box: Mailbox, output: TuioUdpOutput) -> None:
    output.close()
    box.take()
    output.publish(frame(1), 0)
    output.tick(10 * SECOND_NS)
    assert post(box) == []


def test_the_status_sums_up_all_destinations(box: Mailbox) -> None:
    with Mailbox() as gone:
        nobody = gone.destination
    output: Output = TuioUdpOutput(TuioEncoder("a@b", 0, 1), UdpSender([box.destination, nobody]))
    output.start()
    output.publish(frame(1), 0)
    status = output.status()
    output.close()
    assert status.name == f"tuio to {box.destination}, {nobody}"
    assert (status.sent, status.failed, status.dropped, status.last_error) == (8, 0, 0, None)
    output.publish(frame(1), 0)
    assert output.status().failed == 2
    assert output.status().last_error == f"Cannot send to {box.destination}: the output is closed."


def test_each_destination_tells_its_own_story(box: Mailbox, output: TuioUdpOutput) -> None:
    output.start()
    (told,) = output.destinations()
    assert (told.destination, told.sent, told.address) == (box.destination, 3, box.destination)


@pytest.fixture
def in_the_air(box: Mailbox) -> Iterator[TuioUdpOutput]:
    encoder = TuioEncoder("touchd-test-main@127.0.0.1", 0, 100, CURSOR_25D)
    made = TuioUdpOutput(encoder, UdpSender([box.destination]), Fingertips(Screen(), full_mm=40.0))
    yield made
    made.close()


def air(index: int, state: State = State.TRACKING, touch: bool = False, height_mm: float | None = None) -> TouchFrame:
    cursors = (Cursor(1, 0.5, 0.25, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0, hover_id=1),) if touch else ()
    hovers = () if height_mm is None else (Hover(1, 0.5, 0.25, height_mm),)
    return TouchFrame(index, index * FRAME_NS, state, cursors, hovers=hovers)


def test_a_fingertip_is_sent_from_the_air_to_the_surface_and_its_end_three_times(
    box: Mailbox, in_the_air: TuioUdpOutput
) -> None:
    shown = [air(0, height_mm=30.0), air(1, height_mm=10.0), air(2, touch=True), *(air(i) for i in range(3, 8))]
    for index, each in enumerate(shown):
        in_the_air.publish(each, index * FRAME_NS)
    bundles = [read_bundle(datagram, "25Dcur") for datagram in box.take()]
    assert [(bundle.alive, bundle.fseq) for bundle in bundles] == [
        *[((1,), 100), ((1,), 101), ((1,), 102)],
        *[((), 103), ((), 104), ((), 105)],
    ]
    assert [bundle.sets[1][2] for bundle in bundles[:3]] == [0.75, 0.25, 0.0]
    assert in_the_air.status().name == f"tuio 25Dcur to {box.destination}"


def test_a_pause_of_tracking_ends_hovers_for_good_and_start_and_stop_clear_the_profile(
    box: Mailbox, in_the_air: TuioUdpOutput
) -> None:
    in_the_air.start()
    in_the_air.publish(air(0, height_mm=30.0), 0)
    in_the_air.publish(air(1, State.NO_FRAMES), FRAME_NS)
    in_the_air.publish(air(2, height_mm=30.0), 2 * FRAME_NS)
    in_the_air.close()
    bundles = [read_bundle(datagram, "25Dcur") for datagram in box.take()]
    assert [(bundle.alive, bundle.fseq) for bundle in bundles] == [
        *[CLEAR] * 3,
        *[((1,), 100), ((), 101), CLEAR, CLEAR, CLEAR],
        *[((2,), 102), ((), 103), CLEAR, CLEAR, CLEAR],
    ]


def test_things_on_the_surface_are_sent_as_blobs_for_as_long_as_they_lie_there(box: Mailbox) -> None:
    phone = TableObject(3, ((0.25, 0.25), (0.75, 0.25), (0.75, 0.5), (0.25, 0.5)), 8.0)
    encoder = TuioEncoder("touchd-test-main@127.0.0.1", 0, 100, BLOB_2D)
    output = TuioUdpOutput(encoder, UdpSender([box.destination]), Blobs(ScreenMap(), max_blobs=60))
    for index in range(3):
        objects = (phone,) if index < 2 else ()
        output.publish(TouchFrame(index, index * FRAME_NS, State.TRACKING, objects=objects), index * FRAME_NS)
    output.close()
    bundles = [read_bundle(datagram, "2Dblb") for datagram in box.take()]
    assert [bundle.alive for bundle in bundles[:3]] == [(1,), (1,), ()]
    x, y, angle, width, height, area, *rates = bundles[1].sets[1]
    assert (x, y, angle, width, height, area) == (0.5, 0.375, 0.0, 0.5, 0.25, 0.125)
    assert rates == [0.0] * 5
