"""From contacts in single frames to touches with ids that hold."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

from touchd.model import Contact, Cursor, Unseen
from touchd.tracking.assignment import assign
from touchd.tracking.filters import OneEuro
from touchd.tracking.handover import Air, Ground, Path
from touchd.tracking.settings import TrackingSettings

_FRAME_S = 1.0 / 30.0
_WIDEST_GATE = 3.0  # times gate_mm, after frames were missing
# Times gate_mm where a touch has been seen but once: a finger may land at a speed that is not known yet.
_FIRST_GATE = 1.5
# Of the way that a touch goes in a frame: so much farther off it may be seen, for it may turn, and speeds lag behind.
_TURNS = 0.5
# A touch slower than this stays where it is while its contact is missing: the last pixels of a lifted finger wander.
_COASTS_ABOVE_MM_S = 200.0
# Of gate_mm: how near to a touch's last or expected place a lifted finger must be seen to be its own.
_LIFTED_SHARE = 0.2
# A finger that hardly moves is waited for so long while an arm hides it: one that reaches across is gone by then.
_WAITS_BELOW_MM_S, _WAITS_NS = 60.0, 500_000_000
_STANDING_SHARE = 2.3  # of coast_ms, that a touch outlives its contact where something like its finger is still seen
_NOTHING = Air()
_ALL_SEEN = Unseen()


@dataclass(frozen=True, slots=True)
class Track:
    """A live touch: what was last seen of it, where it is now, and the cursor that says so.

    ``once``: whether only one picture has shown it, in the air or on the surface, so that its speed is not known.
    ``hidden_ns``: when it was last hidden by something above it.
    """

    cursor: Cursor
    contact: Contact  # the last one that belonged to it
    filtered: OneEuro
    seen_ns: int
    once: bool = False
    hidden_ns: int | None = None

    def expected_mm(self, t_ns: int) -> tuple[float, float]:
        """Return where the touch should be by now if it kept its speed."""
        dt_s = (t_ns - self.seen_ns) / 1e9
        return (
            self.contact.x_mm + self.filtered.vx_mm_s * dt_s,
            self.contact.y_mm + self.filtered.vy_mm_s * dt_s,
        )

    @property
    def speed_mm_s(self) -> float:
        """How fast it moves, smoothed."""
        return math.hypot(self.filtered.vx_mm_s, self.filtered.vy_mm_s)

    @property
    def seen_mm(self) -> tuple[float, float]:
        """Where its fingertip was seen last: its place without its aim."""
        return self.contact.x_mm - self.contact.aim_mm[0], self.contact.y_mm - self.contact.aim_mm[1]

    def expected_seen_mm(self, t_ns: int) -> tuple[float, float]:
        """Return the same without its aim: where its fingertip should be seen."""
        x_mm, y_mm = self.expected_mm(t_ns)
        return x_mm - self.contact.aim_mm[0], y_mm - self.contact.aim_mm[1]


class Tracker:
    """Follows contacts. Session ids count up, from 1 unless another tracker went before, and are never used again."""

    def __init__(self, settings: TrackingSettings, area_mm: tuple[float, float], first_session_id: int = 1) -> None:
        """``area_mm``: the area's width and height, which mm are turned into TUIO's axes by."""
        self._settings = settings
        self._area_mm = area_mm
        self._tracks: list[Track] = []
        self._ended: list[Track] = []
        self._next_id = first_session_id
        self._now_ns = 0

    def step(
        self,
        contacts: Sequence[Contact],
        t_ns: int,
        lifted_mm: Sequence[tuple[float, float]] = (),
        air: Air = _NOTHING,
        unseen: Unseen = _ALL_SEEN,
    ) -> tuple[Cursor, ...]:
        """Take in one frame's contacts (in any order) and return the touches that are alive after it.

        ``lifted_mm``: places (x, y) where a finger was seen off the surface; a touch there ends at once. ``air``: what
        hovered, as a touch goes on with the way of the hover that it was. ``unseen``: which of the touches in the order
        of :meth:`expected_mm` may go on though they have no contact.
        """
        ordered = sorted(contacts, key=_place)
        pairs = self._match(ordered, t_ns)
        followed = {row: self._follow(self._tracks[row], ordered[column], t_ns) for row, column in pairs}
        missed = {
            row: self._missed(row, t_ns, lifted_mm, unseen) for row in range(len(self._tracks)) if row not in followed
        }
        kept = [followed.get(row) or missed.get(row) for row in range(len(self._tracks))]
        taken = {column for _, column in pairs}
        fresh = [c for column, c in enumerate(ordered) if column not in taken and self._may_begin(c)]
        self._ended = [track for track, now in zip(self._tracks, kept, strict=True) if now is None]
        self._tracks = [track for track in kept if track is not None and self._in_reach(track)]
        fallen = air.falls(fresh, t_ns)
        self._tracks += [self._begin(contact, path, t_ns) for contact, path in zip(fresh, fallen, strict=True)]
        self._now_ns = t_ns
        return self.cursors

    def expected_mm(self, t_ns: int) -> list[tuple[float, float]]:
        """Return where in the area the live touches should be seen by a time, in the order of their session ids."""
        return [track.expected_seen_mm(t_ns) for track in self._tracks]

    @property
    def cursors(self) -> tuple[Cursor, ...]:
        """The live touches as of the last frame, in the same order."""
        return tuple(track.cursor for track in self._tracks)

    @property
    def hidden_ids(self) -> frozenset[int]:
        """The session ids of those that were waited for in the last frame because something hid them."""
        return frozenset(track.cursor.session_id for track in self._tracks if track.hidden_ns == self._now_ns)

    @property
    def ground(self) -> Ground:
        """Where in the area the live touches were seen last, which hovers they were, and what ended in this frame."""
        return Ground(
            [(track.contact.x_mm, track.contact.y_mm) for track in self._tracks],
            frozenset(track.cursor.hover_id for track in self._tracks),
            [_path(track) for track in self._ended],
        )

    @property
    def next_session_id(self) -> int:
        """The id that the next touch will get."""
        return self._next_id

    def end_all(self) -> None:
        """End every touch; later ones get new ids."""
        self._tracks = []
        self._ended = []

    def adopt(self, settings: TrackingSettings, area_mm: tuple[float, float]) -> None:
        """Go on under other settings, or on an area of another size, without ending a touch."""
        self._settings = settings
        self._area_mm = area_mm

    def _match(self, contacts: list[Contact], t_ns: int) -> list[tuple[int, int]]:
        """Return pairs (track, contact); ``contacts`` are in the order of x_mm."""
        late_s = max((t_ns - self._now_ns) / 1e9, _FRAME_S)
        gate_mm = self._settings.gate_mm * min(late_s / _FRAME_S, _WIDEST_GATE)
        places = [contact.x_mm for contact in contacts]
        limit = gate_mm * gate_mm
        choices = []
        for track in self._tracks:
            x_mm, y_mm = track.expected_mm(t_ns)
            wider = _FIRST_GATE if track.once else 1.0 + _TURNS * track.speed_mm_s * late_s / gate_mm
            near = range(bisect_left(places, x_mm - wider * gate_mm), bisect_right(places, x_mm + wider * gate_mm))
            costs = ((i, ((places[i] - x_mm) ** 2 + (contacts[i].y_mm - y_mm) ** 2) / wider**2) for i in near)
            choices.append([(i, cost) for i, cost in costs if cost < limit])
        return assign(choices, limit)

    def _follow(self, track: Track, contact: Contact, t_ns: int) -> Track:
        dt_s = max((t_ns - track.seen_ns) / 1e9, 1e-3)
        settings = self._settings
        filtered = track.filtered.moved(contact.x_mm, contact.y_mm, dt_s, settings.min_cutoff_hz, settings.beta_hz_s_mm)
        cursor = self._moved(track.cursor, filtered.x_mm, filtered.y_mm, contact, t_ns)
        return Track(cursor, contact, filtered, t_ns)

    def _missed(self, row: int, t_ns: int, lifted_mm: Sequence[tuple[float, float]], unseen: Unseen) -> Track | None:
        """Return one of the touches that has no contact as it goes on, None where it ends."""
        track = self._tracks[row]
        if row in unseen.hidden and track.speed_mm_s < _WAITS_BELOW_MM_S and t_ns - track.seen_ns < _WAITS_NS:
            rest = OneEuro(track.filtered.x_mm, track.filtered.y_mm)
            return self._coast(replace(track, filtered=rest, hidden_ns=t_ns), t_ns)
        coast_ns = self._settings.coast_ms * (_STANDING_SHARE if row in unseen.standing else 1.0) * 1e6
        if t_ns - (track.hidden_ns or track.seen_ns) > coast_ns or self._is_lifted(track, t_ns, lifted_mm):
            return None
        return self._coast(track, t_ns)

    def _coast(self, track: Track, t_ns: int) -> Track:
        if track.speed_mm_s > _COASTS_ABOVE_MM_S:
            x_mm, y_mm = track.expected_mm(t_ns)
        else:
            x_mm, y_mm = track.filtered.x_mm, track.filtered.y_mm
        return replace(track, cursor=self._moved(track.cursor, x_mm, y_mm, track.contact, t_ns))

    def _is_lifted(self, track: Track, t_ns: int, lifted_mm: Sequence[tuple[float, float]]) -> bool:
        """Return whether the finger of a touch without a contact is seen above the surface."""
        near_mm = _LIFTED_SHARE * self._settings.gate_mm
        own_mm = track.expected_seen_mm(t_ns), track.seen_mm
        return any(math.dist(own, place_mm) < near_mm for own in own_mm for place_mm in lifted_mm)

    def _moved(self, last: Cursor, x_mm: float, y_mm: float, seen: Contact, t_ns: int) -> Cursor:
        """Return the cursor at a new place, looking like its contact.

        As TUIO 1.1 defines them, velocity is the way since the last frame in area axes over the time it took, and
        acceleration the change of the velocity's length over the same time.
        """
        dt_s = max((t_ns - self._now_ns) / 1e9, 1e-3)
        width, height = self._area_mm
        x, y = _clamp(x_mm / width), _clamp(y_mm / height)
        vx, vy = (x - last.x) / dt_s, (y - last.y) / dt_s
        if math.hypot(vx * width, vy * height) < self._settings.rest_mm_s:
            vx = vy = 0.0
        accel = (math.hypot(vx, vy) - math.hypot(last.vx, last.vy)) / dt_s
        return replace(
            last,
            x=x,
            y=y,
            vx=vx,
            vy=vy,
            accel=accel,
            height_mm=seen.height_mm,
            area_mm2=seen.area_mm2,
            angle=seen.angle,
            towards=seen.towards,
        )

    def _may_begin(self, contact: Contact) -> bool:
        return contact.firm and 0.0 <= contact.x <= 1.0 and 0.0 <= contact.y <= 1.0

    def _in_reach(self, track: Track) -> bool:
        stray = self._settings.stray_mm
        width, height = self._area_mm
        x_mm, y_mm = track.contact.x_mm, track.contact.y_mm
        return -stray <= x_mm <= width + stray and -stray <= y_mm <= height + stray

    def _begin(self, contact: Contact, path: Path | None, t_ns: int) -> Track:
        """Return a new touch, which goes on from where it hovered if it did."""
        filtered = OneEuro(contact.x_mm, contact.y_mm) if path is None else self._landed(contact, path, t_ns)
        width, height = self._area_mm
        moves = math.hypot(filtered.vx_mm_s, filtered.vy_mm_s) >= self._settings.rest_mm_s
        cursor = Cursor(
            self._next_id,
            _clamp(filtered.x_mm / width),
            _clamp(filtered.y_mm / height),
            vx=filtered.vx_mm_s / width if moves else 0.0,
            vy=filtered.vy_mm_s / height if moves else 0.0,
            accel=0.0,
            height_mm=contact.height_mm,
            area_mm2=contact.area_mm2,
            angle=contact.angle,
            hover_id=None if path is None else path.number,
            towards=contact.towards,
        )
        self._next_id += 1
        return Track(cursor, contact, filtered, t_ns, once=path is None)

    def _landed(self, contact: Contact, path: Path, t_ns: int) -> OneEuro:
        """Return the filter of a touch that was a hover.

        The step from the place that was fitted in the air to that at rest is no motion: the speed is that of the air.
        """
        settings = self._settings
        dt_s = max((t_ns - path.seen_ns) / 1e9, 1e-3)
        place = path.filtered.moved(contact.x_mm, contact.y_mm, dt_s, settings.min_cutoff_hz, settings.beta_hz_s_mm)
        return OneEuro(place.x_mm, place.y_mm, *path.landing_mm_s(t_ns))


def _path(track: Track) -> Path:
    cursor = track.cursor
    return Path(cursor.session_id, cursor.x, cursor.y, track.contact, track.filtered, track.seen_ns)


def _place(contact: Contact) -> tuple[float, ...]:
    return contact.x_mm, contact.y_mm, contact.height_mm, contact.area_mm2, contact.angle, contact.firm


def _clamp(value: float) -> float:
    return min(1.0, max(0.0, value))
