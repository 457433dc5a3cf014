"""The UDP socket that the monitor listens at."""

import errno
import os
import select
import socket
import struct
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from touchd.errors import ExitCode, TouchdError, UsageError
from touchd.listen.sender import Address

_BUFFER_BYTES = 8 * 2**20  # seconds of 60 cursors at 60 Hz from three senders; the kernel gives what it allows
_MOST_BYTES = 65_536
_AT_ONCE = 500  # then time for what was read, and for the stop
_SO_RXQ_OVFL = 40  # Linux: each datagram brings the count of those dropped before it; Python has no name for it
_COUNT = struct.Struct("=I")
_MAPPED = "::ffff:"  # an IPv4 address as a socket for both sees it


class ListenError(TouchdError):
    """The port cannot be listened at."""

    exit_code = ExitCode.UNAVAILABLE


class PortInUse(ListenError):
    """Another program has the port."""

    exit_code = ExitCode.TRY_AGAIN


@dataclass(frozen=True, slots=True)
class Received:
    """A datagram, whence it came, and when (monotonic)."""

    datagram: bytes
    address: Address
    t_ns: int


class Listener:
    """An open socket; close it, or use it as a context. ``kernel_drops`` counts what the kernel had no room for."""

    def __init__(self, port: int, host: str | None, group: str | None) -> None:
        """Bind ``port`` (0: any) at ``host``, an address of this computer, or at all; join a multicast ``group``.

        :raises PortInUse: when another program has the port.
        :raises UsageError: when ``host`` or ``group`` is not of use here.
        :raises ListenError: when the system refuses for another reason.
        """
        self.kernel_drops = 0
        self._socket = _bound(port, host, group is not None)
        self.port: int = self._socket.getsockname()[1]
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        with suppress(OSError):  # other systems have no such count
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        if group is not None:
            _join(self._socket, group)
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def receive(self, timeout_s: float) -> list[Received]:
        """Wait for a datagram, and return all that are there, each with the time at which it was read."""
        self._poll.poll(timeout_s * 1e3)
        return list(self._drain())

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _drain(self) -> Iterator[Received]:
        for _ in range(_AT_ONCE):
            try:
                datagram, extras, _, sender = self._socket.recvmsg(_MOST_BYTES, socket.CMSG_SPACE(_COUNT.size))
            except OSError:
                return
            t_ns = time.monotonic_ns()
            for level, kind, content in extras:
                if (level, kind) == (socket.SOL_SOCKET, _SO_RXQ_OVFL):
                    self.kernel_drops = _COUNT.unpack(content)[0]
            yield Received(datagram, (sender[0].removeprefix(_MAPPED), sender[1]), t_ns)


def _bound(port: int, host: str | None, ipv4_only: bool) -> socket.socket:
    everywhere = host is None and not ipv4_only and socket.has_dualstack_ipv6()
    family = socket.AF_INET6 if everywhere or (host is not None and ":" in host) else socket.AF_INET
    opened = socket.socket(family, socket.SOCK_DGRAM)
    try:
        if everywhere:
            opened.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        opened.bind((host or ("::" if everywhere else "0.0.0.0"), port))  # noqa: S104  every sender is welcome
    except OSError as error:
        opened.close()
        raise _refusal(error, port, host) from error
    return opened


def _refusal(error: OSError, port: int, host: str | None) -> TouchdError:
    if error.errno == errno.EADDRINUSE:
        return PortInUse(
            f"Another program listens on port {port}; UDP clients cannot share a port; stop it or choose another port."
        )
    if error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
        return UsageError(f"--host: {host!r} is no address of this computer; leave it out to listen at all of them.")
    if error.errno == errno.EACCES:
        return ListenError(f"Port {port} is for administrators only; choose one from 1024 to 65535.")
    return ListenError(f"Cannot listen on port {port}: {os.strerror(error.errno or 0)}.")


def _join(opened: socket.socket, group: str) -> None:
    try:
        membership = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")  # noqa: S104  the system's own choice
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    except OSError as error:
        opened.close()
        raise UsageError(
            f"--join: cannot join {group!r} ({error}); give an IPv4 multicast address such as 239.1.2.3."
        ) from error
