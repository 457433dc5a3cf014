"""Arms that are none: part of another one (its hand's fingers, its shoulder), what is left of a head, or nowhere."""

from collections.abc import Sequence
from math import dist

import numpy as np

from touchd.hands.arm import Arm
from touchd.hands.claims import nearest
from touchd.hands.limb import Pixels, limbs_of
from touchd.hands.lookout import Lookout
from touchd.hands.standing import Place, Standing

HALF_IN_MM = 140.0  # of an arm; its hand's fingers may come in one by one
_ALL_OF_IT_MM = 95.0  # so near to one arm's middle line is all of a part that shows no other
_OFF_MM = 60.0  # from what stands there, a hand is nowhere
_SAME_HAND_MM = 40.0  # ends that lie so near to each other may be one hand's
_HIDDEN_NS = 500_000_000  # for so long


class Needless:
    """Finds arms to be forgotten, over one surface."""

    def __init__(self, lookout: Lookout, hand_px: float) -> None:
        self._lookout = lookout
        self._hand_px = hand_px
        self._since_ns: dict[int, int] = {}  # when arms began to share their part with no sign of themselves

    def among(self, arms: Sequence[Arm], claims: Sequence[Sequence[int]], standing: Standing, t_ns: int) -> set[int]:
        """Return the keys of those arms, given the labels of the parts that each one is in."""
        labels = [label for own in claims for label in own]
        stubs: set[int] = set()
        hidden: set[int] = set()
        for label in {label for label in labels if labels.count(label) > 1}:
            owners = [arm for arm, own in zip(arms, claims, strict=True) if label in own]
            longest = max(owners, key=lambda arm: arm.longest)
            doors = standing.parts[label].doors
            same = [arm for arm in owners if _same_door(arm, longest, doors)]
            short = self._lookout.px(HALF_IN_MM)
            stubs |= {arm.key for arm in same if arm is not longest and arm.longest < short}
            # One rule at a time, lest two of them leave none of the arms.
            hidden |= self._nowhere(owners, label, standing) or self._hidden(same, label, standing) or self._twice(same)
        self._since_ns = {key: self._since_ns.get(key, t_ns) for key in hidden}
        return stubs | {key for key, since_ns in self._since_ns.items() if t_ns - since_ns > _HIDDEN_NS}

    def _nowhere(self, owners: Sequence[Arm], label: int, standing: Standing) -> set[int]:
        """Return which arms have their hands where nothing of their part is, none if all of them do."""
        columns, rows = standing.places(label)
        off_px = {arm.key: float(np.hypot(columns - arm.limb.tip[0], rows - arm.limb.tip[1]).min()) for arm in owners}
        nowhere = {key for key, off in off_px.items() if off > self._lookout.px(_OFF_MM)}
        return nowhere if len(nowhere) < len(owners) else set()

    def _hidden(self, same: Sequence[Arm], label: int, standing: Standing) -> set[int]:
        """Return which of the arms with one door do not show, if their part looks like a single arm."""
        if len(same) == 1:
            return set()
        columns, rows = standing.places(label)
        alone = Pixels(columns, rows, np.zeros(len(rows), np.intp))
        (single,), _ = limbs_of(alone, standing.picture.heights_mm, [same[0].limb.door], self._hand_px)
        if float(single.away(columns, rows).max()) > self._lookout.px(_ALL_OF_IT_MM):
            return set()
        shown = min(same, key=lambda arm: dist(arm.limb.tip, single.tip))
        return {arm.key for arm in same if arm is not shown}

    def _twice(self, same: Sequence[Arm]) -> set[int]:
        """Return which of the arms with one door end where an older one does."""
        near = self._lookout.px(_SAME_HAND_MM)
        return {
            arm.key
            for arm in same
            if any(other.key < arm.key and dist(other.limb.tip, arm.limb.tip) < near for other in same)
        }


def _same_door(arm: Arm, other: Arm, doors: Sequence[Place]) -> bool:
    return not doors or nearest(doors, arm.limb.door) == nearest(doors, other.limb.door)
