"""What a bad destination costs the others: from a frame to a good one's datagram, alone and beside bad neighbours."""

import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, suppress
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from touchd.model import Frame
from touchd.outputs.names import Address, LookUp, look_up
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender, open_udp_socket
from touchd.pipeline import Pipeline

OpenSocket: TypeAlias = Callable[[socket.AddressFamily], socket.socket]
Paced: TypeAlias = Callable[[Iterator[Frame]], Iterator[Frame]]
Neighbour: TypeAlias = Callable[[], AbstractContextManager[TuioUdpOutput]]

# All are measured in turns, so that what else the computer does meets them alike.
_TURNS = 6
_HOT_FRAMES = 600
_ALONE = "nobody"
# An address of TEST-NET-2, which belongs to nobody (RFC 5737).
_UNREACHABLE = "198.51.100.1"
_PORT = 3333
# A label of a host name has at most 63 characters (RFC 1035), so no name server is asked for this one.
_UNRESOLVABLE = "x" * 64


@contextmanager
def listening() -> Iterator[TuioUdpOutput]:
    """Yield an output to a receiver with room for what it will get."""
    with _receiver() as receiver, _output(f"127.0.0.1:{receiver.getsockname()[1]}") as output:
        yield output


@contextmanager
def refusing() -> Iterator[TuioUdpOutput]:
    """Yield an output to a port of this computer that was just closed."""
    with _receiver() as receiver:
        port = receiver.getsockname()[1]
    with _output(f"127.0.0.1:{port}") as output:
        yield output


@contextmanager
def unreachable() -> Iterator[TuioUdpOutput]:
    """Yield an output to an address to which there is no way: every send fails."""
    with _output(f"{_UNREACHABLE}:{_PORT}", open_socket=_without_routes) as output:
        yield output


@contextmanager
def named_unreachable() -> Iterator[TuioUdpOutput]:
    """Yield an output to a name with such an address, so that each failure makes it doubt the address."""

    def found(_host: str, port: int) -> Address:
        return Address(socket.AF_INET, (_UNREACHABLE, port), 1472)

    with _output(f"gone.example:{_PORT}", found, _without_routes) as output:
        yield output


@contextmanager
def unresolvable() -> Iterator[TuioUdpOutput]:
    """Yield an output to a name that can have no address."""
    with _output(f"{_UNRESOLVABLE}:{_PORT}") as output:
        yield output


@contextmanager
def hanging() -> Iterator[TuioUdpOutput]:
    """Yield an output to a name that is looked up for ever."""
    ended = threading.Event()

    def hang(_host: str, _port: int) -> Address:
        ended.wait()
        raise OSError("the bench has ended")

    with _output(f"hanging.example:{_PORT}", hang) as output:
        try:
            yield output
        finally:
            ended.set()


@contextmanager
def never_reading() -> Iterator[TuioUdpOutput]:
    """Yield an output to a receiver that never reads: its buffer is full, and the system drops what comes."""
    with _receiver() as receiver:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)  # the system's least
        with _output(f"127.0.0.1:{receiver.getsockname()[1]}") as output:
            yield output


@contextmanager
def congested() -> Iterator[TuioUdpOutput]:
    """Yield an output whose socket never has room for another datagram: every send would have to wait."""
    kept, full = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with kept, _output(f"127.0.0.1:{_PORT}", open_socket=lambda _: _FullSocket(fileno=full.detach())) as output:
        yield output


NEIGHBOURS: Mapping[str, Neighbour] = {
    "a port that refuses": refusing,
    "an unreachable address": unreachable,
    "a name of such an address": named_unreachable,
    "an unresolvable name": unresolvable,
    "a resolver that hangs": hanging,
    "a receiver that never reads": never_reading,
    "a send buffer that is full": congested,
}


def bench_destinations(pipeline: Pipeline, frames: Iterator[Frame], paced: Paced, paced_frames: int) -> Iterator[str]:
    """Yield the lines of a table: a good destination alone, then beside each bad one, then beside all.

    ``frames`` must not end; ``paced`` yields frames when they are due. The good destination is sent to last.
    """
    companies: dict[str, Sequence[Neighbour]] = {_ALONE: (), "another good one": (listening,)}
    companies |= {name: (neighbour,) for name, neighbour in NEIGHBOURS.items()}
    companies["all the bad ones"] = tuple(NEIGHBOURS.values())
    hot: dict[str, list[int]] = {name: [] for name in companies}
    cold: dict[str, list[int]] = {name: [] for name in companies}
    for _ in range(_TURNS):
        for name, company in companies.items():
            hot[name] += _times_ns(pipeline, islice(frames, _HOT_FRAMES // _TURNS), company)
            cold[name] += _times_ns(pipeline, paced(islice(frames, max(1, paced_frames // _TURNS))), company)
    columns = "median   more     p99    more"
    yield f"{'frame to datagram in ms, beside':33s}hot: {columns}  paced: {columns}"
    for name in companies:
        yield f"{name:33s}{_row(hot[name], hot[_ALONE])}    {_row(cold[name], cold[_ALONE])}"


def _times_ns(pipeline: Pipeline, frames: Iterator[Frame], company: Sequence[Neighbour]) -> list[int]:
    """Return for each frame the time from its beginning to the datagram to a good destination, which comes last."""
    times_ns = []
    with ExitStack() as opened:
        outputs = [opened.enter_context(neighbour()) for neighbour in (*company, listening)]
        for frame in frames:
            begun_ns = time.perf_counter_ns()
            result = pipeline.step(frame)
            for output in outputs:
                output.publish(result, begun_ns)
            times_ns.append(time.perf_counter_ns() - begun_ns)
            pipeline.settle()
    return times_ns


def _row(beside_ns: list[int], alone_ns: list[int]) -> str:
    median, p99 = np.percentile(np.array(beside_ns) / 1e6, [50, 99])
    median_alone, p99_alone = np.percentile(np.array(alone_ns) / 1e6, [50, 99])
    return f"{median:11.3f} {median - median_alone:+6.3f} {p99:7.3f} {p99 - p99_alone:+7.3f}"


@contextmanager
def _output(
    destination: str, look_up: LookUp = look_up, open_socket: OpenSocket = open_udp_socket
) -> Iterator[TuioUdpOutput]:
    """Yield a started output of its own for a destination, as a daemon makes one for each."""
    sender = UdpSender([destination], look_up, open_socket)
    with closing(TuioUdpOutput(TuioEncoder("touchd-bench@127.0.0.1", 0, 1), sender)) as output:
        output.start()
        yield output


def _receiver() -> socket.socket:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    return receiver


def _without_routes(family: socket.AddressFamily) -> socket.socket:
    """Open a socket that knows no way beyond the networks this computer is part of, so that nothing leaves it."""
    opened = open_udp_socket(family)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_DONTROUTE, 1)
    return opened


class _FullSocket(socket.socket):
    """An end of a socket pair that was written to until it took no more.

    Over the loopback a UDP socket's send buffer never fills up, as every datagram is delivered or dropped at once.
    """

    def __init__(self, fileno: int) -> None:
        super().__init__(fileno=fileno)
        self.setblocking(False)
        with suppress(BlockingIOError):
            while True:
                self.send(b"in the way")

    def sendto(self, data: Any, _address: Any) -> int:  # type: ignore[override]  # of all its forms, the one used
        """Send to the other end, wherever it was to go."""
        return self.send(data)
