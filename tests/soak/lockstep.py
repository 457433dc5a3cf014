"""A source that gives out a frame only when the last one has been worked on, as fast as that goes."""

import threading
from collections.abc import Iterator
from itertools import count

from touchd.model import Frame, Sensor, State, TouchFrame
from touchd.watcher import Watcher

from soak.pictures import PERIOD_NS, Show

PATIENCE_S = 60.0


class LockStepSource:
    """Shows pictures over and over, 33.3 ms apart by their own clock, whatever time it is."""

    name = "the soak's table"
    identified = True
    waiting = None
    reconnects = 0
    packet_loss = None

    def __init__(self, show: Show) -> None:
        self._show = show
        self._until = 0
        self._silent_ns = 0
        self._next = threading.Semaphore(0)
        self._played = threading.Semaphore(0)
        self._closed = False

    @property
    def sensor(self) -> Sensor:
        """The Kinect over the table."""
        return self._show.sensor

    @property
    def played(self) -> int:
        """How many frames were played."""
        return self._until

    def frames(self) -> Iterator[Frame]:
        """Yield each frame when it is its turn."""
        pictures = self._show.pictures
        for index in count():
            self._next.acquire()
            if self._closed:
                return
            yield Frame(index, index * PERIOD_NS + self._silent_ns, pictures[index % len(pictures)])

    def show(self, _state: State, /) -> None:
        """Do nothing: there is no light."""

    def close(self) -> None:
        """Make :meth:`frames` end."""
        self._closed = True
        self._next.release()

    def play(self, frames: int) -> None:
        """Have so many frames worked on. Raises TimeoutError if that does not happen."""
        self._until += frames
        self._next.release()
        if not self._played.acquire(timeout=PATIENCE_S):
            raise TimeoutError(f"the daemon did not come to frame {self._until - 1} within {PATIENCE_S:.0f} s")

    def fall_silent(self, for_ns: int) -> None:
        """Have the next frame be so much later, by its own clock."""
        self._silent_ns += for_ns

    def worked_on(self, index: int) -> None:
        """Take note, on the worker's thread, that a frame is done with."""
        (self._next if index + 1 < self._until else self._played).release()


class TellingWatcher(Watcher):
    """The daemon's own watcher, which also tells the source that a frame was worked on."""

    def __init__(self, source: LockStepSource) -> None:
        super().__init__()
        self._source = source
        self.results = 0

    def __call__(self, frame: TouchFrame) -> None:
        """Take note of a result: that of a frame, or that none came."""
        super().__call__(frame)
        self.results += 1
        if frame.state is not State.NO_FRAMES:
            self._source.worked_on(frame.index)
