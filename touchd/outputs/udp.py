"""Datagrams to any number of destinations, on sockets that never block and sends that never raise."""

import errno
import re
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address
from types import TracebackType
from typing import Self

from touchd.outputs.names import (
    Address,
    Backoff,
    Host,
    LookUp,
    NamedHost,
    NumericHost,
    look_up,
    numeric_address,
)
from touchd.outputs.tuio import EncodedFrame

# What a send may say when a name's address is no longer that of the host, or the way to it has changed.
_LOOK_AGAIN = {
    errno.EHOSTUNREACH,
    errno.EHOSTDOWN,
    errno.ENETUNREACH,
    errno.ENETDOWN,
    errno.EADDRNOTAVAIL,
    errno.EAFNOSUPPORT,
}


@dataclass(frozen=True, slots=True)
class Destination:
    """A host, by address or name (IPv6 without brackets), and a UDP port."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def parse_destination(text: str) -> Destination:
    """Read ``host:port`` or ``[IPv6 address]:port``.

    :raises ValueError: with one sentence that names the text, what is wrong with it, and the remedy.
    """
    host, colon, port = text.rpartition(":")
    if not colon or host.startswith("[") != host.endswith("]"):
        raise ValueError(f'"{text}" has no port; write it as host:port, for example "127.0.0.1:3333".')
    if not (port.isascii() and port.isdigit() and len(port) <= 5 and 1 <= int(port) <= 65535):
        raise ValueError(f'"{text}" has the port "{port}"; give a whole number from 1 to 65535.')
    if host.startswith("["):
        return Destination(_checked_ipv6(text, host[1:-1]), int(port))
    if ":" in host:
        raise ValueError(f'"{text}" has an IPv6 address without brackets; write it as "[{host}]:{port}".')
    return Destination(_checked_host(text, host), int(port))


def is_multicast(text: str) -> bool:
    """Return whether a destination that :func:`parse_destination` reads is an IPv4 multicast address."""
    try:
        return IPv4Address(parse_destination(text).host).is_multicast
    except ValueError:
        return False


def _checked_ipv6(text: str, host: str) -> str:
    try:
        IPv6Address(host)
    except ValueError:
        raise ValueError(f'"{text}" has no IPv6 address between its brackets; found "{host}".') from None
    return host


def _checked_host(text: str, host: str) -> str:
    if not re.fullmatch(r"[\w-]+(\.[\w-]+)*\.?", host):
        raise ValueError(f'"{text}" has the host "{host}"; give an IP address or a host name alone.')
    if re.fullmatch(r"[\d.]+", host):
        try:
            IPv4Address(host)
        except ValueError:
            raise ValueError(f'"{text}" has the host "{host}", which is no IPv4 address.') from None
    return host


@dataclass(frozen=True, slots=True)
class DestinationStatus:
    """How a destination fares, in datagrams; ``address`` is None while the name has none."""

    destination: str
    sent: int
    failed: int
    last_error: str | None
    address: str | None


def open_udp_socket(family: socket.AddressFamily) -> socket.socket:
    """Open a non-blocking UDP socket that may broadcast.

    It is not connected: on a connected one sends fail when nobody listens.

    :raises OSError: when the system has no such family.
    """
    opened = socket.socket(family, socket.SOCK_DGRAM)
    opened.setblocking(False)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    return opened


def open_udp_socket_on(interface: str, family: socket.AddressFamily) -> socket.socket:
    """Open such a socket, from which IPv4 multicast leaves by this computer's ``interface``, given by its address.

    :raises OSError: also when no interface has that address.
    """
    opened = open_udp_socket(family)
    if family == socket.AF_INET:
        try:
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
        except OSError as error:
            opened.close()
            raise OSError(error.errno, f"no network interface of this computer has the address {interface}") from error
    return opened


class UdpSender:
    """Sends datagrams to every destination; what one destination does is nothing to the others.

    Numeric addresses are known at once; names are resolved on other threads, and until then their datagrams
    count as failed. Use it from one thread, ``status`` from any; close it, or use it as a context.
    """

    def __init__(
        self,
        destinations: Sequence[str],
        look_up: LookUp = look_up,
        open_socket: Callable[[socket.AddressFamily], socket.socket] = open_udp_socket,
        backoff: Backoff | None = None,
    ) -> None:
        """Take destinations as in :func:`parse_destination`.

        :raises ValueError: when one of them cannot be read.
        """
        pause = backoff or Backoff()
        parsed = [parse_destination(text) for text in destinations]
        self._open_socket = open_socket
        self._sockets: dict[socket.AddressFamily, socket.socket] = {}
        self._closed = False
        self._targets = [_Target(where, _host_of(where, look_up, pause)) for where in parsed]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def send(self, frame: EncodedFrame) -> None:
        """Send a frame to every destination, cut as each of them needs it."""
        for target in self._targets:
            address = target.host.address
            if address is None:
                target.note_unresolved()
                continue
            for datagram in frame.split(address.max_bytes):
                if not self._send(target, address, datagram):
                    break  # the rest would list cursors as alive that were never set

    def send_bytes(self, datagram: bytes, copies: int) -> None:
        """Send one datagram ``copies`` times to every destination."""
        for target in self._targets:
            address = target.host.address
            for _ in range(copies):
                if address is None:
                    target.note_unresolved()
                else:
                    self._send(target, address, datagram)

    def wait_resolved(self, timeout_s: float) -> bool:
        """Wait at most ``timeout_s`` for all names to have addresses; for commands that send once and end."""
        deadline_s = time.monotonic() + timeout_s
        named = [target.host for target in self._targets if isinstance(target.host, NamedHost)]
        return all(host.wait(max(0.0, deadline_s - time.monotonic())) for host in named)

    def status(self) -> tuple[DestinationStatus, ...]:
        """Return how each destination fares, in the order given."""
        return tuple(target.status() for target in self._targets)

    def close(self) -> None:
        """Close the sockets and stop looking for names; later sends count as failed."""
        self._closed = True
        for target in self._targets:
            target.host.close()
        for opened in self._sockets.values():
            with suppress(OSError):
                opened.close()
        self._sockets.clear()

    def _send(self, target: "_Target", address: Address, datagram: bytes) -> bool:
        try:
            self._socket(address.family).sendto(datagram, address.sockaddr)
        except OSError as error:
            target.note_failure(error)
            return False
        target.note_success()
        return True

    def _socket(self, family: socket.AddressFamily) -> socket.socket:
        if self._closed:
            raise OSError(errno.EBADF, "the output is closed")
        opened = self._sockets.get(family)
        if opened is None:
            opened = self._sockets[family] = self._open_socket(family)
        return opened


def _host_of(where: Destination, look_up: LookUp, backoff: Backoff) -> Host:
    address = numeric_address(where.host, where.port)
    if address is not None:
        return NumericHost(address)
    return NamedHost(where.host, where.port, look_up, backoff)


class _Target:
    """A destination, its host, and its counters."""

    def __init__(self, where: Destination, host: Host) -> None:
        self.host = host
        self._where = where
        self._sent = 0
        self._failed = 0
        self._last_error: str | None = None
        self._doubted = False

    def note_success(self) -> None:
        self._sent += 1
        if self._doubted:
            self._doubted = False
            self.host.trust()

    def note_failure(self, error: OSError) -> None:
        self._failed += 1
        self._last_error = f"Cannot send to {self._where}: {error.strerror or error}."
        if error.errno in _LOOK_AGAIN:
            self._doubted = True
            self.host.doubt()

    def note_unresolved(self) -> None:
        self._failed += 1
        self._doubted = True
        reason = self.host.error or "it is being looked up"
        self._last_error = f"Cannot send to {self._where}: its name has no address yet ({reason})."

    def status(self) -> DestinationStatus:
        address = self.host.address
        return DestinationStatus(
            destination=str(self._where),
            sent=self._sent,
            failed=self._failed,
            last_error=self._last_error,
            address=None if address is None else str(address),
        )
