import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from touchd.assemble import OutputMaker
from touchd.config.load import parse_config
from touchd.config.schema import Config
from touchd.errors import UsageError
from touchd.lift import lift
from touchd.model import Cursor, State, TouchFrame
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.state import instance_of

from clients.bundles import Mailbox, read_bundle
from clients.harness import Client, OscDump, PythonTuio

CLEAR = ((), -1)


@pytest.fixture
def box() -> Iterator[Mailbox]:
    with Mailbox() as opened:
        yield opened


@pytest.fixture
def env(tmp_path: Path) -> dict[str, str]:
    return {"STATE_DIRECTORY": str(tmp_path / "state")}


def config_to(*destinations: str, source: str = "auto") -> Config:
    to = ", ".join(f'"{destination}"' for destination in destinations)
    return parse_config(f"outputs: [{{tuio: {{to: [{to}], source: {source}}}}}]\n", "touchd.yaml")


def touch_and_be_killed(config: Config, env: dict[str, str]) -> None:
    """Send two touches as the daemon does, and no goodbye."""
    maker = OutputMaker(instance_of(Path(env["STATE_DIRECTORY"])), stored_fseq=0)
    cursors = tuple(Cursor(i, 0.25 * i, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0) for i in (1, 2))
    for output in maker.outputs(config):
        assert isinstance(output, TuioUdpOutput)
        output.publish(TouchFrame(0, 0, State.TRACKING, cursors), 0)
        output._sender.close()  # as the system does for a process that was killed


@pytest.mark.parametrize("make_client", [PythonTuio, OscDump])
def test_clients_of_a_killed_daemon_hold_no_touch_after_lift(
    make_client: Callable[[], Client], env: dict[str, str]
) -> None:
    with make_client() as client:
        config = config_to(client.destination)
        touch_and_be_killed(config, env)
        client.sync()
        assert len(client.log.left_over()) == 2
        assert list(lift(config, (), env)) == [f"{client.destination}: all touches lifted"]
        client.sync()
        assert client.log.left_over() == set()
        assert client.log.faults == []


@pytest.mark.parametrize("source", ["auto", "table@studio"])
def test_the_sender_has_the_name_of_the_daemon_that_was_killed(source: str, box: Mailbox, env: dict[str, str]) -> None:
    config = config_to(box.destination, source=source)
    touch_and_be_killed(config, env)
    (daemons,) = {read_bundle(datagram).source for datagram in box.take()}
    list(lift(config, (), env))
    assert [read_bundle(datagram).source for datagram in box.take()] == [daemons] * 3


def test_every_destination_is_cleared_three_times_and_told_in_a_line_of_its_own(
    box: Mailbox, env: dict[str, str]
) -> None:
    with Mailbox() as second:
        lines = list(lift(config_to(box.destination, second.destination), (), env))
        assert lines == [f"{one.destination}: all touches lifted" for one in (box, second)]
        for one in (box, second):
            sent = [read_bundle(datagram) for datagram in one.take()]
            assert [(bundle.alive, bundle.fseq) for bundle in sent] == [CLEAR] * 3


def test_a_destination_is_cleared_in_the_profile_that_it_gets(box: Mailbox, env: dict[str, str]) -> None:
    config = parse_config(f'outputs: [{{tuio: {{to: ["{box.destination}"], profile: 25Dcur}}}}]\n', "touchd.yaml")
    list(lift(config, (), env))
    sent = [read_bundle(datagram, "25Dcur") for datagram in box.take()]
    assert [(bundle.alive, bundle.fseq) for bundle in sent] == [CLEAR] * 3


def test_other_destinations_may_be_named_in_place_of_the_configs(box: Mailbox, env: dict[str, str]) -> None:
    with Mailbox() as named:
        assert list(lift(config_to(box.destination), [named.destination], env)) == [
            f"{named.destination}: all touches lifted"
        ]
        assert len(named.take()) == 3
    assert box.take() == []


def test_a_name_is_looked_up_before_anything_is_sent(box: Mailbox, env: dict[str, str]) -> None:
    assert list(lift(config_to(f"localhost:{box.port}"), (), env)) == [f"localhost:{box.port}: all touches lifted"]
    assert len(box.take()) == 3


def test_a_name_without_an_address_is_told_and_the_others_are_cleared(box: Mailbox, env: dict[str, str]) -> None:
    nowhere = "x" * 64  # no name may be that long, so no name server is asked
    lost, cleared = lift(config_to(f"{nowhere}:3333", box.destination), (), env, names_s=0.5)
    assert lost.startswith(f"Cannot send to {nowhere}:3333: its name has no address yet (")
    assert cleared == f"{box.destination}: all touches lifted"
    assert len(box.take()) == 3


def test_nobody_has_to_listen(env: dict[str, str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        deserted = f"127.0.0.1:{probe.getsockname()[1]}"
    assert list(lift(config_to(deserted), (), env)) == [f"{deserted}: all touches lifted"]


def test_a_config_without_tuio_has_nothing_to_lift(env: dict[str, str]) -> None:
    nothing = parse_config("outputs: []\n", "touchd.yaml")
    assert list(lift(nothing, (), env)) == ["the config names no TUIO destination, so there is nothing to lift"]


def test_a_destination_on_the_command_line_that_is_none_is_an_error_of_usage(env: dict[str, str]) -> None:
    with pytest.raises(UsageError) as raised:
        list(lift(Config(), ["table"], env))
    assert str(raised.value) == '--to: "table" has no port; write it as host:port, for example "127.0.0.1:3333".'
