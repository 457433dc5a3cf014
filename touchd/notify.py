"""What touchd tells systemd about itself, in sd_notify's protocol (sd_notify(3), sd_watchdog_enabled(3))."""

import os
import socket
import time
from collections.abc import Mapping
from contextlib import suppress

# systemd ignores a datagram of more than 4096 bytes, and a character may take six here.
_MAX_STATUS = 600


class Notifier:
    """Tells the service manager how the service fares; does nothing where none asked to be told.

    Never blocks and never raises: what cannot be handed over at once is lost. May be used from any thread.
    A child that inherited the variables of its parent is silent, as they are meant for one process.
    """

    def __init__(self, env: Mapping[str, str]) -> None:
        """Read ``NOTIFY_SOCKET``, ``WATCHDOG_USEC`` and ``WATCHDOG_PID`` from ``env``, which stays as it is."""
        self._address = _address(env.get("NOTIFY_SOCKET", "")) if _is_meant(env.get("WATCHDOG_PID")) else None
        self._interval_s = _half_in_s(env.get("WATCHDOG_USEC", "")) if self._address else None
        self._status: str | None = None

    @property
    def watchdog_interval_s(self) -> float | None:
        """How often to call :meth:`watchdog`, in seconds: half of what the manager waits; None without a watchdog."""
        return self._interval_s

    def ready(self) -> None:
        """Say that the service runs, after its start or after a reload."""
        self._tell("READY=1")

    def reloading(self) -> None:
        """Say that the config is being read anew; :meth:`ready` must follow."""
        self._tell(f"RELOADING=1\nMONOTONIC_USEC={time.monotonic_ns() // 1000}")

    def stopping(self) -> None:
        """Say that the service is on its way out."""
        self._tell("STOPPING=1")

    def watchdog(self) -> None:
        """Say that the service is alive."""
        self._tell("WATCHDOG=1")

    def status(self, text: str) -> None:
        """Say in words, as one line, what the service does; what was said last is not said again."""
        line = " ".join(text.replace("\0", " ").split())[:_MAX_STATUS]
        if line != self._status and self._tell(f"STATUS={line}"):
            self._status = line

    def _tell(self, text: str) -> bool:
        if self._address is None:
            return False
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as opened:
            opened.sendto(text.encode(errors="backslashreplace"), self._address)
            return True
        return False


def _is_meant(watchdog_pid: str | None) -> bool:
    return watchdog_pid is None or watchdog_pid == str(os.getpid())


def _address(name: str) -> str | None:
    if name.startswith("/"):
        return name
    return "\0" + name[1:] if name.startswith("@") else None


def _half_in_s(microseconds: str) -> float | None:
    known = microseconds.isascii() and microseconds.isdigit() and int(microseconds) > 0
    return int(microseconds) / 2e6 if known else None
