"""The synthetic table as a camera: hands over a table with a real sensor's noise, rendered in a process of its own."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

from touchd.errors import SourceError
from touchd.geometry import KINECT_SIZE
from touchd.model import AreaCorners, Frame, Sensor, State
from touchd.sources import synthetic_child
from touchd.sources.frame_ring import FrameRing, Ticket
from touchd.sources.synthetic_child import IGNORED, Order, Pace
from touchd.table.scenarios import AREA, CAMERA, area_corners, scenario
from touchd.table.table import table_sensor

_PACKAGES = Path(synthetic_child.__file__).parents[2]


class SyntheticSource:
    """Plays a scenario over and over. The same scenario and seed give the same frames, to the byte.

    A frame's time is its number's share of the show: frame / 30 s. Where a live show's frames could not be made or
    taken in time, numbers are left out; at most ``frame_ring.SLOTS`` frames ever wait.
    """

    def __init__(self, scenario_name: str, seed: int, empty_frames: int, pace: Pace = Pace.LIVE) -> None:
        """``empty_frames``: how many frames show the empty table before the first hand comes, to calibrate on.

        Raises UsageError for an unknown scenario.
        """
        scenario(scenario_name, seed)
        self._scenario = scenario_name
        self._seed = seed
        self._empty_frames = empty_frames
        self._pace = pace
        self._sensor = table_sensor(CAMERA, seed)
        self._waiting: str | None = "the synthetic table is being set up"
        self._changing = threading.Lock()
        self._closed = False
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def sensor(self) -> Sensor:
        """The Kinect over the table."""
        return self._sensor

    @property
    def identified(self) -> bool:
        """True: its sensor is known from the start."""
        return True

    @property
    def name(self) -> str:
        """The table and its seed: its surface is the same whatever scenario is played on it."""
        return f"synthetic table {self._seed}"

    @property
    def waiting(self) -> str | None:
        """What is waited for before the first frame; None afterwards."""
        return self._waiting

    @property
    def area(self) -> AreaCorners:
        """The active area that the scenarios are made for."""
        return area_corners()

    @property
    def area_mm(self) -> tuple[float, float]:
        """The active area's width and height."""
        return AREA.size_mm

    @property
    def reconnects(self) -> int:
        """None so far and ever: it cannot be lost."""
        return 0

    @property
    def packet_loss(self) -> float | None:
        """None: its frames come through memory, whole."""
        return None

    def show(self, state: State) -> None:
        """Do nothing: there is no light."""

    def frames(self) -> Iterator[Frame]:
        """Yield frames until closed, from the show's beginning. Raises SourceError if the renderer ends by itself."""
        ring = self._ring()
        process = self._begin(ring)
        if process is None:
            ring.close()
            return
        with process:
            try:
                while tickets := ring.wait():
                    self._waiting = None
                    for ticket in self._worthwhile(tickets, ring):
                        yield ring.frame(ticket)
                if not self._closed:
                    raise SourceError(f"{self.name}: its renderer {_end_of(process)}; start touchd again")
            finally:
                process.kill()
                ring.close()

    def close(self) -> None:
        """Make :meth:`frames` end at once."""
        with self._changing:
            self._closed = True
            if self._process is not None:
                self._process.kill()

    def _worthwhile(self, tickets: list[Ticket], ring: FrameRing) -> list[Ticket]:
        """Return the frames to hand on: from a live show only the newest; the others' slots are freed."""
        if self._pace is not Pace.LIVE:
            return tickets
        for ticket in tickets[:-1]:
            ring.free(ticket)
        return tickets[-1:]

    def _ring(self) -> FrameRing:
        try:
            return FrameRing(KINECT_SIZE)
        except OSError as error:
            raise SourceError(
                f"{self.name}: there is no memory for its frames: {error.strerror}; free some or raise the limits"
            ) from error

    def _begin(self, ring: FrameRing) -> subprocess.Popen[bytes] | None:
        """Start the renderer; None if closed already."""
        order = Order(self._scenario, self._seed, self._empty_frames, self._pace, ring.ends)
        try:
            with self._changing:
                self._process = None if self._closed else _start(order)
                return self._process
        except OSError as error:
            ring.close()
            raise SourceError(
                f"{self.name}: its renderer {sys.executable} cannot be started: {error.strerror}; free some memory or "
                "raise the limits"
            ) from error
        finally:
            ring.handed_over()


def _start(order: Order) -> subprocess.Popen[bytes]:
    """Start a renderer of this very touchd, wherever it was imported from, safe from a Ctrl-C while it begins."""
    path = os.pathsep.join([str(_PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])])
    # Blocked signals stay blocked in the child until it says itself what to do about them.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, IGNORED)
    try:
        return subprocess.Popen(  # noqa: S603  our own interpreter and module
            [sys.executable, "-P", "-m", synthetic_child.__name__, order.as_argument()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            pass_fds=order.ends.descriptors,
            env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _end_of(process: subprocess.Popen[bytes]) -> str:
    """Return how a renderer ended that was not asked to, with the last line that it wrote."""
    said = process.stderr.read().decode(errors="replace").split("\n") if process.stderr else []
    code = process.wait()
    if code < 0:
        return f"was killed by {signal.Signals(-code).name}"
    last = next((line.strip() for line in reversed(said) if line.strip()), "without a word")
    return f"ended with exit code {code} ({last})"
