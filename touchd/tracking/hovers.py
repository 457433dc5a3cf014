"""Fingertips in the air, followed from frame to frame until they touch, and again when they lift."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import dist, hypot
from operator import attrgetter

from touchd.model import Contact, Hover
from touchd.tracking.filters import OneEuro, smoothing
from touchd.tracking.handover import Air, Ground, Path, same_fingertips
from touchd.tracking.settings import TrackingSettings

_RISE_CUTOFF_HZ = 5.0  # of the speed of rising and sinking: as of the other speeds
_TOUCHING_MM = 12.0  # a fingertip so near to a live touch is the one that touches
_NO_GROUND = Ground()
_ID = attrgetter("hover_id")


@dataclass(frozen=True, slots=True)
class _Track:
    """A fingertip in the air: its way, and the touch it was. One that was not yet seen in the air has the number 0.

    ``velocity``: as told, in area axes a second.
    """

    path: Path
    velocity: tuple[float, float] = (0.0, 0.0)
    session_id: int | None = None


class HoverTracker:
    """Follows fingertips in the air. Their ids count up from 1, apart from those of touches, and are not used again."""

    def __init__(self, settings: TrackingSettings, area_mm: tuple[float, float]) -> None:
        """``area_mm``: the area's width and height, which mm are turned into its axes by."""
        self._settings = settings
        self._area_mm = area_mm
        self._tracks: list[_Track] = []
        self._next_id = 1

    def air(self, contacts: Sequence[Contact]) -> Air:
        """Return what is above the surface, given one frame's fingertips there: for the touches that begin in it."""
        return Air([track.path for track in self._tracks if track.path.number], contacts)

    def step(self, contacts: Sequence[Contact], t_ns: int, ground: Ground = _NO_GROUND) -> tuple[Hover, ...]:
        """Take in one frame's fingertips in the air (in any order) and return those that are followed and seen in it.

        ``ground``: what this frame's touches are. A fingertip that is not seen keeps its id for ``coast_ms``.
        """
        airborne = [contact for contact in sorted(contacts, key=_place) if self._counts(contact, ground.places_mm)]
        tracks = [track for track in self._tracks if track.path.number not in ground.hover_ids]
        tracks += [_lifted(path) for path in ground.ended]
        pairs = same_fingertips([track.path for track in tracks], airborne, self._settings.gate_mm, t_ns)
        followed = {row: self._follow(tracks[row], airborne[column], t_ns) for row, column in pairs}
        taken = {column for _, column in pairs}
        self._tracks = [followed.get(row, track) for row, track in enumerate(tracks)]
        self._tracks = [track for track in self._tracks if self._lasts(track, t_ns)]
        self._tracks += [self._begin(contact, t_ns) for i, contact in enumerate(airborne) if i not in taken]
        seen = (self._told(track) for track in self._tracks if track.path.seen_ns == t_ns)
        return tuple(sorted(seen, key=_ID))

    def end_all(self) -> None:
        """Forget every fingertip; later ones get new ids."""
        self._tracks = []

    def adopt(self, settings: TrackingSettings, area_mm: tuple[float, float]) -> None:
        """Go on under other settings, or on an area of another size."""
        self._settings = settings
        self._area_mm = area_mm

    def _counts(self, contact: Contact, touches_mm: Sequence[tuple[float, float]]) -> bool:
        if contact.height_mm >= self._settings.hover_mm or not (0.0 <= contact.x <= 1.0 and 0.0 <= contact.y <= 1.0):
            return False
        place = contact.x_mm, contact.y_mm
        return all(dist(place, touch) > _TOUCHING_MM for touch in touches_mm)

    def _lasts(self, track: _Track, t_ns: int) -> bool:
        # A touch ends when it has coasted for that long already; then its finger has as long again to be seen.
        longest_ms = self._settings.coast_ms * (1.0 if track.path.number else 2.0)
        return t_ns - track.path.seen_ns <= longest_ms * 1e6

    def _new_id(self) -> int:
        self._next_id += 1
        return self._next_id - 1

    def _begin(self, contact: Contact, t_ns: int) -> _Track:
        filtered = OneEuro(contact.x_mm, contact.y_mm)
        path = Path(self._new_id(), contact.x, contact.y, contact, filtered, t_ns, height_mm=contact.height_mm)
        return _Track(path)

    def _follow(self, track: _Track, contact: Contact, t_ns: int) -> _Track:
        settings, path = self._settings, track.path
        dt_s = max((t_ns - path.seen_ns) / 1e9, 1e-3)
        filtered = path.filtered.moved(contact.x_mm, contact.y_mm, dt_s, settings.min_cutoff_hz, settings.beta_hz_s_mm)
        width, height = self._area_mm
        x, y = _clamp(filtered.x_mm / width), _clamp(filtered.y_mm / height)
        vx, vy = (x - path.x) / dt_s, (y - path.y) / dt_s
        if hypot(vx * width, vy * height) < settings.rest_mm_s:
            vx = vy = 0.0
        rise_mm_s = (contact.height_mm - path.contact.height_mm) / dt_s
        rise_mm_s = path.rise_mm_s + smoothing(_RISE_CUTOFF_HZ, dt_s) * (rise_mm_s - path.rise_mm_s)
        weight = smoothing(settings.min_cutoff_hz + settings.beta_hz_s_mm * abs(rise_mm_s), dt_s)
        height_mm = path.height_mm + weight * (contact.height_mm - path.height_mm)
        number = path.number or self._new_id()
        way = Path(number, x, y, contact, filtered, t_ns, rise_mm_s, height_mm)
        return _Track(way, (vx, vy), track.session_id)

    def _told(self, track: _Track) -> Hover:
        path = track.path
        return Hover(
            path.number,
            path.x,
            path.y,
            path.height_mm,
            vx=track.velocity[0],
            vy=track.velocity[1],
            vz_mm_s=0.0 if abs(path.rise_mm_s) < self._settings.rest_mm_s else path.rise_mm_s,
            session_id=track.session_id,
        )


def _lifted(path: Path) -> _Track:
    """Return the way of a touch that ended, for the hover that it may become."""
    return _Track(replace(path, number=0, contact=replace(path.contact, height_mm=0.0)), session_id=path.number)


def _place(contact: Contact) -> tuple[float, ...]:
    return contact.x_mm, contact.y_mm, contact.height_mm, contact.area_mm2, contact.angle


def _clamp(value: float) -> float:
    return min(1.0, max(0.0, value))
