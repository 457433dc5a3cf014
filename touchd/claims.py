"""Notices that two touchd on one computer send to one destination, which most TUIO clients cannot bear."""

import errno
import socket
from collections.abc import Iterable


class DestinationClaims:
    """Claims destinations for this process, for as long as it lives, where every touchd of the computer can see it.

    A claim is a bound socket in Linux's abstract namespace: no file, no owner, gone with the process.
    """

    def __init__(self) -> None:
        self._held: dict[str, socket.socket] = {}

    def hold(self, destinations: Iterable[str]) -> list[str]:
        """Claim these destinations and no others; return those that another touchd has claimed."""
        wanted = set(destinations)
        for gone in self._held.keys() - wanted:
            self._held.pop(gone).close()
        return [each for each in sorted(wanted - self._held.keys()) if not self._claim(each)]

    def release(self) -> None:
        """Give up all claims."""
        self.hold(())

    def _claim(self, destination: str) -> bool:
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(f"\0touchd sends to {destination}")
        except OSError as error:
            claim.close()
            # Where there is no such namespace, nothing can be told.
            return error.errno != errno.EADDRINUSE
        self._held[destination] = claim
        return True
