"""How many packets each transfer takes, so that a transfer ends where a frame does.

A transfer is handed over when its last packet is there. Cut without regard to frames, transfers of 4 ms would keep a
frame's last packet waiting for 2 ms in the mean, and shorter ones cost more processor time.
"""

import math

from touchd.sources.kinect.packets import TICKS_PER_FRAME

_TICKS_HZ = 60_000_000
_MICROFRAMES_HZ = 8_000
MICROFRAMES_PER_FRAME = _MICROFRAMES_HZ * TICKS_PER_FRAME / _TICKS_HZ  # 267
_LEAST, _USUAL = 8, 45  # packets; six usual transfers make a frame
_MARGIN = 2  # packets behind the expected end: as much as it may come late


class TransferSizes:
    """Plans the transfers of one stream, one after the other; a packet is a microframe, counted from 0."""

    def __init__(self, most: int) -> None:
        """``most``: packets that a transfer can hold."""
        self._most = most
        self._next = 0
        self._boundary: float | None = None

    def ended(self, microframe: int) -> None:
        """Take note of the microframe in which a frame's last packet came."""
        self._boundary = microframe + 1 + _MARGIN

    def plan(self) -> tuple[int, int]:
        """Return the first microframe of the next transfer, and how many packets it takes."""
        first = self._next
        packets = self._until_boundary(first)
        self._next += packets
        return first, packets

    def _until_boundary(self, first: int) -> int:
        """Return an even share of what is left up to the end of a frame."""
        if self._boundary is None:
            return min(_USUAL, self._most)
        frames = math.ceil((first + _LEAST - self._boundary) / MICROFRAMES_PER_FRAME)
        left = round(self._boundary + frames * MICROFRAMES_PER_FRAME) - first
        shares = max(math.ceil(left / self._most), round(left / _USUAL))
        return math.ceil(left / shares)
