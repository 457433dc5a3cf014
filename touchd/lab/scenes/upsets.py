"""What upsets the view of the whole surface: drift, a knocked camera, and a camera that sees nothing for a while."""

from dataclasses import dataclass
from enum import StrEnum

NS = 1_000_000


class Upset(StrEnum):
    """Why no touch can be asked for in a frame; the words are part of the truth."""

    KNOCKED = "knocked"
    BLIND = "blind"


@dataclass(frozen=True, slots=True)
class Span:
    """A time on the scene's clock."""

    start_ns: int
    end_ns: int

    def __contains__(self, t_ns: int) -> bool:
        return self.start_ns <= t_ns < self.end_ns

    @staticmethod
    def of_ms(start_ms: float, end_ms: float) -> "Span":
        """Return a time given in ms."""
        return Span(round(start_ms * NS), round(end_ms * NS))


@dataclass(frozen=True, slots=True)
class Drift:
    """Readings that wander off evenly by ``raw`` until ``span_ms`` on the scene's clock, and stay there."""

    raw: float
    span_ms: float

    def at(self, t_ns: int) -> float:
        """Return by how much readings are off at a time."""
        return self.raw * min(max(t_ns / (self.span_ms * NS), 0.0), 1.0)


@dataclass(frozen=True, slots=True)
class Knock:
    """A camera that is turned on the spot from one frame to the next.

    ``upset`` lasts from the knock to when touches are to be found again.
    """

    upset: Span
    turned_deg: tuple[float, float]  # to the right and down


@dataclass(frozen=True, slots=True)
class Upsets:
    """All that upsets a scene. ``blind``: when nothing is seen, and a while after; ``glare``: when light drowns all."""

    drift: Drift | None = None
    knock: Knock | None = None
    blind: tuple[Span, ...] = ()
    glare: Span | None = None

    def at(self, t_ns: int) -> Upset | None:
        """Return what keeps touches from being found at a time."""
        if self.knock is not None and t_ns in self.knock.upset:
            return Upset.KNOCKED
        return Upset.BLIND if any(t_ns in span for span in self.blind) else None


NO_UPSETS = Upsets()
