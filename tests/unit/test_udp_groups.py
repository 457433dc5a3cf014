"""One datagram to many: broadcast and multicast, on loopback."""

import socket
from collections.abc import Iterator
from functools import partial

import pytest
from touchd.outputs.udp import UdpSender, is_multicast, open_udp_socket_on

from clients.bundles import read_bundle
from unit.test_udp_sender import frame_of

GROUP = "239.255.77.7"


@pytest.fixture
def members() -> Iterator[list[socket.socket]]:
    """Two programs on one port, as group members may share one."""
    opened = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    port = 0
    for member in opened:
        member.settimeout(10.0)
        member.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        member.bind(("", port))
        port = member.getsockname()[1]
        member.setsockopt(
            socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
        )
    yield opened
    for member in opened:
        member.close()


def test_multicast_through_the_chosen_interface_reaches_every_member(members: list[socket.socket]) -> None:
    port = members[0].getsockname()[1]
    with UdpSender([f"{GROUP}:{port}"], open_socket=partial(open_udp_socket_on, "127.0.0.1")) as sender:
        sender.send(frame_of(3))
        for member in members:
            assert read_bundle(member.recv(65536)).alive == (1, 2, 3)


def test_sixty_cursors_to_a_group_are_cut_for_the_network(members: list[socket.socket]) -> None:
    port = members[0].getsockname()[1]
    with UdpSender([f"{GROUP}:{port}"], open_socket=partial(open_udp_socket_on, "127.0.0.1")) as sender:
        sender.send(frame_of(60))
        datagrams = [members[0].recv(65536)]
        while len(read_bundle(datagrams[-1]).alive) < 60:
            datagrams.append(members[0].recv(65536))
        assert max(map(len, datagrams)) <= 1472
        assert sum(len(read_bundle(datagram).sets) for datagram in datagrams) == 60


def test_an_interface_that_is_not_ours_is_named(members: list[socket.socket]) -> None:
    port = members[0].getsockname()[1]
    with UdpSender([f"{GROUP}:{port}"], open_socket=partial(open_udp_socket_on, "192.0.2.1")) as sender:
        sender.send(frame_of(1))
        (status,) = sender.status()
    assert status.failed == 1
    assert status.last_error == (
        f"Cannot send to {GROUP}:{port}: no network interface of this computer has the address 192.0.2.1."
    )


def test_a_broadcast_reaches_a_client_that_listens_on_all_addresses() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(10.0)
        client.bind(("", 0))
        with UdpSender([f"127.255.255.255:{client.getsockname()[1]}"]) as sender:
            sender.send(frame_of(2))
            assert read_bundle(client.recv(65536)).alive == (1, 2)


@pytest.mark.parametrize(
    ("destination", "group"),
    [("239.1.2.3:3333", True), ("224.0.0.1:1", True), ("192.168.0.255:3333", False), ("table.local:3333", False)],
)
def test_a_multicast_destination_is_known_by_its_address(destination: str, group: bool) -> None:
    assert is_multicast(destination) is group
