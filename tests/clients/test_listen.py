"""`touchd listen` over real UDP: it names every bad sender's mistake, and finds nothing wrong with touchd's own."""

import json
import random
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from types import TracebackType
from typing import Self

import pytest
from touchd.errors import ExitCode, UsageError
from touchd.listen.listener import Listener, PortInUse
from touchd.listen.monitor import ListenOptions, monitor
from touchd.listen.report import Verdict
from touchd.listen.sender import shown
from touchd.model import Cursor, State, TouchFrame
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender

from clients.bad_senders import SENTENCES, BadSender, Post, frame

PATIENCE_S = 30.0
FRAME_NS = 16_666_667
SECOND_NS = 1_000_000_000
MTU = 1472


class Monitor:
    """The monitor on a thread of its own, at a free port of loopback."""

    def __init__(self, frames: int | None = None, seconds: float | None = None, moves: bool = False) -> None:
        self.lines: list[str] = []
        self._options = ListenOptions(0, "127.0.0.1", frames=frames, seconds=seconds, moves=moves)
        self._listens = threading.Event()
        self._stop = threading.Event()
        self._verdict: Verdict | None = None
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._listens.wait(PATIENCE_S)
        self.port = int(self.lines[0].split()[4])
        self.destination = f"127.0.0.1:{self.port}"
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._thread.join(PATIENCE_S)

    def stopped(self) -> Verdict:
        """Stop it after all that was sent before, and return what it found."""
        self._stop.set()
        return self.ended()

    def ended(self) -> Verdict:
        """Return what it found once it has ended by itself."""
        self._thread.join(PATIENCE_S)
        assert self._verdict is not None
        return self._verdict

    def _run(self) -> None:
        self._verdict = monitor(self._options, self._say, self._stop)

    def _say(self, line: str) -> None:
        self.lines.append(line)
        self._listens.set()


@pytest.fixture
def listening() -> Iterator[Monitor]:
    with Monitor() as running:
        yield running


def send(posts: list[Post], port: int) -> dict[str, str]:
    """Send every post from a socket of its address, and return the full address of each."""
    with ExitStack() as opened:
        sockets: dict[str, socket.socket] = {}
        for post in posts:
            if post.host not in sockets:
                sockets[post.host] = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
                sockets[post.host].bind((post.host, 0))
            sockets[post.host].sendto(post.datagram, ("127.0.0.1", port))
        return {host: f"{host}:{each.getsockname()[1]}" for host, each in sockets.items()}


def said(verdict: Verdict) -> list[str]:
    return [entry.first.sentence() for entry in verdict.broken]


@pytest.mark.parametrize("bad_sender", SENTENCES, ids=lambda each: each.__name__)
def test_the_mistake_of_every_bad_sender_is_named_in_words(bad_sender: BadSender, listening: Monitor) -> None:
    rule, sentence = SENTENCES[bad_sender]
    addresses = send(bad_sender(), listening.port)
    verdict = listening.stopped()
    assert verdict.exit_code == ExitCode.BAD_DATA
    first = next(entry.first for entry in verdict.broken if entry.first.rule.name == rule)
    other = next((each for each in addresses.values() if each != first.address), "")
    assert first.sentence() == f"{first.name} ({first.address})" + sentence.replace("OTHER", other)
    assert first.address in addresses.values()
    assert rule in "\n".join(verdict.lines())


# What clients suffer from as well: the second profile itself.
ALSO = {"a_counter_for_each_profile": {"mixed-profiles"}}


@pytest.mark.parametrize("bad_sender", SENTENCES, ids=lambda each: each.__name__)
def test_no_other_fault_is_laid_to_a_sender_with_one_mistake(bad_sender: BadSender, listening: Monitor) -> None:
    rule, _ = SENTENCES[bad_sender]
    send(bad_sender(), listening.port)
    verdict = listening.stopped()
    assert {entry.first.rule.name for entry in verdict.broken} == {rule} | ALSO.get(bad_sender.__name__, set())


def crowds(counts: list[int], first_index: int = 0) -> list[TouchFrame]:
    """Return a frame for each count of moving cursors: the oldest leave, and who comes has a new session id."""
    live: list[int] = []
    born = 100 * first_index
    frames = []
    for index, count in enumerate(counts, first_index):
        live = live[max(0, len(live) - count) :]
        new = range(born + 1, born + 1 + count - len(live))
        born += len(new)
        live += new
        cursors = tuple(
            Cursor(i, (i * 0.013 + index * 0.001) % 1.0, i % 67 / 67, 0.06, 0.0, 0.0, 4.0, 60.0, 0.0) for i in live
        )
        frames.append(TouchFrame(index, index * FRAME_NS, State.TRACKING, cursors))
    return frames


def run_of_touchd(destination: str, first_fseq: int, offset: int) -> TuioUdpOutput:
    """Play a run: idle, up to sixty touches, some that leave, a stall, and idle again."""
    encoder = TuioEncoder("touchd-test-main@127.0.0.1", offset, first_fseq)
    output = TuioUdpOutput(encoder, UdpSender([destination]))
    output.start()
    for second in range(3):
        output.tick(second * SECOND_NS)
    busy = crowds([1, 2, 30, 60, 60, 60, 40, 10, 0, 0, 5])
    for each in busy:
        output.publish(each, 3 * SECOND_NS + each.t_ns)
    stalled = TouchFrame(len(busy), len(busy) * FRAME_NS, State.NO_FRAMES, ())
    output.publish(stalled, 4 * SECOND_NS)
    output.tick(5 * SECOND_NS)
    return output


def test_nothing_is_wrong_with_touchd_from_its_start_to_its_end(listening: Monitor) -> None:
    run_of_touchd(listening.destination, 1000, 70).close()
    verdict = listening.stopped()
    assert said(verdict) == []
    assert verdict.exit_code == ExitCode.OK
    assert list(verdict.lines())[-1] == "no rule is broken"
    (sender,) = verdict.senders
    assert (sender.adds, sender.removes, sender.alive, sender.most_alive) == (65, 65, 0, 60)
    assert verdict.kernel_drops == 0


def test_nothing_is_wrong_with_touchd_when_it_is_killed_and_started_again(listening: Monitor) -> None:
    killed = run_of_touchd(listening.destination, 1000, 70)
    killed.publish(crowds([20], 30)[0], 6 * SECOND_NS)
    killed._sender.close()  # as the system does for a process that was killed
    run_of_touchd(listening.destination, killed.last_fseq + 5000, 7000).close()
    verdict = listening.stopped()
    assert said(verdict) == []
    assert (verdict.exit_code, len(verdict.senders)) == (ExitCode.OK, 1)


def split_run(frames: int) -> list[bytes]:
    """Return touchd's datagrams of up to 1472 bytes: a crowd that comes and goes."""
    encoder = TuioEncoder("touchd-test-main@127.0.0.1", 0, 1000)
    chance = random.Random(3)
    script = crowds([chance.choice((60, 45, 50, 60, 20, 0)) for _ in range(frames)])
    sent = [datagram for each in script for datagram in encoder.next_frame(each.cursors).split(MTU)]
    return [*sent, encoder.clear(), encoder.clear(), encoder.clear()]


def test_nothing_is_wrong_with_the_frames_that_touchd_splits(listening: Monitor) -> None:
    datagrams = split_run(40)
    assert len(datagrams) > 80
    send([Post(datagram) for datagram in datagrams], listening.port)
    verdict = listening.stopped()
    assert said(verdict) == []
    assert (verdict.exit_code, verdict.datagrams) == (ExitCode.OK, len(datagrams))


def test_every_cursor_is_told_as_it_comes_moves_and_goes() -> None:
    with Monitor(moves=True) as told:
        addresses = send([Post(frame(1, {5: (0.25, 0.5)})), Post(frame(2, {5: (0.5, 0.5)})), Post(frame(3))], told.port)
        told.stopped()
    assert [line[8:] for line in told.lines[1:]] == [
        f"sender bad@table ({addresses['127.0.0.1']})",
        "add    cursor 5 at 0.250, 0.500",
        "move   cursor 5 at 0.500, 0.500",
        "remove cursor 5 at 0.500, 0.500",
    ]


def test_it_ends_by_itself_after_the_frames_asked_for() -> None:
    with Monitor(frames=3) as ending:
        send([Post(frame(number)) for number in (1, 2, 3)], ending.port)
        assert ending.ended().exit_code == ExitCode.OK


def test_that_nothing_arrived_is_no_success() -> None:
    with Monitor(seconds=0.05) as ending:
        verdict = ending.ended()
    assert verdict.exit_code == ExitCode.UNAVAILABLE
    assert list(verdict.lines())[1:] == [
        "nothing arrived: check that the sender's destination is this computer and this port, and that no",
        "firewall is in between",
    ]


def test_at_all_addresses_a_sender_is_known_by_its_plain_address() -> None:
    with Listener(0, None, None) as everywhere:
        addresses = send([Post(frame(1))], everywhere.port)
        (received,) = everywhere.receive(PATIENCE_S)
    assert (received.datagram, shown(received.address)) == (frame(1), addresses["127.0.0.1"])


def test_what_the_kernel_drops_is_counted_apart() -> None:
    with Listener(0, "127.0.0.1", None) as swamped:
        send([Post(b"\0" * 60_000)] * 2000, swamped.port)
        kept = len(list(iter(lambda: swamped.receive(0.0), [])))
        assert kept > 0
        send([Post(frame(1))], swamped.port)  # brings the count
        swamped.receive(PATIENCE_S)
        assert 0 < swamped.kernel_drops < 2000


def test_a_port_that_another_program_has_is_told_in_a_sentence(listening: Monitor) -> None:
    for host in (None, "127.0.0.1"):
        with pytest.raises(PortInUse) as raised:
            monitor(ListenOptions(listening.port, host), print, threading.Event())
        assert raised.value.exit_code == ExitCode.TRY_AGAIN
        assert str(raised.value) == (
            f"Another program listens on port {listening.port}; UDP clients cannot share a port; "
            "stop it or choose another port."
        )


def test_a_host_that_is_none_of_this_computers_is_an_error_of_usage() -> None:
    with pytest.raises(UsageError) as raised:
        monitor(ListenOptions(0, "192.0.2.1"), print, threading.Event())
    assert str(raised.value) == (
        "--host: '192.0.2.1' is no address of this computer; leave it out to listen at all of them."
    )


def test_a_group_that_is_no_multicast_address_is_an_error_of_usage() -> None:
    with pytest.raises(UsageError) as raised:
        monitor(ListenOptions(0, None, join="192.0.2.1"), print, threading.Event())
    assert str(raised.value) == (
        "--join: cannot join '192.0.2.1' ([Errno 22] Invalid argument); "
        "give an IPv4 multicast address such as 239.1.2.3."
    )


def test_the_summary_for_programs_says_what_that_for_people_does(listening: Monitor) -> None:
    send([Post(frame(1)), Post(frame(2, listed=[7])), Post(frame(3, listed=[7]))], listening.port)
    summary = json.loads(listening.stopped().as_json())
    (sender,) = summary["senders"]
    assert (summary["exit_code"], summary["faults"], summary["datagrams"]) == (65, 1, 3)
    assert (sender["name"], sender["frames"], sender["adds"], sender["alive"]) == ("bad@table", 3, 1, 1)
    (broken,) = summary["broken"]
    assert (broken["rule"], broken["severity"], broken["count"]) == ("phantom", "fault", 1)
