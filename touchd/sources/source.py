"""What every source of frames looks like to the daemon."""

from collections.abc import Iterator
from typing import Protocol

from touchd.model import Frame, Sensor, State

PACKET_LOSS_WORTH_TELLING = 0.02  # more than this share: a stall of 100 ms in our own process costs a Kinect 0.01
PACKET_LOSS_REMEDY = (
    "plug it into another USB port, without a hub and away from other cameras; see whether this computer is too busy"
)


class Source(Protocol):
    """A camera, or something that plays one. Used from the capture thread alone, but for :meth:`close`."""

    @property
    def sensor(self) -> Sensor:
        """The camera that the frames come from. Another object than before means another camera."""

    @property
    def identified(self) -> bool:
        """Whether ``sensor`` is known for good; false for a camera that was never there since the start."""

    @property
    def name(self) -> str:
        """What to call it in messages."""

    @property
    def waiting(self) -> str | None:
        """What the source knowingly waits for, in words; None when frames should flow."""

    @property
    def reconnects(self) -> int:
        """How many times the source was lost and found again since it was opened."""

    @property
    def packet_loss(self) -> float | None:
        """Which share of its packets, 0 to 1, was lost lately; None where it knows of none. Read from any thread."""

    def frames(self) -> Iterator[Frame]:
        """Yield frames as they come, waiting for each, until closed. Raises SourceError, also if there are no more."""

    def show(self, state: State, /) -> None:
        """Tell people at the camera how the daemon fares, where it has a light. May be called from any thread."""

    def close(self) -> None:
        """Make :meth:`frames` end soon. May be called from any thread, more than once."""
