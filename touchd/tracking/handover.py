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
    """A fingertip's way so far: the number of its touch or hover, and where it was told to be.

    ``x``, ``y`` in area coordinates, ``height_mm`` above the surface. ``contact`` is what was seen of it last, at
    ``seen_ns``; ``rise_mm_s`` how fast it rose then.
    """

    number: int
    x: float
    y: float
    contact: Contact
    filtered: OneEuro
    seen_ns: int
    rise_mm_s: float = 0.0
    height_mm: float = 0.0

    def expected_mm(self, t_ns: int) -> tuple[float, float]:
        """Return where it should be by a time if it kept its speed."""
        dt_s = (t_ns - self.seen_ns) / 1e9
        return (
            self.contact.x_mm + self.filtered.vx_mm_s * dt_s,
            self.contact.y_mm + self.filtered.vy_mm_s * dt_s,
        )

    def landing_mm_s(self, t_ns: int) -> tuple[float, float]:
        """Return the speed along x and y that is left when it lands now.

        A finger that falls faster than it moves stays where it lands; one that moves twice as fast as it falls goes on.
        """
        vx_mm_s, vy_mm_s = self.filtered.vx_mm_s, self.filtered.vy_mm_s
        fallen_mm_s = self.contact.height_mm / max((t_ns - self.seen_ns) / 1e9, 1e-3)
        fall_mm_s = max(fallen_mm_s, abs(self.rise_mm_s), 1.0)
        share = min(1.0, max(0.0, hypot(vx_mm_s, vy_mm_s) / fall_mm_s - 1.0))
        return share * vx_mm_s, share * vy_mm_s


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
