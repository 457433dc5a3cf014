import re
import socket

import pytest
from touchd.outputs.names import Address, Backoff, look_up, numeric_address
from touchd.outputs.udp import Destination, parse_destination


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("127.0.0.1:3333", "127.0.0.1", 3333),
        ("cave.local:1", "cave.local", 1),
        ("my_box-2:65535", "my_box-2", 65535),
        ("[::1]:3333", "::1", 3333),
        ("[fe80::1%eth0]:3333", "fe80::1%eth0", 3333),
        ("239.0.0.1:3333", "239.0.0.1", 3333),
    ],
)
def test_a_destination_is_read_and_written_the_same(text: str, host: str, port: int) -> None:
    assert parse_destination(text) == Destination(host, port)
    assert str(parse_destination(text)) == text


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", '"" has no port; write it as host:port, for example "127.0.0.1:3333".'),
        ("cave", '"cave" has no port; write it as host:port, for example "127.0.0.1:3333".'),
        ("[::1]", '"[::1]" has no port; write it as host:port, for example "127.0.0.1:3333".'),
        ("cave:", '"cave:" has the port ""; give a whole number from 1 to 65535.'),
        ("cave:0", '"cave:0" has the port "0"; give a whole number from 1 to 65535.'),
        ("cave:65536", '"cave:65536" has the port "65536"; give a whole number from 1 to 65535.'),
        ("cave:-1", '"cave:-1" has the port "-1"; give a whole number from 1 to 65535.'),
        (
            "cave:3333333333",
            '"cave:3333333333" has the port "3333333333"; give a whole number from 1 to 65535.',
        ),
        ("cave:³", '"cave:³" has the port "³"; give a whole number from 1 to 65535.'),
        ("::1:3333", '"::1:3333" has an IPv6 address without brackets; write it as "[::1]:3333".'),
        ("[cave]:3333", '"[cave]:3333" has no IPv6 address between its brackets; found "cave".'),
        (":3333", '":3333" has the host ""; give an IP address or a host name alone.'),
        ("a b:3333", '"a b:3333" has the host "a b"; give an IP address or a host name alone.'),
        (
            "udp//cave:3333",
            '"udp//cave:3333" has the host "udp//cave"; give an IP address or a host name alone.',
        ),
        ("300.1.1.1:3333", '"300.1.1.1:3333" has the host "300.1.1.1", which is no IPv4 address.'),
        ("10.1:3333", '"10.1:3333" has the host "10.1", which is no IPv4 address.'),
    ],
)
def test_a_bad_destination_is_refused_with_the_remedy(text: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(complaint)}$"):
        parse_destination(text)


@pytest.mark.parametrize(
    ("host", "max_bytes"),
    [
        ("127.0.0.1", 4096),
        ("127.3.2.1", 4096),
        ("::1", 4096),
        ("192.0.2.7", 1472),
        ("255.255.255.255", 1472),
        ("239.0.0.1", 1472),
        ("2001:db8::7", 1452),
    ],
)
def test_the_largest_datagram_depends_on_where_it_goes(host: str, max_bytes: int) -> None:
    address = numeric_address(host, 3333)
    assert address is not None
    assert address.max_bytes == max_bytes


def test_a_name_is_no_numeric_address() -> None:
    assert numeric_address("cave.local", 3333) is None


def test_a_name_with_addresses_of_both_kinds_goes_to_the_ipv4_one(monkeypatch: pytest.MonkeyPatch) -> None:
    spelled_out = socket.getaddrinfo
    both = [*spelled_out("::1", 3333), *spelled_out("127.0.0.1", 3333)]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: both)
    assert look_up("cave.local", 3333) == Address(socket.AF_INET, ("127.0.0.1", 3333), 4096)


def test_pauses_between_look_ups_double_up_to_thirty_seconds() -> None:
    pauses = [0.0]
    for _ in range(7):
        pauses.append(Backoff().after(pauses[-1]))
    assert pauses == [0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0]
