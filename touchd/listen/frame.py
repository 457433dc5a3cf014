"""One frame of one profile, in one part or cut into several."""

from collections.abc import Set as AbstractSet
from itertools import pairwise

from touchd.listen.messages import Part, Placed
from touchd.listen.rules import SPLIT_COMPLETE, SPLIT_OWN, Breach


class Frame:
    """The parts of a frame under one fseq. ``excused`` where lost datagrams may explain what seems wrong in it."""

    def __init__(self, first: Part, excused: bool, t_ns: int) -> None:
        self.fseq = first.fseq
        self.excused = excused
        self.t_ns = t_ns
        self.placed: dict[int, Placed] = dict(first.sets)
        self._noun = first.profile.noun
        self._parts = [first]

    @property
    def is_split(self) -> bool:
        """Whether it came in several parts."""
        return len(self._parts) > 1

    @property
    def alive(self) -> set[int]:
        """All session ids that any part lists: those that the sender means to be alive."""
        return {session_id for part in self._parts for session_id in part.alive}

    @property
    def grows(self) -> bool:
        """Whether its parts list more and more: then one that lists too much follows a loss in an earlier frame."""
        alive = sorted((set(part.alive) for part in self._parts), key=len)
        return alive[0] < alive[-1]

    def is_over_at(self, part: Part) -> bool:
        """Return whether ``part``, though under the same fseq, tells anew what this frame has told already."""
        if part in self._parts:  # a copy, as the network may make
            return False
        return not part.sets or not self.placed.keys().isdisjoint(part.sets)

    def add(self, part: Part) -> None:
        """Take a further part, or a copy of one."""
        if part not in self._parts:
            self.placed.update(part.sets)
            self._parts.append(part)

    def left_out(self) -> Breach | None:
        """Return a breach where a part ends cursors that another part lists.

        With a growing alive each part lists more than the one before: that order counts, as the network may
        change the order of arrival.
        """
        parts = sorted(self._parts, key=lambda part: len(part.alive))
        for shorter, longer in pairwise(parts):
            missing = set(shorter.alive) - set(longer.alive)
            if missing:
                found = f"{self._noun} {min(missing)} is not listed in every datagram of a split frame"
                return Breach(SPLIT_OWN, found, self.fseq)
        return None

    def listed_early(self, known: AbstractSet[int]) -> Breach | None:
        """Return a breach where a part lists a cursor, not among the ``known``, that only a later part sets."""
        set_so_far: set[int] = set()
        for part in self._parts:
            set_so_far |= part.sets.keys()
            early = (set(part.alive) - known - set_so_far) & self.placed.keys()
            if early:
                found = f"{self._noun} {min(early)} is listed before the datagram of a split frame that sets it"
                return Breach(SPLIT_COMPLETE, found, self.fseq)
        return None
