"""Reads what was sent: bundles by way of python-osc, and datagrams from a real socket on loopback."""

import socket
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_message import OscMessage
from pythonosc.parsing import osc_types

IMMEDIATELY = b"\0\0\0\0\0\0\0\1"


@dataclass(frozen=True, slots=True)
class Bundle:
    """A bundle of one profile whose order, address and type tags are as they must be."""

    source: str
    alive: tuple[int, ...]
    sets: dict[int, tuple[float, ...]]  # by session id, in the order of the specification: x, y, X, Y, m of 2Dcur
    fseq: int


SET_FLOATS = {"2Dcur": 5, "25Dcur": 7, "2Dblb": 11}


def read_bundle(datagram: bytes, profile: str = "2Dcur") -> Bundle:
    """Read a bundle and assert all that holds of every one: addresses, order, types and the time tag."""
    assert datagram[8:16] == IMMEDIATELY
    messages = [_read(message) for message in OscBundle(datagram)]
    assert {address for address, _, _ in messages} == {f"/tuio/{profile}"}
    words = [arguments[0] for _, _, arguments in messages]
    assert words == ["source", "alive", *["set"] * (len(words) - 3), "fseq"]
    (_, source_tags, source), (_, alive_tags, alive), *sets, (_, fseq_tags, fseq) = messages
    assert source_tags == ",ss"
    assert alive_tags == ",s" + "i" * (len(alive) - 1)
    assert {tags for _, tags, _ in sets} <= {",si" + "f" * SET_FLOATS[profile]}
    assert fseq_tags == ",si"
    by_id = {arguments[1]: tuple(arguments[2:]) for _, _, arguments in sets}
    assert len(by_id) == len(sets)
    return Bundle(source[1], tuple(alive[1:]), by_id, fseq[1])


def _read(message: OscMessage) -> tuple[str, str, list[Any]]:
    _, start = osc_types.get_string(message.dgram, 0)
    tags, _ = osc_types.get_string(message.dgram, start)
    return message.address, tags, list(message.params)


class Mailbox:
    """A UDP socket on loopback that keeps what it gets."""

    def __init__(self, family: socket.AddressFamily = socket.AF_INET) -> None:
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.settimeout(10.0)
        self._socket.bind(("::1" if family == socket.AF_INET6 else "127.0.0.1", 0))
        self.host, self.port = self._socket.getsockname()[:2]
        self.destination = f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    def take(self) -> list[bytes]:
        """Return all that was sent here before: this sends an end mark after it and reads up to that."""
        self._socket.sendto(b"end of the post", self._socket.getsockname())
        taken = []
        while (datagram := self._socket.recv(65536)) != b"end of the post":
            taken.append(datagram)
        return taken
