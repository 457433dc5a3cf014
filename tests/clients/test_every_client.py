"""The same touches in all five clients as touchd published, whatever happens between a finger and a client."""

import json
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from clients.comparison import (
    ClientLog,
    contradictions,
    differences,
    lasting_faults,
    learned_offset,
    published_paths,
    wire_paths,
)
from clients.harness import Client, OscDump, PythonTuio, free_udp_port
from clients.process_client import KivyTuio, NodeTuio, QtTouch

# from clients.relay import Relay
from clients.relay import LossyRelay
from clients.stamped import crowd, write_stamped
from daemon.running import RunningDaemon, running, wait_until

MAKERS: tuple[Callable[[int | None], Client], ...] = (QtTouch, KivyTuio, NodeTuio, PythonTuio, OscDump)
SYNTHETIC = "source: {kind: synthetic, scenario: ten}\ncalibration: {frames: 30}\ntouch: {method: shell}\n"


@contextmanager
def all_clients(ports: Sequence[int | None] = (None,) * len(MAKERS)) -> Iterator[list[Client]]:
    """Yield one running client of each kind."""
    made = [maker(port) for maker, port in zip(MAKERS, ports, strict=True)]
    with ExitStack() as stack, ThreadPoolExecutor() as together:
        list(together.map(stack.enter_context, made))
        yield made


@pytest.fixture
def clients() -> Iterator[list[Client]]:
    with all_clients() as started:
        yield started


class Table:
    """A config that plays something to destinations, and the events of what was published."""

    def __init__(self, folder: Path, config: Path) -> None:
        self.config = config
        self.state = folder / "state"
        self._events = folder / "events.jsonl"

    def send_to(self, destinations: Sequence[str]) -> None:
        text = self.config.read_text().partition("outputs:")[0]
        outputs = (
            f"outputs: [{{tuio: {{to: {json.dumps(list(destinations))}}}}}, {{events: {{path: {self._events}}}}}]\n"
        )
        self.config.write_text(text + outputs)

    def take_events(self) -> list[dict[str, Any]]:
        """Return the events since the last time."""
        events = [json.loads(line) for line in self._events.read_text().splitlines()]
        self._events.unlink()
        return events


@pytest.fixture(scope="session")
def ten_stamped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten fingers' pads that come and go for three seconds, over and over: the path of its config."""
    return write_stamped(tmp_path_factory.mktemp("ten"), crowd(most=10, frames=90, seed=5))


@pytest.fixture
def table(ten_stamped: Path, tmp_path: Path) -> Table:
    config = tmp_path / "touchd.yaml"
    config.write_text(ten_stamped.read_text().replace("path: recording", f"path: {ten_stamped.parent}/recording"))
    return Table(tmp_path, config)


def sync(clients: Sequence[Client]) -> None:
    for client in clients:
        client.sync()


def seen_by_all(clients: Sequence[Client], cursors: int) -> bool:
    return all(len(client.log.adds) >= cursors for client in clients)


def end(daemon: RunningDaemon, clients: Sequence[Client]) -> None:
    assert daemon.end(signal.SIGTERM) == 0
    sync(clients)


def play(table: Table, clients: Sequence[Client], cursors: int) -> list[dict[str, Any]]:
    """Run until every client has seen so many cursors, stop in whatever moment that is, and return the events."""
    table.send_to([client.destination for client in clients])
    with running(table.config, table.state) as daemon:
        wait_until(lambda: seen_by_all(clients, cursors))
        end(daemon, clients)
    return table.take_events()


def assert_same_in_all(clients: Sequence[Client], events: list[dict[str, Any]]) -> None:
    for client in clients:
        assert differences(client.log, events, learned_offset(client.log, events)) == [], type(client).__name__


def assert_none_contradicts(
    clients: Sequence[Client], events: list[dict[str, Any]], offset: int, required: Sequence[int]
) -> None:
    """``required``: the core's ids of cursors that every client must have seen."""
    for client in clients:
        wire = [offset + core_id for core_id in required]
        assert contradictions(client.log, wire_paths(events, offset), wire) == [], type(client).__name__


def newer_than_any_first(clients: Sequence[Client], added: Sequence[int], offset: int) -> list[int]:
    """Return the core's ids of those cursors ``added`` after the ten that the clients may have found there."""
    newest = max(session_id for client in clients for session_id in client.log.adds[:10])
    return [session_id - offset for session_id in added if session_id > newest]


def test_ten_fingers_of_two_rendered_hands(clients: list[Client], tmp_path: Path) -> None:
    config = tmp_path / "touchd.yaml"
    config.write_text(SYNTHETIC)
    events = play(Table(tmp_path, config), clients, cursors=10)
    assert max(len(event["cursors"]) for event in events) >= 10
    assert_same_in_all(clients, events)


def test_sixty_cursors_of_which_ten_at_a_time_change_places_in_one_frame(clients: list[Client], tmp_path: Path) -> None:
    config = write_stamped(tmp_path, crowd(most=60, frames=60, seed=1))
    events = play(Table(tmp_path, config), clients, cursors=100)
    live = [{cursor["id"] for cursor in event["cursors"]} for event in events]
    assert max(map(len, live)) == 60
    assert any(len(before - after) >= 10 and len(after - before) >= 10 for before, after in pairwise(live))
    assert_same_in_all(clients, events)


def test_a_client_that_starts_late_learns_of_the_touches_there_are(clients: list[Client], table: Table) -> None:
    ports = [free_udp_port() for _ in MAKERS]
    table.send_to([client.destination for client in clients] + [f"127.0.0.1:{port}" for port in ports])
    with running(table.config, table.state) as daemon:
        wait_until(lambda: seen_by_all(clients, 3))
        with all_clients(ports) as late:
            wait_until(lambda: seen_by_all(late, 30))
            end(daemon, [*clients, *late])
            events = table.take_events()
            assert_same_in_all(clients, events)
            offset = learned_offset(clients[0].log, events)
            from_there_on = newer_than_any_first(late, clients[0].log.adds, offset)
            assert len(from_there_on) > 10
            assert_none_contradicts(late, events, offset, from_there_on)


def test_a_client_that_stops_and_comes_back_goes_on_with_what_is_there(clients: list[Client], table: Table) -> None:
    ports = [free_udp_port() for _ in MAKERS]
    table.send_to([client.destination for client in clients] + [f"127.0.0.1:{port}" for port in ports])
    with running(table.config, table.state) as daemon:
        with all_clients(ports) as first:
            wait_until(lambda: seen_by_all(first, 10))
        with all_clients(ports) as again:
            wait_until(lambda: seen_by_all(again, 30))
            end(daemon, [*clients, *again])
            events = table.take_events()
            assert_same_in_all(clients, events)
            offset = learned_offset(clients[0].log, events)
            from_there_on = newer_than_any_first(again, clients[0].log.adds, offset)
            assert len(from_there_on) > 10
            assert_none_contradicts(again, events, offset, from_there_on)


def play_through_a_bad_network(
    table: Table, clients: Sequence[Client], loss: float, swap: float
) -> tuple[list[dict[str, Any]], int]:
    """Return the events, and the offset of session ids as an undisturbed client saw it."""
    with ExitStack() as network, OscDump() as witness:
        relays = [
            network.enter_context(LossyRelay(client.destination, loss, swap, seed))
            for seed, client in enumerate(clients)
        ]
        table.send_to([witness.destination, *(relay.destination for relay in relays)])
        with running(table.config, table.state) as daemon:
            wait_until(lambda: seen_by_all([*clients, witness], 60))
            assert daemon.end(signal.SIGTERM) == 0
        network.close()
        sync([witness, *clients])
        assert all(relay.lost > 0 for relay in relays) is (loss > 0)
        assert all(relay.swapped > 0 for relay in relays) is (swap > 0)
        events = table.take_events()
        return events, learned_offset(witness.log, events)


def long_lived(events: list[dict[str, Any]], frames: int) -> list[int]:
    """Return the core's ids of the cursors that lived so many frames."""
    return [core_id for core_id, path in published_paths(events).items() if len(path) >= frames]


def test_a_network_that_loses_five_percent(clients: list[Client], table: Table) -> None:
    events, offset = play_through_a_bad_network(table, clients, loss=0.05, swap=0.0)
    assert_none_contradicts(clients, events, offset, long_lived(events, frames=8))


def test_a_network_that_swaps_frames_deceives_who_ignores_fseq_for_one_frame_and_nobody_else(
    clients: list[Client], table: Table
) -> None:
    """Only a client that knows the order can drop a late frame: whatever is sent, the others must believe its alive."""
    events, offset = play_through_a_bad_network(table, clients, loss=0.05, swap=0.05)
    required = [offset + core_id for core_id in long_lived(events, frames=8)]
    published = wire_paths(events, offset)
    for client in clients:
        compare = contradictions if isinstance(client, OscDump) else lasting_faults
        assert compare(client.log, published, required) == [], type(client).__name__


def test_a_stop_in_mid_touch_and_a_new_start_leave_nothing_stuck_or_doubled(
    clients: list[Client], table: Table
) -> None:
    first = play(table, clients, cursors=5)
    assert [client.log.left_over() for client in clients] == [set()] * len(clients)
    held = len(clients[0].log.adds)
    second = play(table, clients, cursors=held + 20)
    for client in clients:
        early = ClientLog(client.log.adds[:held])
        late = ClientLog(client.log.adds[held:])
        published = wire_paths(first, learned_offset(early, first)) | wire_paths(second, learned_offset(late, second))
        assert contradictions(client.log, published, list(published)) == [], type(client).__name__


def test_a_daemon_that_is_killed_and_started_again_leaves_nothing_stuck_or_doubled(
    clients: list[Client], table: Table
) -> None:
    table.send_to([client.destination for client in clients])
    with running(table.config, table.state) as daemon:
        wait_until(lambda: seen_by_all(clients, 12))
        daemon.end(signal.SIGKILL)
    sync(clients)
    assert all(client.log.left_over() for client in clients)
    held = len(clients[0].log.adds)
    table.take_events()
    events = play(table, clients, cursors=held + 20)
    for client in clients:
        assert client.log.left_over() == set(), type(client).__name__
        assert len(client.log.adds) == len(set(client.log.adds)), type(client).__name__
        late = ClientLog(client.log.adds[held:], removes=client.log.removes[held:])
        late.moves = {i: client.log.moves[i] for i in late.adds}
        assert differences(late, events, learned_offset(late, events)) == [], type(client).__name__


def test_a_camera_that_stalls_ends_the_touches_and_begins_new_ones(clients: list[Client], tmp_path: Path) -> None:
    pads = [(200.0, 200.0), (400.0, 300.0)]
    config = write_stamped(tmp_path, [pads] * 90, stall_after=30, stall_ns=400_000_000)
    events = play(Table(tmp_path, config), clients, cursors=4)
    assert "no-frames" in {event["state"] for event in events}
    assert_same_in_all(clients, events)


@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGHUP])
def test_a_recalibration_or_reload_in_mid_touch(clients: list[Client], table: Table, number: signal.Signals) -> None:
    table.send_to([client.destination for client in clients])
    with running(table.config, table.state) as daemon:
        wait_until(lambda: seen_by_all(clients, 8))
        daemon.process.send_signal(number)
        if number == signal.SIGUSR1:
            daemon.wait_for("state: calibrating", times=2)
        else:
            daemon.wait_for("config: nothing changed")
            wait_until(lambda: seen_by_all(clients, 30))
        end(daemon, clients)
    events = table.take_events()
    states = [event["state"] for event in events]
    assert ("calibrating" in states[states.index("tracking") :]) is (number == signal.SIGUSR1)
    assert_same_in_all(clients, events)


def test_two_daemons_with_a_port_each_do_not_see_each_other(
    clients: list[Client], table: Table, tmp_path: Path
) -> None:
    (tmp_path / "other").mkdir()
    config = tmp_path / "other" / "touchd.yaml"
    config.write_text(table.config.read_text())
    other_table = Table(config.parent, config)
    with all_clients() as others:
        table.send_to([client.destination for client in clients])
        other_table.send_to([client.destination for client in others])
        with running(table.config, table.state) as daemon, running(config, other_table.state) as other:
            wait_until(lambda: seen_by_all(clients, 15) and seen_by_all(others, 15))
            end(daemon, clients)
            end(other, others)
        assert_same_in_all(clients, table.take_events())
        assert_same_in_all(others, other_table.take_events())
