"""A recording played as if it were a camera: at its own clock, over and over."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from touchd.formats.recording import Recording
from touchd.model import Frame, Intrinsics, Sensor, State


class RecordingSource:
    """Plays a recording at its own clock and starts again at its end; times and frame numbers go on rising."""

    def __init__(self, recording: Recording, intrinsics: Intrinsics) -> None:
        """``intrinsics``: those of the recording's sensor, or what the config says instead."""
        self._recording = recording
        self._sensor = replace(recording.sensor, intrinsics=intrinsics)
        self._closed = threading.Event()

    @property
    def sensor(self) -> Sensor:
        """The camera that made the recording."""
        return self._sensor

    @property
    def identified(self) -> bool:
        """True: its sensor is known from the start."""
        return True

    @property
    def name(self) -> str:
        """The recording's folder."""
        return str(self._recording.path)

    @property
    def waiting(self) -> str | None:
        """None: a recording never keeps anyone waiting."""
        return None

    @property
    def reconnects(self) -> int:
        """None so far and ever: it cannot be lost."""
        return 0

    @property
    def packet_loss(self) -> float | None:
        """None: its frames are read from files, whole."""
        return None

    def show(self, state: State) -> None:
        """Do nothing: there is no light."""

    def frames(self) -> Iterator[Frame]:
        """Yield each frame when it is due. Raises RecordingError if a file was damaged meanwhile."""
        begun_ns = time.monotonic_ns()
        count = len(self._recording)
        period_ns = self._recording.times_ns[-1] + usual_interval_ns(self._recording.times_ns)
        lap = 0
        while True:
            for index, offset_ns in enumerate(self._recording.times_ns):
                t_ns = lap * period_ns + offset_ns
                frame = self._recording.read(index)
                due_s = (begun_ns + t_ns - time.monotonic_ns()) / 1e9
                if self._closed.wait(max(0.0, due_s)):
                    return
                yield replace(frame, index=lap * count + index, t_ns=t_ns)
            lap += 1

    def close(self) -> None:
        """Make :meth:`frames` end at once."""
        self._closed.set()


def usual_interval_ns(times_ns: tuple[int, ...]) -> int:
    """Return the median time between frames, a thirtieth of a second if there is only one."""
    gaps = sorted(later - earlier for earlier, later in pairwise(times_ns))
    return gaps[len(gaps) // 2] if gaps else 33_333_333
