"""The same touches in real clients over real UDP as were published."""

import math
import random
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from touchd.model import Cursor, State, TouchFrame
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender

from clients.comparison import ClientLog, differences, learned_offset
from clients.harness import Client, OscDump, PythonTuio, oscdump_path
from clients.process_client import KivyTuio, NodeTuio, QtTouch

FRAME_NS = 33_333_333
OFFSET = 1_700_000


@pytest.fixture(params=[PythonTuio, OscDump, QtTouch, KivyTuio, NodeTuio])
def client(request: pytest.FixtureRequest) -> Iterator[Client]:
    with request.param() as running:
        yield running


def output_to(client: Client, offset: int = OFFSET) -> TuioUdpOutput:
    return TuioUdpOutput(TuioEncoder("touchd-test-main@127.0.0.1", offset, 1000), UdpSender([client.destination]))


def cursor(session_id: int, x: float, y: float) -> Cursor:
    return Cursor(session_id, x, y, 0.2, -0.1, 0.5, height_mm=4.0, area_mm2=60.0, angle=0.1)


def frame(index: int, *cursors: Cursor, state: State = State.TRACKING) -> TouchFrame:
    return TouchFrame(index, index * FRAME_NS, state, cursors)


def crowd(frames: int, most: int, seed: int) -> list[TouchFrame]:
    """Return frames in which cursors appear, move and leave at random; the last has none."""
    chance = random.Random(seed)
    live: dict[int, Cursor] = {}
    born, script = 0, []
    for index in range(frames - 1):
        live = {i: moved(c, chance) for i, c in live.items() if chance.random() > 0.03}
        for _ in range(min(most - len(live), chance.randrange(6))):
            born += 1
            live[born] = cursor(born, chance.random(), chance.random())
        script.append(frame(index, *live.values()))
    return [*script, frame(frames - 1)]


def moved(c: Cursor, chance: random.Random) -> Cursor:
    step = chance.choice((0.0, 0.02))  # some rest
    angle = chance.uniform(0.0, math.tau)
    x, y = c.x + step * math.cos(angle), c.y + step * math.sin(angle)
    return replace(c, x=min(max(x, 0.0), 1.0), y=min(max(y, 0.0), 1.0))


def play(output: TuioUdpOutput, client: Client, script: list[TouchFrame]) -> list[dict[str, Any]]:
    """Publish each frame when the client is done with the last, lest its socket's buffer overflow."""
    for each in script:
        output.publish(each, each.t_ns)
        client.sync()
    return [each.as_event() for each in script]


def test_a_crowd_of_sixty_is_seen_as_it_was_published(client: Client) -> None:
    script = crowd(frames=90, most=60, seed=11)
    assert max(len(each.cursors) for each in script) == 60
    output = output_to(client)
    output.start()
    events = play(output, client, script)
    output.close()
    client.sync()
    assert differences(client.log, events, OFFSET) == []
    assert client.log.left_over() == set()


def test_cursors_that_swap_in_one_frame_are_told_apart(client: Client) -> None:
    output = output_to(client)
    events = play(
        output,
        client,
        [
            frame(0, cursor(1, 0.1, 0.5), cursor(2, 0.9, 0.5)),
            frame(1, cursor(2, 0.1, 0.5), cursor(3, 0.9, 0.5)),
            frame(2),
        ],
    )
    output.close()
    client.sync()
    assert differences(client.log, events, learned_offset(client.log, events)) == []


def test_a_client_that_starts_late_learns_of_a_still_finger_where_it_is(client: Client) -> None:
    still = frame(0, cursor(1, 0.25, 0.75))
    encoder = TuioEncoder("a@b", OFFSET, 1000)
    for _ in range(10):
        encoder.next_frame(still.cursors)
    output = TuioUdpOutput(encoder, UdpSender([client.destination]))
    output.publish(still, 0)
    output.close()
    client.sync()
    assert differences(client.log, [still.as_event()], OFFSET) == []


def test_a_run_that_was_killed_leaves_nothing_behind_once_the_next_one_starts(client: Client) -> None:
    with UdpSender([client.destination]) as killed:
        TuioUdpOutput(TuioEncoder("a@b", OFFSET, 1000), killed).publish(frame(0, cursor(1, 0.2, 0.2)), 0)
    client.sync()
    assert client.log.left_over() == {OFFSET + 1}
    output = output_to(client, OFFSET + 500)
    output.start()
    client.sync()
    assert client.log.left_over() == set()
    output.close()
    client.sync()


def test_a_stalled_source_ends_the_touches_it_had(client: Client) -> None:
    output = output_to(client)
    events = play(
        output,
        client,
        [
            frame(0, cursor(1, 0.2, 0.2), cursor(2, 0.4, 0.4)),
            frame(1, state=State.NO_FRAMES),
            frame(2, cursor(3, 0.6, 0.6)),
        ],
    )
    assert client.log.left_over() == {OFFSET + 3}
    output.close()
    client.sync()
    assert differences(client.log, events, OFFSET) == []


def test_a_frame_cut_into_several_datagrams_presses_and_ends_nothing_of_its_own(client: Client) -> None:
    script = crowd(frames=40, most=60, seed=3)
    encoder = TuioEncoder("touchd-test-main@127.0.0.1", OFFSET, 1000)
    datagrams = 0
    with UdpSender([client.destination]) as sender:
        for each in script:
            for datagram in encoder.next_frame(each.cursors).split(700):
                sender.send_bytes(datagram, copies=1)
                datagrams += 1
            client.sync()
    assert datagrams > 2 * len(script)
    assert differences(client.log, [each.as_event() for each in script], OFFSET) == []


def test_oscdump_prints_explicit_types_and_real_zeros() -> None:
    with OscDump() as client:
        output = output_to(client)
        resting = Cursor(1, 0.0, 1.0, 0.0, -0.0, math.nan, height_mm=4.0, area_mm2=60.0, angle=0.0)
        output.publish(frame(0, resting), 0)
        client.sync()
        assert client.lines[:4] == [
            '/tuio/2Dcur ss "source" "touchd-test-main@127.0.0.1"',
            f'/tuio/2Dcur si "alive" {OFFSET + 1}',
            f'/tuio/2Dcur sifffff "set" {OFFSET + 1} 0.000000 1.000000 0.000000 0.000000 0.000000',
            '/tuio/2Dcur si "fseq" 1000',
        ]
        output.close()


def test_without_oscdump_its_tests_fail_in_ci_and_name_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="apt-get install liblo-tools"):
        oscdump_path()


def test_without_oscdump_its_tests_are_skipped_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match="apt-get install liblo-tools"):
        oscdump_path()


def test_the_comparison_names_every_way_to_differ() -> None:
    events = [frame(0, cursor(1, 0.1, 0.1), cursor(2, 0.2, 0.2), cursor(3, 0.3, 0.3)).as_event()]
    log = ClientLog(
        adds=[1, 2, 2, 9],
        moves={1: [(0.1, 0.1)], 2: [(0.0, 0.0), (0.2, 0.2)]},
        removes=[2, 9],
        faults=["Oh."],
    )
    assert differences(log, events, session_offset=0) == [
        "Oh.",
        "Cursor 2 was added 2 times.",
        "Cursor 3 was added 0 times.",
        "Cursor 9 was added but never published.",
        "Cursor 1 was removed 0 times.",
        "Cursor 3 was removed 0 times.",
        "Cursor 9 was removed but never published.",
        "Cursor 2 was published along [(0.2, 0.2)] but seen along [(0.0, 0.0), (0.2, 0.2)].",
    ]


@pytest.mark.parametrize(
    ("seen", "same"),
    [
        ([0.1, 0.2, 0.2, 0.3], True),
        ([0.1, 0.1, 0.2, 0.3, 0.3], True),
        ([0.1, 0.3], False),
        ([0.1, 0.2], False),
        ([0.1, 0.3, 0.2, 0.3], False),
        ([0.1, 0.2, 0.3, 0.4], False),
        ([0.1005, 0.2005, 0.3005], True),
        ([0.102, 0.2, 0.3], False),
    ],
)
def test_a_path_is_the_same_whoever_repeats_a_point(seen: list[float], same: bool) -> None:
    published = [frame(i, cursor(1, x, 0.5)).as_event() for i, x in enumerate((0.1, 0.2, 0.2, 0.3))]
    log = ClientLog(adds=[1], moves={1: [(x, 0.5) for x in seen]}, removes=[1])
    assert (differences(log, published, session_offset=0) == []) is same
