"""The stage of the hands: who and what is over one surface, and whose every fingertip is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from touchd.hands.arms import ArmTracker
from touchd.hands.clearing import cleared
from touchd.hands.islands import IslandWatch
from touchd.hands.ledges import Ledges
from touchd.hands.limb import Limb
from touchd.hands.lookout import Lookout
from touchd.hands.people import People
from touchd.hands.settings import ObjectSettings
from touchd.hands.standing import Horizon, Standing
from touchd.hands.things import ThingTracker
from touchd.hands.thumbs import FINGERS, Thumbs, thumb_side
from touchd.hands.whose import Owners, arm_at, label_at
from touchd.model import (
    COARSE_PX,
    CoarsePicture,
    Contact,
    Cursor,
    Floats,
    Hand,
    Hover,
    Image16,
    Mask,
    Slide,
    TableObject,
    Unseen,
)

_SAMPLED = (slice(COARSE_PX // 2, None, COARSE_PX), slice(COARSE_PX // 2, None, COARSE_PX))
_AROUND_MM = 13.0  # what stands so near to a touch point is its finger
_REACHED_MM = 150.0  # an arm so near to a touch in one picture may be over it in the next


@dataclass(frozen=True, slots=True)
class FirstIds:
    """The ids that the next hand, person and thing get."""

    hand: int
    person: int
    thing: int


FIRST_IDS = FirstIds(1, 1, 1)


class HandStage:
    """Knows hands, people and things over one surface. Pictures are given in the order of their times."""

    def __init__(self, lookout: Lookout, settings: ObjectSettings, first: FirstIds = FIRST_IDS) -> None:
        self.lookout = lookout
        self._horizon = Horizon(lookout)
        self._arms = ArmTracker(lookout)
        self._people = People(lookout, first.hand, first.person)
        self._islands = IslandWatch(lookout)
        self._things = ThingTracker(lookout, self._horizon, settings, first.thing)
        self._ledges = Ledges(lookout, self._horizon.level_mm)
        self._cursors, self._hovers, self._thumbs = Owners(), Owners(), Thumbs()
        self._around_px = self.lookout.px(_AROUND_MM)
        self._reached_px = self.lookout.px(_REACHED_MM)
        self._standing: Standing | None = None

    @property
    def next_ids(self) -> FirstIds:
        """Where a stage for another surface is to go on counting."""
        return FirstIds(self._people.next_hand, self._people.next_number, self._things.next_id)

    def end_all(self) -> None:
        """Forget all hands, because no pictures came for a while; things still lie where they did."""
        self._arms = ArmTracker(self.lookout)
        self._standing = None

    def adopt(self, settings: ObjectSettings) -> None:
        """Go on under other settings."""
        self._things.adopt(settings)

    @property
    def restless(self) -> bool:
        """Whether the next picture must be seen before touches are: there is something that may be no hand."""
        things = any(not thing.taken for thing in self._things.things)
        return things or self._islands.waits or any(not arm.way.led for arm in self._arms.arms)

    def see(self, picture: CoarsePicture, t_ns: int, joined: Mask | None = None, slides: Sequence[Slide] = ()) -> None:
        """Take in one picture; what the other methods say is about it.

        ``joined`` (H, W): where things have become part of the surface by now; ``slides``: which of them were pushed.
        """
        standing = self._horizon.find(picture, self._things.levels_mm)
        free = self._arms.step(standing, t_ns)
        islands = self._islands.step(free, standing, t_ns)
        for slide in slides:
            self._things.slide(slide.before[_SAMPLED], slide.now[_SAMPLED], t_ns)
        of_arms = {label for arm in self._arms.arms for label in arm.labels}
        self._things.step(islands.still, picture, standing, of_arms, None if joined is None else joined[_SAMPLED], t_ns)
        if standing is not None:
            for part in islands.walking:
                self._arms.adopt(part, standing, t_ns)
        self._people.step(self._arms.arms, t_ns)
        self._ledges.see(standing)
        self._standing = standing

    def cleared(self, raw: Image16, reference: Floats) -> Image16:
        """Return the picture (H, W) without things that the surface, which reads ``reference``, has not taken in."""
        return cleared(raw, reference, self._things.patches)

    def admitted(self, contacts: Sequence[Contact]) -> list[Contact]:
        """Return the contacts that may be a hand's: none on things, and those on what is no hand begin no touch."""
        judged = (self._judged(contact) for contact in contacts)
        return [contact for contact in judged if contact is not None]

    def due(self, t_ns: int) -> Mask | None:
        """Return where (H, W) the surface is to take in what has been lying there for long enough; None for nowhere.

        It is said once, and again if it did not happen for long.
        """
        mask = self._things.due(t_ns)
        if mask is None:
            return None
        size = mask.shape[1] * COARSE_PX, mask.shape[0] * COARSE_PX
        large: Mask = np.asarray(cv2.resize(mask.view(np.uint8), size, interpolation=cv2.INTER_NEAREST)) > 0
        return large

    def under_others(self, unseen: Unseen, cursors: Sequence[Cursor]) -> Unseen:
        """Return the same with those hidden touches alone that are under another hand's arm.

        What a hand hides under itself it may have lifted. ``cursors``: the touches, in the order of their count.
        """
        if not unseen.hidden:
            return unseen
        hidden = (i for i, cursor in enumerate(cursors) if i in unseen.hidden and self._is_under_another(cursor))
        return replace(unseen, hidden=frozenset(hidden))

    def owned(
        self, cursors: Sequence[Cursor], hovers: Sequence[Hover], hidden_ids: frozenset[int] = frozenset()
    ) -> tuple[tuple[Cursor, ...], tuple[Hover, ...]]:
        """Return fingertips, each with its hand; they tell left hands from right ones, too.

        ``hidden_ids``: the touches over which something else stands, which stay whose they were.
        """
        living = self._living
        at = {c.session_id: None if c.session_id in hidden_ids else self._hand_at(c.x, c.y) for c in cursors}
        of_cursors = self._cursors.settle(at, living)
        of_hovers = self._hovers.settle({h.hover_id: self._hand_at(h.x, h.y) for h in hovers}, living)
        owned = (
            tuple(replace(cursor, hand=of_cursors[cursor.session_id]) for cursor in cursors),
            tuple(replace(hover, hand=of_hovers[hover.hover_id]) for hover in hovers),
        )
        self._thumbs.step({hand: self._thumb_side(limb, hand, *owned) for hand, limb in self._named()})
        return owned

    def _thumb_side(self, limb: Limb, hand: int, cursors: Sequence[Cursor], hovers: Sequence[Hover]) -> str | None:
        tips = [(cursor.x, cursor.y) for cursor in cursors if cursor.hand == hand]
        tips += [(hover.x, hover.y) for hover in hovers if hover.hand == hand]
        if len(tips) != FINGERS:
            return None
        width_mm, depth_mm = self.lookout.area_mm
        begin, end = self.lookout.under(limb.door, 0.0), self.lookout.under(limb.middle, limb.height_mm)
        ahead = (end[0] - begin[0]) * width_mm, (end[1] - begin[1]) * depth_mm
        return thumb_side([(x * width_mm, y * depth_mm) for x, y in tips], ahead)

    @property
    def hands(self) -> tuple[Hand, ...]:
        """The hands over the surface, in the order of their ids."""
        hands = (self._hand(hand_id, limb) for hand_id, limb in self._named())
        return tuple(sorted(hands, key=lambda hand: hand.hand_id))

    @property
    def objects(self) -> tuple[TableObject, ...]:
        """The things that lie on the surface, in the order of their ids."""
        things = (thing for thing in self._things.things if not thing.is_edge)
        return tuple(TableObject(thing.object_id, thing.outline, thing.height_mm) for thing in things)

    @property
    def _living(self) -> set[int]:
        return {hand_id for hand_id, _ in self._named()}

    def _named(self) -> list[tuple[int, Limb]]:
        """Return the limbs of the hands that have ids."""
        named = ((self._people.hand_of(arm), arm.limb) for arm in self._arms.arms)
        return [(hand_id, limb) for hand_id, limb in named if hand_id is not None]

    def _hand(self, hand_id: int, limb: Limb) -> Hand:
        x, y = self.lookout.under(limb.middle, limb.height_mm)
        side = self._thumbs.side_of(hand_id) or self._people.side_of(hand_id)
        return Hand(hand_id, x, y, limb.height_mm, side, self._people.person_of(hand_id))

    def _is_under_another(self, cursor: Cursor) -> bool:
        own, place = self._cursors.hand_of(cursor.session_id), self.lookout.place_of(cursor.x, cursor.y)
        others = (arm for arm in self._arms.arms if self._people.hand_of(arm) != own)
        return any(arm.limb.off(place) < self._reached_px for arm in others)

    def _hand_at(self, x: float, y: float) -> int | None:
        arm = arm_at(self.lookout.place_of(x, y), self._standing, self._arms.arms, self._around_px)
        return None if arm is None else self._people.hand_of(arm)

    def _judged(self, contact: Contact) -> Contact | None:
        """Return a contact as far as it may be a fingertip's."""
        place = self.lookout.place_of(contact.x, contact.y)
        on_thing = self._things.holds(place)
        label = label_at(place, self._standing, 0.0 if on_thing else self._around_px)
        owners = [arm for arm in self._arms.arms if label in arm.labels]
        if any(arm.way.led for arm in owners) and not self._ledges.holds(place):
            return contact
        if on_thing and not owners:
            return None
        return replace(contact, firm=False) if label else contact


def stage_over(lookout: Lookout, settings: ObjectSettings, before: HandStage | None) -> HandStage:
    """Return the stage over a surface: the one before if it is of the same one, else one that goes on counting."""
    if before is not None and before.lookout is lookout:
        before.adopt(settings)
        return before
    return HandStage(lookout, settings, FIRST_IDS if before is None else before.next_ids)
