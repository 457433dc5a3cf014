"""Which cursor stands for which fingertip, frame by frame."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from touchd.errors import RecordingError
from touchd.lab.scoring.events import Pair, SeenFrame, SeenHand, SeenHover
from touchd.lab.scoring.truth import NOTHING, Outline, Tip, TrueThing, Truth
from touchd.tracking.assignment import assign

# A cursor may stand for a fingertip this near; as far again as the finger moves in this time, so that one that lags
# behind a fast finger is late, not false.
NEAR_MM = 25.0
NEAR_S = 0.05


@dataclass(frozen=True, slots=True)
class Place:
    """A fingertip with its true velocity in mm/s: along the surface, and up from it."""

    tip: Tip
    vx_mm_s: float
    vy_mm_s: float
    rising_mm_s: float

    @property
    def speed_mm_s(self) -> float:
        """How fast it moves along the surface."""
        return hypot(self.vx_mm_s, self.vy_mm_s)


@dataclass(frozen=True, slots=True)
class Match:
    """A cursor, or a hover, that stands for a fingertip, and how far it lies from it: cursor minus truth."""

    cursor: int
    place: Place
    dx_mm: float
    dy_mm: float


@dataclass(frozen=True, slots=True)
class ScoredFrame:
    """One frame's cursors and fingertips, and which belong together.

    ``cursors``: where they are, in mm of the area. ``hover_matches``: which hovers stand for which fingertips in the
    air. ``things`` and ``upset`` are the truth's, the rest is as the program said it, in mm and mm/s.
    """

    index: int
    t_s: float
    cursors: Mapping[int, Pair]
    places: tuple[Place, ...]
    matches: tuple[Match, ...]
    hover_matches: tuple[Match, ...]
    things: tuple[TrueThing, ...]
    upset: str | None
    velocities_mm_s: Mapping[int, Pair]
    owners: Mapping[int, int]
    hovers: Mapping[int, SeenHover]
    hands: Mapping[int, SeenHand]
    objects_mm: tuple[Outline, ...]

    def contacts(self) -> Iterator[Match]:
        """Yield what stands for a finger that touches inside the area, in a frame in which that can be asked for."""
        if self.upset is None:
            yield from (match for match in self.matches if match.place.tip.touching and match.place.tip.inside)


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
        frames.append(_matched(event, places, truth))
    return frames


def _matched(event: SeenFrame, places: tuple[Place, ...], truth: Truth) -> ScoredFrame:
    size_mm, happening = truth.size_mm, truth.happenings.get(event.index, NOTHING)
    cursors = {number: _scaled(at, size_mm) for number, at in event.cursors.items()}
    hovers = {number: _scaled((hover.x, hover.y), size_mm) for number, hover in event.hovers.items()}
    return ScoredFrame(
        index=event.index,
        t_s=event.t_s,
        cursors=cursors,
        places=places,
        matches=_matches(cursors, places),
        hover_matches=_matches(hovers, [place for place in places if not place.tip.touching]) if hovers else (),
        things=happening.things,
        upset=happening.upset,
        velocities_mm_s={number: _scaled(velocity, size_mm) for number, velocity in event.velocities.items()},
        owners=event.owners,
        hovers=event.hovers,
        hands=event.hands,
        objects_mm=tuple(tuple(_scaled(corner, size_mm) for corner in outline) for outline in event.objects),
    )


def _scaled(pair: Pair, size_mm: Pair) -> Pair:
    return (pair[0] * size_mm[0], pair[1] * size_mm[1])


def _place(tip: Tip, around: tuple[SeenFrame, SeenFrame], now_s: float, truth: Truth) -> Place:
    """Return a fingertip with its velocity from the frame before to the one after, as far as it is in them."""
    seen = [(event.t_s, _same(tip, truth.frames[event.index])) for event in around]
    (t0, a), (t1, b) = ((t, other) if other else (now_s, tip) for t, other in seen)
    if t1 <= t0:
        return Place(tip, 0.0, 0.0, 0.0)
    span_s = t1 - t0
    rising = (b.clearance_mm - a.clearance_mm) / span_s
    return Place(tip, (b.x_mm - a.x_mm) / span_s, (b.y_mm - a.y_mm) / span_s, rising)


def _same(tip: Tip, tips: Sequence[Tip]) -> Tip | None:
    """Return the same finger, on the same touch, in another frame."""
    return next((t for t in tips if t.touch == tip.touch and t.finger == tip.finger and t.hand == tip.hand), None)


def _matches(cursors: Mapping[int, Pair], places: Sequence[Place]) -> tuple[Match, ...]:
    ids = sorted(cursors)
    gates = [NEAR_MM + NEAR_S * place.speed_mm_s for place in places]
    limit = max(gates, default=NEAR_MM) ** 2
    ways = [[(cursors[i][0] - place.tip.x_mm, cursors[i][1] - place.tip.y_mm) for i in ids] for place in places]
    choices = [
        [(column, dx * dx + dy * dy) for column, (dx, dy) in enumerate(row) if dx * dx + dy * dy < gate * gate]
        for row, gate in zip(ways, gates, strict=True)
    ]
    return tuple(Match(ids[column], places[row], *ways[row][column]) for row, column in assign(choices, limit))
