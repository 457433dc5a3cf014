"""Whose a fingertip is: from its place into what stands above the surface there, and steadily over its life."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from touchd.hands.arm import Arm
from touchd.hands.standing import Place, Standing

_STUBBORN = 6  # pictures in which another hand must be seen before a fingertip changes hands


@dataclass(frozen=True, slots=True)
class _Owned:
    """A fingertip's hand, the other one that it lately seemed to be of, and in how many pictures running."""

    hand_id: int
    other: int
    pictures: int


def arm_at(place: Place, standing: Standing | None, arms: Sequence[Arm], around_px: float) -> Arm | None:
    """Return the arm whose finger stands at a place of the coarse picture, or so near to it."""
    label = label_at(place, standing, around_px)
    owners = [arm for arm in arms if label in arm.labels]
    if len(owners) <= 1:
        return owners[0] if owners else None
    return min(owners, key=lambda arm: arm.limb.off(place))


def label_at(place: Place, standing: Standing | None, around_px: float) -> int:
    """Return the label of what stands at a place, or else of what stands most around it; 0 where nothing does."""
    if standing is None:
        return 0
    column, row = round(place[0]), round(place[1])
    rows, columns = standing.labels.shape
    if 0 <= row < rows and 0 <= column < columns and int(standing.labels[row, column]) in standing.parts:
        return int(standing.labels[row, column])
    for reach in (1, max(1, round(around_px))):
        around = standing.labels[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        counts = np.bincount(around.ravel(), minlength=1)
        counts[0] = 0
        label = int(counts.argmax())
        if label in standing.parts:
            return label
    return 0


class Owners:
    """Remembers whose fingertips are, by their ids, for as long as they live."""

    def __init__(self) -> None:
        self._owned: dict[int, _Owned] = {}

    def hand_of(self, tip: int) -> int | None:
        """Return which hand a fingertip was of when it was last asked for."""
        owned = self._owned.get(tip)
        return None if owned is None else owned.hand_id

    def settle(self, seen: Mapping[int, int | None], living: set[int]) -> dict[int, int | None]:
        """Take in which hand each fingertip seems to be of, and return which one it is of.

        ``living``: the ids of the hands that there are.
        """
        owned = {tip: _settled(self._owned.get(tip), hand, living) for tip, hand in seen.items()}
        self._owned = {tip: one for tip, one in owned.items() if one is not None}
        return {tip: None if one is None else one.hand_id for tip, one in owned.items()}


def _settled(before: _Owned | None, hand: int | None, living: set[int]) -> _Owned | None:
    if before is None or before.hand_id not in living:
        return None if hand is None else _Owned(hand, hand, 0)
    if hand is None or hand == before.hand_id:
        return _Owned(before.hand_id, before.hand_id, 0)
    pictures = before.pictures + 1 if hand == before.other else 1
    return _Owned(hand, hand, 0) if pictures >= _STUBBORN else _Owned(before.hand_id, hand, pictures)
