"""The process that renders the synthetic table. It ends when nobody takes its frames any more, and for no signal."""

import json
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from itertools import count
from typing import Protocol, Self

import cv2

from touchd.model import Frame
from touchd.sources.frame_ring import ReaderGone, RingEnds, RingWriter
from touchd.table.scenarios import CAMERA
from touchd.table.show import Show, frame_index, frame_time_ns
from touchd.table.table import Table

# A terminal's Ctrl-C and a service manager's SIGTERM reach every process of a group: what to do about them is the
# parent's business. With it gone this process ends, too.
IGNORED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)


class Pace(StrEnum):
    """When frames come."""

    LIVE = "live"  # at 30 Hz as from a camera; what cannot be made or taken in time is left out
    AS_TAKEN = "as-taken"  # every frame, as fast as they are taken


@dataclass(frozen=True, slots=True)
class Order:
    """What to render, and where to."""

    scenario: str
    seed: int
    empty_frames: int
    pace: Pace
    ends: RingEnds

    def as_argument(self) -> str:
        """Return the order as a word of a command line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_argument(cls, text: str) -> Self:
        """Read what :meth:`as_argument` wrote."""
        fields = json.loads(text)
        return cls(**{**fields, "pace": Pace(fields["pace"]), "ends": RingEnds(**fields["ends"])})


class Taker(Protocol):
    """Where frames go: a RingWriter, or what a test puts in its place."""

    @property
    def room(self) -> bool:
        """Whether a frame can be put."""

    def listen(self, timeout_s: float | None, /) -> None:
        """Wait for room, at most so long. Raises ReaderGone."""

    def put(self, frame: Frame, /) -> None:
        """Hand a frame over. Raises ReaderGone."""


def play_live(render: Callable[[int], Frame], taker: Taker, now_ns: Callable[[], int]) -> None:
    """Put each frame when it is due, until ReaderGone; after a late one go on with the one that is due then."""
    begun_ns, index = now_ns(), 0
    while True:
        taker.listen(0.0)
        while (early_ns := begun_ns + frame_time_ns(index) - now_ns()) > 0:
            taker.listen(early_ns / 1e9)
        if taker.room:
            taker.put(render(index))
        index = max(index + 1, frame_index(now_ns() - begun_ns))


def play_as_taken(render: Callable[[int], Frame], taker: Taker) -> None:
    """Put one frame after the other as soon as there is room, until ReaderGone."""
    for index in count():
        taker.listen(0.0)
        while not taker.room:
            taker.listen(None)
        taker.put(render(index))


def main() -> None:
    """Render what the command line says."""
    for number in IGNORED:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    cv2.setNumThreads(1)
    order = Order.from_argument(sys.argv[1])
    writer = RingWriter(order.ends)
    table = Table(CAMERA, order.seed)
    show = Show(order.scenario, order.seed, order.empty_frames)

    def render(index: int) -> Frame:
        return table.render(show.moment(index).hands, frame_time_ns(index), index)

    with suppress(ReaderGone):
        if order.pace is Pace.LIVE:
            play_live(render, writer, time.monotonic_ns)
        else:
            play_as_taken(render, writer)


if __name__ == "__main__":
    main()
