"""Whose finger is whose: whether the hand and the person that a program gives a touch are right."""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

from touchd.lab.scoring.matching import ScoredFrame
from touchd.tracking.assignment import assign

_STAY_S = 0.5  # someone who was gone for longer is someone new to a program


@dataclass(frozen=True, slots=True)
class OwnerScore:
    """How contacts were attributed: each frame of a touching finger that a cursor stands for is one.

    ``contacts``: those of a run in which the program gave any cursor a hand, else 0; ``right_hand``, ``right_person``:
    of those the ones whose hand and person are right. A hand's id stands for one true hand, that with which it shares
    most contacts, and no other id does; the same holds for people. ``sided``: contacts whose hand was said to be left
    or right, ``right_side``: of those the true ones.
    """

    contacts: int = 0
    right_hand: int = 0
    right_person: int = 0
    sided: int = 0
    right_side: int = 0


def owner_score(frames: Sequence[ScoredFrame]) -> OwnerScore:
    """Score whose each contact was said to be."""
    if not any(frame.owners for frame in frames):
        return OwnerScore()
    contacts = sided = right_side = 0
    hands: Counter[tuple[int, Hashable]] = Counter()
    people: Counter[tuple[int, Hashable]] = Counter()
    stays = _Stays()
    for frame in frames:
        true_hands, true_people = stays.step(frame)
        for match in frame.contacts():
            tip = match.place.tip
            contacts += 1
            hand = frame.owners.get(match.cursor)
            if hand is None:
                continue
            hands[hand, true_hands[tip.hand]] += 1
            said = frame.hands.get(hand)
            if said is None:
                continue
            people[said.person, true_people[tip.person]] += 1
            if said.side is not None:
                sided += 1
                right_side += said.side == tip.side
    return OwnerScore(contacts, _agreeing(hands), _agreeing(people), sided, right_side)


class _Stays:
    """Numbers the stays of hands and people: one that was away for a while is another one."""

    def __init__(self) -> None:
        self._last_s: dict[tuple[str, int], float] = {}
        self._stay: dict[tuple[str, int], int] = {}

    def step(self, frame: ScoredFrame) -> tuple[Mapping[int, Hashable], Mapping[int, Hashable]]:
        """Return what stands for each hand and each person that is in a frame."""
        hands = {place.tip.hand for place in frame.places}
        people = {place.tip.person for place in frame.places}
        return (
            {hand: (hand, self._seen("hand", hand, frame.t_s)) for hand in hands},
            {person: (person, self._seen("person", person, frame.t_s)) for person in people},
        )

    def _seen(self, kind: str, number: int, t_s: float) -> int:
        key = kind, number
        if t_s - self._last_s.get(key, -_STAY_S) > _STAY_S:
            self._stay[key] = self._stay.get(key, 0) + 1
        self._last_s[key] = t_s
        return self._stay.setdefault(key, 0)


def _agreeing(shared: Mapping[tuple[int, Hashable], int]) -> int:
    """Return how many contacts agree with the best one to one pairing of ids and true ones."""
    ids = sorted({said for said, _ in shared})
    true = sorted({true for _, true in shared}, key=repr)
    limit = float(max(shared.values(), default=0) + 1)
    choices = [
        [(column, limit - shared[said, one]) for column, one in enumerate(true) if (said, one) in shared]
        for said in ids
    ]
    return sum(shared[ids[row], true[column]] for row, column in assign(choices, limit))
