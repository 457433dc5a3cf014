"""Whose arms are whose: hands by their ids, which of them are of one person, and which of those is the left one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from touchd.hands.arm import Arm
from touchd.hands.claims import WayIn
from touchd.hands.lookout import Lookout
from touchd.hands.standing import Place

_SHOULDERS_MM = 750.0  # two arms of a person come in at most so far apart on one side of the table,
_CORNER_MM = 350.0  # and so far apart around a corner
_AROUND_MM = 120.0  # so near to a corner an arm may be of either side
_LASTING_NS = 1_500_000_000  # a person without an arm in the picture is remembered for so long
_APART_MM = 110.0  # arms that come in nearer to each other may have crossed
_MOST_ARMS = 2
_HIGH_MM = 250.0  # a head or a shoulder is higher
_SHORT_MM = 40.0  # what never reaches farther in is none
_NEW_NS = 100_000_000  # what has just come in may be one finger of a hand


# The direction, right and down, in which an arm comes in over a side of the table.
Inwards: TypeAlias = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody at the table: the hands in the picture, where one of them came in, and when that was last so."""

    number: int
    hands: tuple[int, ...]
    way: WayIn
    seen_ns: int


class People:
    """Knows who is at one table. The ids of hands and the numbers of people count up and are not used again."""

    def __init__(self, lookout: Lookout, first_hand: int, first_number: int) -> None:
        self._lookout = lookout
        self._people: list[Person] = []
        self._hands: dict[int, int] = {}  # by the keys of their arms
        self._sides: dict[int, str] = {}
        self.next_hand = first_hand
        self.next_number = first_number

    def step(self, arms: Sequence[Arm], t_ns: int) -> None:
        """Take in the arms of a picture."""
        self._name(arms, t_ns)
        doors = {self._hands[arm.key]: arm.way for arm in arms if arm.key in self._hands}
        present = [self._present(person, doors, t_ns) for person in self._people]
        self._people = [person for person in present if person.hands or t_ns - person.seen_ns <= _LASTING_NS]
        known = {hand for person in self._people for hand in person.hands}
        for hand, way in doors.items():
            if hand not in known:
                self._join(hand, way, doors, t_ns)
        self._tell_sides(doors)

    def hand_of(self, arm: Arm) -> int | None:
        """Return the id of an arm's hand, None while it is too new to have one."""
        return self._hands.get(arm.key)

    def person_of(self, hand: int) -> int:
        """Return whose a hand is."""
        return next(person.number for person in self._people if hand in person.hands)

    def side_of(self, hand: int) -> str | None:
        """Return "left" or "right", None where it was never seen."""
        return self._sides.get(hand)

    def _name(self, arms: Sequence[Arm], t_ns: int) -> None:
        """Give ids to hands that are new."""
        self._hands = {arm.key: self._hands[arm.key] for arm in arms if arm.key in self._hands}
        for arm in arms:
            if arm.key not in self._hands and self._is_hand(arm, t_ns):
                self._hands[arm.key] = self.next_hand
                self.next_hand += 1

    def _is_hand(self, arm: Arm, t_ns: int) -> bool:
        """Return whether an arm has been here for a moment, reaches in, and is none of what leans in high above."""
        long = arm.longest >= self._lookout.px(_SHORT_MM)
        return long and t_ns - arm.born_ns >= _NEW_NS and arm.limb.height_mm < _HIGH_MM

    def _present(self, person: Person, doors: dict[int, WayIn], t_ns: int) -> Person:
        hands = tuple(hand for hand in person.hands if hand in doors)
        if not hands:
            return replace(person, hands=())
        return replace(person, hands=hands, way=doors[hands[0]], seen_ns=t_ns)

    def _join(self, hand: int, way: WayIn, doors: dict[int, WayIn], t_ns: int) -> None:
        """Give a new hand to the nearest person who has one to spare, or to a new person."""
        near = []
        for place, person in enumerate(self._people):
            if len(person.hands) < _MOST_ARMS:
                seen = [doors[own] for own in person.hands] or [person.way]
                distance = min(self._share(way, other) for other in seen)
                near.append((distance, place))
        share, place = min(near, default=(2.0, 0))
        if share <= 1.0:
            person = self._people[place]
            self._people[place] = replace(person, hands=(*person.hands, hand), seen_ns=t_ns)
        else:
            self._people.append(Person(self.next_number, (hand,), way, t_ns))
            self.next_number += 1

    def _share(self, a: WayIn, b: WayIn) -> float:
        """Return how far apart two arms come in, of what is most for those of one person."""
        same_side = self._sides_of(a.door) & self._sides_of(b.door)
        limit_mm = _SHOULDERS_MM if same_side else _CORNER_MM
        return self._lookout.apart_mm(a.door, b.door, 0.5 * (a.height_mm + b.height_mm)) / limit_mm

    def _sides_of(self, door: Place) -> set[Inwards]:
        """Return the sides of the table that a door is on: two near a corner."""
        gaps = self._gaps(door)
        nearest, _ = min(gaps)
        return {inwards for gap, inwards in gaps if gap - nearest < self._lookout.px(_AROUND_MM)}

    def _gaps(self, door: Place) -> list[tuple[float, Inwards]]:
        """Return how far a door is from each side of the table, and how one comes in there."""
        window = self._lookout.window
        u, v = door
        return [
            (u - window.left, (1, 0)),
            (window.right - 1 - u, (-1, 0)),
            (v - window.top, (0, 1)),
            (window.bottom - 1 - v, (0, -1)),
        ]

    def _tell_sides(self, doors: dict[int, WayIn]) -> None:
        """Tell the left from the right arm of those people who have both in the picture, once and for all."""
        self._sides = {hand: side for hand, side in self._sides.items() if hand in doors}
        for person in self._people:
            if len(person.hands) < _MOST_ARMS or all(hand in self._sides for hand in person.hands):
                continue
            (a, at_a), (b, at_b) = ((hand, doors[hand].door) for hand in person.hands)
            both = self._sides_of(at_a) & self._sides_of(at_b)
            if len(both) != 1:
                continue
            (inwards,) = both
            # Who looks up the picture has the right arm on its right; a quarter turn from inwards.
            along = (at_b[0] - at_a[0]) * -inwards[1] + (at_b[1] - at_a[1]) * inwards[0]
            if abs(along) > self._lookout.px(_APART_MM):
                self._sides |= {a: "left", b: "right"} if along > 0 else {a: "right", b: "left"}
