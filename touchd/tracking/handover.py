"""From the air to the surface and back: which fingertip is which, so that none begins anew that was followed."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from touchd.model import Contact
from touchd.tracking.assignment import assign
from touchd.tracking.filters import OneEuro

# Farther from where it was expected, in mm, a fingertip is another one: neighbouring fingers are about 20 mm apart.
_SAME_MM = 25.0


@dataclass(frozen=True, slots=True)
class Path:
    """A fingertip's way so far: the number of its touch or hover, and where it was told to be (area coordinates).

    ``vx``, ``vy``: as told, in area axes a second. ``contact`` is what was seen of it last, at ``seen_ns``.
    ``rise_mm_s``: how fast it rose then.
    """

    number: int
    x: float
    y: float
    vx: float
    vy: float
    contact: Contact
    filtered: OneEuro
    seen_ns: int
    rise_mm_s: float = 0.0

    def expected_mm(self, t_ns: int) -> tuple[float, float]:
        """Return where it should be by a time if it kept its speed."""
        dt_s = (t_ns - self.seen_ns) / 1e9
        return (
            self.contact.x_mm + self.filtered.vx_mm_s * dt_s,
            self.contact.y_mm + self.filtered.vy_mm_s * dt_s,
        )

    def landing_mm_s(self, t_ns: int) -> tuple[float, float]:
        """Return the speed along x and y that is left when it lands now.

        What goes with coming down ends at the surface: a finger that falls faster than it moves stays where it lands.
        """
        vx_mm_s, vy_mm_s = self.filtered.vx_mm_s, self.filtered.vy_mm_s
        speed_mm_s = hypot(vx_mm_s, vy_mm_s)
        fallen_mm_s = self.contact.height_mm / max((t_ns - self.seen_ns) / 1e9, 1e-3)
        left_mm_s = speed_mm_s - max(fallen_mm_s, abs(self.rise_mm_s))
        if left_mm_s <= 0.0:
            return 0.0, 0.0
        return vx_mm_s * left_mm_s / speed_mm_s, vy_mm_s * left_mm_s / speed_mm_s


@dataclass(frozen=True, slots=True)
class Air:
    """What is above the surface: hovers as of the last frame, and the fingertips seen there in this one."""

    paths: Sequence[Path] = ()
    seen: Sequence[Contact] = ()

    def falls(self, landed: Sequence[Contact], t_ns: int) -> list[Path | None]:
        """Return for each contact that begins a touch the hover that it was; None where there was none."""
        if not landed or not self.paths:
            return [None] * len(landed)
        pairs = same_fingertips(self.paths, [*landed, *self.seen], _SAME_MM, t_ns)
        came = {column: self.paths[row] for row, column in pairs}
        return [came.get(column) for column in range(len(landed))]


@dataclass(frozen=True, slots=True)
class Ground:
    """What is on the surface: where the live touches are, which hovers they were, and the touches that just ended."""

    places_mm: Sequence[tuple[float, float]] = ()
    hover_ids: frozenset[int | None] = frozenset()
    ended: Sequence[Path] = ()


def same_fingertips(
    paths: Sequence[Path], contacts: Sequence[Contact], gate_mm: float, t_ns: int
) -> list[tuple[int, int]]:
    """Return pairs (path, contact) of the same fingertip, each no farther than ``gate_mm`` from where it should be."""
    limit = gate_mm**2
    choices = []
    for path in paths:
        x_mm, y_mm = path.expected_mm(t_ns)
        costs = ((i, (c.x_mm - x_mm) ** 2 + (c.y_mm - y_mm) ** 2) for i, c in enumerate(contacts))
        choices.append([(i, cost) for i, cost in costs if cost < limit])
    return assign(choices, limit)
