"""The synthetic table as a camera: hands over a table with a real sensor's noise, rendered in a process of its own."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from touchd.errors import SourceError
from touchd.geometry import KINECT_SIZE
from touchd.model import AreaCorners, Frame, Sensor
from touchd.sources import synthetic_child
from touchd.sources.frame_ring import FrameRing, Ticket
from touchd.sources.synthetic_child import Order, Pace
from touchd.table.scenarios import CAMERA, area_corners, scenario
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

    def frames(self) -> Iterator[Frame]:
        """Yield frames until closed, from the show's beginning. Raises SourceError if the renderer ends by itself."""
        try:
            with self._rendering() as ring:
                while tickets := ring.wait():
                    self._waiting = None
                    for ticket in self._worthwhile(tickets, ring):
                        yield ring.frame(ticket)
        except OSError as error:
            raise SourceError(f"{self.name}: its renderer cannot be started: {error}; free some memory") from error

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

    @contextmanager
    def _rendering(self) -> Iterator[FrameRing]:
        ring = FrameRing(KINECT_SIZE)
        try:
            process = self._begin(ring)
        finally:
            ring.handed_over()
        with process:
            try:
                yield ring
                if not self._closed:
                    raise SourceError(f"{self.name}: its renderer {_how_it_ended(process)}; start touchd again")
            finally:
                process.kill()
                ring.close()
