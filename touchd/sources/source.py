"""What every source of frames looks like to the daemon."""

from collections.abc import Iterator
from typing import Protocol

from touchd.model import Frame, Sensor


class Source(Protocol):
    """A camera, or something that plays one. Used from the capture thread alone, but for :meth:`close`."""

    @property
    def sensor(self) -> Sensor:
        """The camera that the frames come from."""

    @property
    def name(self) -> str:
        """What to call it in messages."""

    @property
    def waiting(self) -> str | None:
        """What the source knowingly waits for, in words; None when frames should flow."""

    @property
    def reconnects(self) -> int:
        """How many times the source was lost and found again since it was opened."""

    def frames(self) -> Iterator[Frame]:
        """Yield frames as they come, waiting for each, until closed. Raises SourceError, also if there are no more."""

    def close(self) -> None:
        """Make :meth:`frames` end soon. May be called from any thread, more than once."""
