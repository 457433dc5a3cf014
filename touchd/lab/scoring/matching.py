"""Which cursor stands for which fingertip, frame by frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from touchd.errors import RecordingError
from touchd.lab.scoring.events import SeenFrame
from touchd.lab.scoring.truth import Tip, Truth
from touchd.tracking.assignment import assign

# A cursor may stand for a fingertip this near; as far again as the finger moves in this time, so that one that lags
# behind a fast finger is late, not false.
NEAR_MM = 25.0
NEAR_S = 0.05


@dataclass(frozen=True, slots=True)
class Place:
    """A fingertip with its true velocity in mm/s."""

    tip: Tip
    vx_mm_s: float
    vy_mm_s: float

    @property
    def speed_mm_s(self) -> float:
        """How fast it moves along the surface."""
        return hypot(self.vx_mm_s, self.vy_mm_s)


@dataclass(frozen=True, slots=True)
class Match:
    """A cursor that stands for a fingertip, and how far it lies from it: cursor minus truth."""

    cursor: int
    place: Place
    dx_mm: float
    dy_mm: float


@dataclass(frozen=True, slots=True)
class ScoredFrame:
    """One frame's cursors and fingertips, and which belong together."""

    index: int
    t_s: float
    cursors: frozenset[int]
    places: tuple[Place, ...]
    matches: tuple[Match, ...]


def matched_frames(events: Sequence[SeenFrame], truth: Truth) -> list[ScoredFrame]:
    """Return the frames from the first tracked one on, each matched.

    Cursors and fingertips (hovering ones as well) are paired one to one, so that the sum of the squared distances is
    least, within 25 mm and what the finger moves in 50 ms. Raises RecordingError for frames that the truth has not.
    """
    first = next((i for i, event in enumerate(events) if event.tracking), len(events))
    tracked = events[first:]
    for event in tracked:
        if event.index >= len(truth.frames):
            raise RecordingError(
                f"the events have a frame {event.index} but the truth has only {len(truth.frames)} frames: score "
                "events of the recording that the truth belongs to"
            )
    frames = []
    for i, event in enumerate(tracked):
        around = (tracked[max(0, i - 1)], tracked[min(len(tracked) - 1, i + 1)])
        places = tuple(_place(tip, around, event.t_s, truth) for tip in truth.frames[event.index])
        matches = _matches(event.cursors, places, truth.size_mm)
        frames.append(ScoredFrame(event.index, event.t_s, frozenset(event.cursors), places, matches))
    return frames


def _place(tip: Tip, around: tuple[SeenFrame, SeenFrame], now_s: float, truth: Truth) -> Place:
    """Return a fingertip with its velocity from the frame before to the one after, as far as it is in them."""
    seen = [(event.t_s, _same(tip, truth.frames[event.index])) for event in around]
    (t0, a), (t1, b) = ((t, other) if other else (now_s, tip) for t, other in seen)
    if t1 <= t0:
        return Place(tip, 0.0, 0.0)
    return Place(tip, (b.x_mm - a.x_mm) / (t1 - t0), (b.y_mm - a.y_mm) / (t1 - t0))


def _same(tip: Tip, tips: Sequence[Tip]) -> Tip | None:
    """Return the same finger, on the same touch, in another frame."""
    return next((t for t in tips if t.touch == tip.touch and t.finger == tip.finger and t.hand == tip.hand), None)


def _matches(
    cursors: Mapping[int, tuple[float, float]], places: Sequence[Place], size_mm: tuple[float, float]
) -> tuple[Match, ...]:
    ids = sorted(cursors)
    gates = [NEAR_MM + NEAR_S * place.speed_mm_s for place in places]
    limit = max(gates, default=NEAR_MM) ** 2
    ways = [
        [(cursors[i][0] * size_mm[0] - p.tip.x_mm, cursors[i][1] * size_mm[1] - p.tip.y_mm) for i in ids]
        for p in places
    ]
    choices = [
        [(column, dx * dx + dy * dy) for column, (dx, dy) in enumerate(row) if dx * dx + dy * dy < gate * gate]
        for row, gate in zip(ways, gates, strict=True)
    ]
    return tuple(Match(ids[column], places[row], *ways[row][column]) for row, column in assign(choices, limit))
