"""Arms from picture to picture: which part of what stands above the surface is whose, also where arms touch."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import dist

import numpy as np

from touchd.hands.arm import Arm
from touchd.hands.claims import NO_TRACES, Claims, Traces, WayIn
from touchd.hands.limb import Limb, Pixels, limbs_of
from touchd.hands.lookout import Lookout
from touchd.hands.needless import HALF_IN_MM, Needless
from touchd.hands.standing import Part, Place, Standing
from touchd.hands.unattached import upper_end
from touchd.model import Floats

_HAND_MM = 105.0  # from the tip of a hand to where it ends
_LASTING_NS = 300_000_000  # so long an arm is missed before it is gone
_AGAIN_MM = 130.0  # a missed one at most so far from where it was
_OTHER_DOOR_MM = 110.0  # doors of two arms that touch lie farther apart
_OTHER_ARM_MM = 45.0  # from an arm's middle line: what is farther is not it
_CLEAR_MM = 55.0  # what is farther from the middle line of an arm is surely not it
_BRANCH_MM = 100.0  # as long must be what comes in at another door
_OTHER_DOOR_NS = 100_000_000  # and for so long
_CALM_MM, _CALM_NS = 8.0, 300_000_000  # what moves less in so long, and has no arm, is no hand
_FRAGMENT_MM2, _FRAGMENT_OFF_MM = 600.0, 45.0  # a smaller island so near to an arm is a finger's end
_MOST_PIXELS = 900  # of all arms that are looked at


@dataclass(frozen=True, slots=True)
class _OtherDoor:
    """A door at which another arm may have come in that touches one that is known."""

    place: Place
    since_ns: int


class ArmTracker:
    """Follows arms over one surface."""

    def __init__(self, lookout: Lookout) -> None:
        self._lookout = lookout
        self._hand_px = lookout.px(_HAND_MM)
        self._claims = Claims(lookout, self._hand_px)
        self._needless = Needless(lookout, self._hand_px)
        self._traces = NO_TRACES
        self._other_doors: list[_OtherDoor] = []
        self._next_key = 1
        self.arms: tuple[Arm, ...] = ()

    def step(self, standing: Standing | None, t_ns: int) -> list[Part]:
        """Take in one picture; return the islands that belong to no arm."""
        if standing is None:
            self._traces, self.arms = NO_TRACES, tuple(_missed(self.arms, t_ns))
            return []
        claims = self._claimed(standing)
        self._reclaim(claims, standing)
        claims = self._without_needless(claims, standing, t_ns)
        self._follow(claims, standing, t_ns)
        owned = {label for arm in self.arms for label in arm.labels}
        free = [part for part in standing.parts.values() if part.label not in owned]
        for part in free:
            if part.doors and not (self._is_finger(part) or self._rejoin(part, standing)):
                self._begin(part, part.doors[0], standing, t_ns)
        self._watch_doors(standing, t_ns)
        islands = [part for part in free if not (part.doors or self._is_fragment(part, standing))]
        led = [part for part in islands if self._is_arm(part, standing, t_ns)]
        return [part for part in islands if part not in led]

    def adopt(self, part: Part, standing: Standing, t_ns: int) -> None:
        """Take an island for a hand, whose arm nobody sees."""
        self._begin(part, self._nearest_border(standing.centre(part.label)), standing, t_ns)

    def _is_arm(self, island: Part, standing: Standing, t_ns: int) -> bool:
        """Return whether an island shows by itself that it is an arm, or has one; it is followed from now on then."""
        upper = upper_end(island.label, standing, self._lookout)
        if upper is not None:
            limb = self._limb(*standing.places(island.label), upper, standing)
            self._add(limb, island, t_ns, led=True)
        elif self._claims.is_sleeved(island.label, standing):
            self.adopt(island, standing, t_ns)
        else:
            return False
        return True

    def _claimed(self, standing: Standing) -> list[list[int]]:
        """Return for each arm the labels of the parts that it is in."""
        overlaps = self._traces.overlaps(standing)
        claims: list[list[int]] = []
        for arm in self.arms:
            if arm.key in overlaps:
                claims.append(self._claims.of(arm.limb, *overlaps[arm.key], standing))
            else:
                # What was not missed in the last picture began in it, and left no traces yet.
                is_new = bool(arm.labels) and arm.way.connected
                claims.append(self._claims.at_door(arm.limb, standing) if is_new else [])
        return claims

    def _reclaim(self, claims: Sequence[list[int]], standing: Standing) -> None:
        """Give arms that are missed the part nearest to where they were that is nobody's."""
        owned = {label for labels in claims for label in labels}
        limit = self._lookout.px(_AGAIN_MM)
        for arm, labels in zip(self.arms, claims, strict=True):
            if not labels:
                free = [part for label, part in standing.parts.items() if label not in owned]
                distance, label = min(
                    ((self._apart(arm.limb, part, standing), part.label) for part in free), default=(limit, 0)
                )
                if distance < limit:
                    labels.append(label)
                    owned.add(label)

    def _without_needless(self, claims: Sequence[list[int]], standing: Standing, t_ns: int) -> list[list[int]]:
        """Forget arms that are one with another, and return the claims of the others."""
        needless = self._needless.among(self.arms, claims, standing, t_ns)
        kept = [(arm, labels) for arm, labels in zip(self.arms, claims, strict=True) if arm.key not in needless]
        self.arms = tuple(arm for arm, _ in kept)
        return [labels for _, labels in kept]

    def _follow(self, claims: Sequence[list[int]], standing: Standing, t_ns: int) -> None:
        """Move the arms to where their parts are; those that are no hands any more are let go."""
        held = [(arm, labels) for arm, labels in zip(self.arms, claims, strict=True) if labels]
        pixels, numbers = _divided(held, standing)
        held = [held[number] for number in numbers]
        ways = [self._claims.way_in(arm.limb.door, labels, standing) for arm, labels in held]
        limbs, at_hand = limbs_of(pixels, standing.picture.heights_mm, [way.door for way in ways], self._hand_px)
        flat = (pixels.rows * np.float32(standing.labels.shape[1]) + pixels.columns).astype(np.intp)
        self._traces = Traces(tuple(arm.key for arm, _ in held), flat, pixels.whose, at_hand)
        followed = [
            self._moved(arm, labels, self._believable(arm, labels, limb, held), way, standing, t_ns)
            for (arm, labels), limb, way in zip(held, limbs, ways, strict=True)
        ]
        kept = [arm for arm in followed if arm.way.led or t_ns - arm.calm_ns < _CALM_NS]
        ids = {arm.key for arm in followed}
        missed = _missed([arm for arm in self.arms if arm.key not in ids], t_ns)
        self.arms = tuple(sorted([*kept, *missed], key=lambda arm: arm.key))

    def _believable(self, arm: Arm, labels: Sequence[int], seen: Limb, held: Sequence[tuple[Arm, list[int]]]) -> Limb:
        """Return a limb as it is seen, but for one whose end cannot be told from an arm that it touches.

        That one is taken to be where it was.
        """
        others = [other.limb for other, own in held if other is not arm and not set(labels).isdisjoint(own)]
        if not others:
            return seen
        clear = all(other.beside(seen.tip) > self._lookout.px(_CLEAR_MM) for other in others)
        return seen if clear else replace(arm.limb, door=seen.door)

    def _moved(self, arm: Arm, labels: Sequence[int], limb: Limb, way: WayIn, standing: Standing, t_ns: int) -> Arm:
        # What is no arm after all has no hand: its farthest corner is now this one, now that.
        place = limb.middle if way.led else standing.centre(labels[0])
        calm = dist(place, arm.calm_at) < self._lookout.px(_CALM_MM)
        calm_at, calm_ns = (arm.calm_at, arm.calm_ns) if calm else (place, t_ns)
        longest = max(arm.longest, limb.reach)
        return Arm(arm.key, arm.born_ns, t_ns, limb, tuple(labels), way, longest, calm_at, calm_ns)

    def _rejoin(self, part: Part, standing: Standing) -> bool:
        """Return whether what comes in is the arm of a hand that is known already; it is added to it then."""
        for arm in self.arms:
            door, whole = part.doors[0], arm.way.connected or not arm.labels
            if not whole and not self._claims.is_left(part.label, arm.labels[0], door, standing):
                way = WayIn(door, 0.0, connected=True, led=True)
                self._put(replace(arm, limb=replace(arm.limb, door=door), labels=(*arm.labels, part.label), way=way))
                return True
        return False

    def _is_finger(self, part: Part) -> bool:
        """Return whether what comes in is another finger of a hand that is only half in; it is added to it then."""
        beside, short = self._lookout.px(_OTHER_DOOR_MM), self._lookout.px(HALF_IN_MM)
        for arm in self.arms:
            if arm.labels and arm.limb.reach < short and dist(part.doors[0], arm.limb.door) < beside:
                self._put(replace(arm, labels=(*arm.labels, part.label)))
                return True
        return False

    def _is_fragment(self, part: Part, standing: Standing) -> bool:
        """Return whether an island is the end of a finger of an arm; it is added to it then."""
        if part.pixels * self._lookout.pixel_mm**2 > _FRAGMENT_MM2:
            return False
        centre = standing.centre(part.label)
        near = [(arm.limb.off(centre), arm.key, arm) for arm in self.arms if arm.labels]
        off, _, arm = min(near, default=(0.0, 0, None))
        if arm is None or off > self._lookout.px(_FRAGMENT_OFF_MM):
            return False
        self._put(replace(arm, labels=(*arm.labels, part.label)))
        return True

    def _put(self, changed: Arm) -> None:
        self.arms = tuple(changed if arm.key == changed.key else arm for arm in self.arms)

    def _begin(self, part: Part, door: Place, standing: Standing, t_ns: int) -> None:
        limb = self._limb(*standing.places(part.label), door, standing)
        self._add(limb, part, t_ns, led=bool(part.doors))

    def _add(self, limb: Limb, part: Part, t_ns: int, led: bool) -> None:
        way = WayIn(limb.door, 0.0, connected=bool(part.doors), led=led)
        arm = Arm(self._next_key, t_ns, t_ns, limb, (part.label,), way, limb.reach, limb.middle, t_ns)
        self.arms = (*self.arms, arm)
        self._next_key += 1

    def _limb(self, columns: Floats, rows: Floats, door: Place, standing: Standing) -> Limb:
        alone = Pixels(columns, rows, np.zeros(len(rows), np.intp))
        (limb,), _ = limbs_of(alone, standing.picture.heights_mm, [door], self._hand_px)
        return limb

    def _watch_doors(self, standing: Standing, t_ns: int) -> None:
        """Tell arms that touched a known one from the moment on that they came in."""
        apart, before = self._lookout.px(_OTHER_DOOR_MM), self._other_doors
        self._other_doors = []
        for part in standing.parts.values():
            owners = [arm for arm in self.arms if part.label in arm.labels]
            for door in part.doors if owners else ():
                if any(dist(door, arm.limb.door) < apart for arm in owners):
                    continue
                since = min((d.since_ns for d in before if dist(d.place, door) < apart), default=t_ns)
                if t_ns - since < _OTHER_DOOR_NS or not self._branch(part, door, owners, standing, t_ns):
                    self._other_doors.append(_OtherDoor(door, since))

    def _branch(self, part: Part, door: Place, owners: Sequence[Arm], standing: Standing, t_ns: int) -> bool:
        """Begin an arm with what of a part is far from the arms that are known; return whether there is enough."""
        columns, rows = standing.places(part.label)
        off = np.min([arm.limb.away(columns, rows) for arm in owners], axis=0)
        far = (off > self._lookout.px(_OTHER_ARM_MM)).nonzero()[0]
        if not far.size:
            return False
        limb = self._limb(columns[far], rows[far], door, standing)
        ends_beside = any(arm.limb.beside(limb.tip) < self._lookout.px(_CLEAR_MM) for arm in owners)
        if limb.reach < self._lookout.px(_BRANCH_MM) or ends_beside:
            return False
        self._add(limb, part, t_ns, led=True)
        return True

    def _apart(self, limb: Limb, part: Part, standing: Standing) -> float:
        """Return how far a part is from where an arm was: its door from the arm's, or an island from the hand."""
        if part.doors:
            return min(dist(door, limb.door) for door in part.doors)
        upper = upper_end(part.label, standing, self._lookout)
        return dist(standing.centre(part.label), limb.middle) if upper is None else dist(upper, limb.door)

    def _nearest_border(self, place: Place) -> Place:
        window = self._lookout.window
        u, v = place
        sides = (window.left, v), (window.right - 1, v), (u, window.top), (u, window.bottom - 1)
        nearest = min(sides, key=lambda at: dist(at, place))
        return float(nearest[0]), float(nearest[1])


def _missed(arms: Sequence[Arm], t_ns: int) -> list[Arm]:
    """Return the arms that are kept though no picture shows them."""
    return [replace(arm, labels=()) for arm in arms if t_ns - arm.seen_ns <= _LASTING_NS]


def _divided(held: Sequence[tuple[Arm, Sequence[int]]], standing: Standing) -> tuple[Pixels, list[int]]:
    """Return the pixels of arms that are in parts, and which arms have any: they are counted through those.

    Where arms share a part, a pixel is of the one whose middle line is nearest.
    """
    owners: dict[int, list[int]] = {}
    for number, (_, labels) in enumerate(held):
        for label in labels:
            owners.setdefault(label, []).append(number)
    some = slice(None, None, 1 + len(standing.whose) // _MOST_PIXELS)
    seen = standing.whose[some]
    first = np.full(standing.count, -1, np.intp)
    for label, numbers in owners.items():
        first[label] = numbers[0]
    whose = first.take(seen)
    columns, rows = standing.columns[some].astype(np.float32), standing.rows[some].astype(np.float32)
    for label, numbers in owners.items():
        if len(numbers) > 1:
            at = (seen == label).nonzero()[0]
            away = [held[number][0].limb.away(columns[at], rows[at]) for number in numbers]
            whose[at] = np.array(numbers)[np.argmin(away, axis=0)]
    kept = (whose >= 0).nonzero()[0]
    present = np.flatnonzero(np.bincount(whose[kept], minlength=len(held)))
    again = present.searchsorted(whose[kept])
    return Pixels(columns[kept], rows[kept], again), present.tolist()
