"""From host names to addresses, without ever making a sender wait."""

import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any, Protocol

_LOOPBACK_BYTES = 4096  # the reference client in C++ aborts above 4098
_IPV4_BYTES = 1472  # Ethernet's 1500 less 28 for headers: a larger datagram would be fragmented
_IPV6_BYTES = 1452  # likewise, with 48


@dataclass(frozen=True, slots=True)
class Address:
    """Where datagrams go: socket family, the address as sockets want it, and the largest datagram to send."""

    family: socket.AddressFamily
    sockaddr: tuple[Any, ...]
    max_bytes: int

    def __str__(self) -> str:
        host, port = self.sockaddr[:2]
        return f"[{host}]:{port}" if self.family == socket.AF_INET6 else f"{host}:{port}"


LookUp = Callable[[str, int], Address]


@dataclass(frozen=True, slots=True)
class Backoff:
    """How long to wait before asking for a name again: ``first_s``, then twice as long each time."""

    first_s: float = 1.0
    longest_s: float = 30.0

    def after(self, pause_s: float) -> float:
        """Return the pause that follows one of ``pause_s``, in seconds."""
        return min(max(2.0 * pause_s, self.first_s), self.longest_s)


class Host(Protocol):
    """A host that has an address, now or later."""

    @property
    def address(self) -> Address | None:
        """The address found last."""

    @property
    def error(self) -> str | None:
        """Why there is no address, or no newer one."""

    def doubt(self) -> None:
        """Say that the address does not work."""

    def trust(self) -> None:
        """Say that the address works again."""

    def close(self) -> None:
        """Stop looking."""


def look_up(host: str, port: int) -> Address:
    """Ask the system for a name's address; may take long.

    IPv4 is preferred, as most TUIO clients listen on 0.0.0.0 alone even where "localhost" means ::1 first.

    :raises OSError: when the name is not known or cannot be asked for.
    :raises UnicodeError: when the name cannot be one.
    """
    return _best(socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM))


def numeric_address(host: str, port: int) -> Address | None:
    """Return the address that ``host`` spells out, or None if it is a name; asks nobody."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM, flags=socket.AI_NUMERICHOST)
    except (OSError, UnicodeError):
        return None
    return _best(found)


def _best(found: list[tuple[Any, ...]]) -> Address:
    family, _, _, _, sockaddr = min(found, key=lambda entry: entry[0] != socket.AF_INET)
    host = ip_address(sockaddr[0].partition("%")[0])
    remote_bytes = _IPV4_BYTES if host.version == 4 else _IPV6_BYTES
    return Address(family, sockaddr, _LOOPBACK_BYTES if host.is_loopback else remote_bytes)


class NumericHost:
    """A host given by its address."""

    def __init__(self, address: Address) -> None:
        self.address = address
        self.error = None

    def doubt(self) -> None:
        """Do nothing: asking again would give the same address."""

    def trust(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class NamedHost:
    """A host given by its name, which is looked up on a daemon thread of its own.

    A name that cannot be resolved is asked for again and again, with growing pauses; a resolved one only when
    it is doubted. An address once found stays until a newer one is. Each name has its thread, as a look-up
    that hangs must not keep other names waiting.
    """

    def __init__(self, host: str, port: int, look_up: LookUp, backoff: Backoff) -> None:
        self.address: Address | None = None
        self.error: str | None = None
        self._host, self._port = host, port
        self._look_up = look_up
        self._backoff = backoff
        self._pause_s = 0.0
        self._wanted = True
        self._closed = False
        self._changed = threading.Condition()
        threading.Thread(target=self._run, name=f"look-up of {host}", daemon=True).start()

    def doubt(self) -> None:
        """Ask for the name again, when the pause since the last time is over; returns at once."""
        with self._changed:
            if not self._wanted:  # a sender that fails doubts at each frame; waking the thread would cost it time
                self._wanted = True
                self._changed.notify_all()

    def trust(self) -> None:
        """Begin with the shortest pause again."""
        with self._changed:
            self._pause_s = self._backoff.first_s

    def wait(self, timeout_s: float) -> bool:
        """Wait until there is an address, at most ``timeout_s``; return whether there is."""
        with self._changed:
            return self._changed.wait_for(lambda: self.address is not None, timeout_s)

    def close(self) -> None:
        """Stop looking; returns at once even if the system still looks."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _run(self) -> None:
        while self._due():
            try:
                address = self._look_up(self._host, self._port)
            except (OSError, UnicodeError) as error:
                self.error = getattr(error, "strerror", None) or str(error)
            else:
                self._found(address)

    def _due(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._wanted or self._closed)
            self._changed.wait_for(lambda: self._closed, self._pause_s)
            if self._closed:
                return False
            self._pause_s = self._backoff.after(self._pause_s)
            return True

    def _found(self, address: Address) -> None:
        with self._changed:
            self.address = address
            self.error = None
            self._wanted = False
            self._changed.notify_all()
