"""How much of a Kinect's stream is lost on its way, told now and then."""

import logging

from touchd.sources.kinect.unpack import PACKETS_PER_FRAME
from touchd.sources.source import PACKET_LOSS_REMEDY, PACKET_LOSS_WORTH_TELLING

log = logging.getLogger(__name__)

WINDOW_NS = 10_000_000_000


class LossWatch:
    """Counts what comes of a stream against what the camera sent; says so once in 10 s while it loses more than 2 %."""

    def __init__(self, name: str, now_ns: int) -> None:
        """``name``: the camera's, for the log. ``now_ns``: when its stream begins."""
        self._name = name
        self._since_ns = now_ns
        self._sent = 0
        self._came = 0
        self._share: float | None = None

    @property
    def share(self) -> float | None:
        """The share of the packets that was lost in the last whole 10 s; None before."""
        return self._share

    def note(self, missed_frames: int, missing_packets: int, now_ns: int) -> None:
        """Note a frame, how many before it never came, and how many of its own packets did not."""
        self._sent += (missed_frames + 1) * PACKETS_PER_FRAME
        self._came += PACKETS_PER_FRAME - missing_packets
        if now_ns - self._since_ns < WINDOW_NS:
            return
        self._share = 1.0 - self._came / self._sent
        if self._share > PACKET_LOSS_WORTH_TELLING:
            log.warning(
                "%s: %.1f %% of its packets were lost in the last %.0f s: %s",
                self._name,
                self._share * 100.0,
                (now_ns - self._since_ns) / 1e9,
                PACKET_LOSS_REMEDY,
            )
        self._since_ns, self._sent, self._came = now_ns, 0, 0
