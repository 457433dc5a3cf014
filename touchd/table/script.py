"""A timeline of hands, with the truth about their fingertips."""

from collections.abc import Sequence
from dataclasses import dataclass

from touchd.geometry import KINECT_SIZE
from touchd.table.actors import Actor
from touchd.table.scene import Area, Hand, TableCamera
from touchd.table.strokes import Stroke, strokes
from touchd.table.truth import HOVERING, TipTruth, in_view, tip_truth


@dataclass(frozen=True, slots=True)
class Moment:
    """What a script shows at one time."""

    hands: tuple[Hand, ...]
    truth: tuple[TipTruth, ...]


class Script:
    """Actors over one area, seen by one camera."""

    def __init__(self, camera: TableCamera, area: Area, actors: Sequence[Actor]) -> None:
        self._camera = camera
        self._area = area
        self._parts = [(actor, strokes(actor, camera)) for actor in actors]
        self._first_tips = _first_tips(self._parts)
        self.end_ns = max((way[-1].end_ns for _, way in self._parts), default=0)

    def at(self, t_ns: int) -> Moment:
        """Return the hands at a time, and the truth about those of their fingertips that are in view."""
        hands: list[Hand] = []
        truth: list[TipTruth] = []
        for which, (actor, way) in enumerate(self._parts):
            stroke = next((s for s in way if s.start_ns <= t_ns < s.end_ns), None)
            if stroke is None:
                continue
            hand = actor.shape(stroke.at(t_ns).pose(actor.grip))
            hands.append(hand)
            first = self._first_tips.get((which, stroke.episode))
            for finger, fingertip in enumerate(hand.fingertips):
                if in_view(self._camera, KINECT_SIZE, fingertip):
                    tip = HOVERING if first is None else first + finger
                    truth.append(tip_truth(self._area, fingertip, tip))
        return Moment(tuple(hands), tuple(truth))


def _first_tips(parts: Sequence[tuple[Actor, list[Stroke]]]) -> dict[tuple[int, int], int]:
    """Return the first tip's number of every (actor, episode), counted in the order of time."""
    begins: dict[tuple[int, int], int] = {}
    for which, (_, way) in enumerate(parts):
        for stroke in way:
            if stroke.episode != HOVERING:
                begins.setdefault((which, stroke.episode), stroke.start_ns)
    numbers: dict[tuple[int, int], int] = {}
    following = 1
    for key in sorted(begins, key=lambda key: (begins[key], key)):
        actor = parts[key[0]][0]
        numbers[key] = following
        following += len(actor.shape(actor.grip).fingertips)
    return numbers
