"""Fingertips in the air, followed from frame to frame until they touch."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

from touchd.model import Contact, Hover
from touchd.tracking.assignment import assign
from touchd.tracking.settings import TrackingSettings

_TOUCHING_MM = 12.0  # a fingertip so near to a live touch is the one that touches


@dataclass(frozen=True, slots=True)
class _Track:
    """A fingertip in the air: what was last seen of it, and when."""

    hover_id: int
    contact: Contact
    seen_ns: int


class HoverTracker:
    """Follows fingertips in the air. Their ids count up from 1, apart from those of touches, and are not used again."""

    def __init__(self, settings: TrackingSettings) -> None:
        self._settings = settings
        self._tracks: list[_Track] = []
        self._next_id = 1

    def step(
        self, contacts: Sequence[Contact], touches_mm: Sequence[tuple[float, float]], t_ns: int
    ) -> tuple[Hover, ...]:
        """Take in one frame's fingertips in the air (in any order) and return those that are followed and seen in it.

        ``touches_mm``: where the live touches are. One that is not seen keeps its id for ``coast_ms``.
        """
        airborne = [contact for contact in sorted(contacts, key=_place) if self._counts(contact, touches_mm)]
        limit = self._settings.gate_mm**2
        choices = [
            [(i, cost) for i, contact in enumerate(airborne) if (cost := _apart(track.contact, contact)) < limit]
            for track in self._tracks
        ]
        pairs = assign(choices, limit)
        followed = {row: _Track(self._tracks[row].hover_id, airborne[column], t_ns) for row, column in pairs}
        lasting = [followed.get(row, track) for row, track in enumerate(self._tracks)]
        taken = {column for _, column in pairs}
        fresh = [contact for i, contact in enumerate(airborne) if i not in taken]
        longest_ns = self._settings.coast_ms * 1e6
        self._tracks = [track for track in lasting if t_ns - track.seen_ns <= longest_ns]
        self._tracks += [_Track(self._next_id + i, contact, t_ns) for i, contact in enumerate(fresh)]
        self._next_id += len(fresh)
        return tuple(
            Hover(track.hover_id, track.contact.x, track.contact.y, track.contact.height_mm)
            for track in self._tracks
            if track.seen_ns == t_ns
        )

    def end_all(self) -> None:
        """Forget every fingertip; later ones get new ids."""
        self._tracks = []

    def adopt(self, settings: TrackingSettings) -> None:
        """Go on under other settings."""
        self._settings = settings

    def _counts(self, contact: Contact, touches_mm: Sequence[tuple[float, float]]) -> bool:
        if contact.height_mm >= self._settings.hover_mm or not (0.0 <= contact.x <= 1.0 and 0.0 <= contact.y <= 1.0):
            return False
        place = contact.x_mm, contact.y_mm
        return all(dist(place, touch) > _TOUCHING_MM for touch in touches_mm)


def _apart(one: Contact, other: Contact) -> float:
    return (one.x_mm - other.x_mm) ** 2 + (one.y_mm - other.y_mm) ** 2


def _place(contact: Contact) -> tuple[float, ...]:
    return contact.x_mm, contact.y_mm, contact.height_mm, contact.area_mm2, contact.angle
