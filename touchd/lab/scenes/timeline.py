"""The way of a hand through a scene: stances, and the smooth motion from one to the next."""

from dataclasses import dataclass, replace
from enum import Enum, auto
from math import cos, dist, radians, sin, tau

from touchd.table.scene import Place
from touchd.table.vectors import between

_NS = 1_000_000
_RAMP = 0.25  # the share of an even motion in which it gathers speed, and again in which it loses it
_REACH_MS = 170.0  # even the shortest reach takes this long
_REACH_MM_MS = 0.75


@dataclass(frozen=True, slots=True)
class Stance:
    """Where a hand is and how it is held at one time.

    ``lifts_mm`` are the gaps between the fingertips in play and the surface. ``turn_deg`` adds to the heading that
    the arm's direction gives. ``spread`` stretches the way between the fingertips. ``anchor_mm`` and ``heel_mm`` place
    the palm of a hand that rests on its heel, and how high that is over the surface.
    """

    at_mm: Place
    lifts_mm: tuple[float, ...]
    pitch_deg: float
    turn_deg: float = 0.0
    spread: float = 1.0
    anchor_mm: Place = (0.0, 0.0)
    heel_mm: float = 0.0

    def lifted(self, lift_mm: float) -> "Stance":
        """Return the stance with all fingertips in play, and the heel, so high."""
        return replace(self, lifts_mm=(lift_mm,) * len(self.lifts_mm), heel_mm=lift_mm)

    def moved(self, at_mm: Place) -> "Stance":
        """Return the stance elsewhere, its anchor with it."""
        return replace(self, at_mm=at_mm, anchor_mm=at_mm)

    def towards(self, other: "Stance", share: float) -> "Stance":
        """Return the stance a share of the way to another one."""
        return Stance(
            _place(self.at_mm, other.at_mm, share),
            tuple(between(a, b, share) for a, b in zip(self.lifts_mm, other.lifts_mm, strict=True)),
            between(self.pitch_deg, other.pitch_deg, share),
            between(self.turn_deg, other.turn_deg, share),
            between(self.spread, other.spread, share),
            _place(self.anchor_mm, other.anchor_mm, share),
            between(self.heel_mm, other.heel_mm, share),
        )


@dataclass(frozen=True, slots=True)
class Arc:
    """A way around a centre instead of straight on; positive turns are clockwise in the picture."""

    centre_mm: Place
    turns: float

    def moved(self, from_mm: Place, share: float) -> Place:
        """Return the place after a share of the way."""
        angle = tau * self.turns * share
        x_mm, y_mm = from_mm[0] - self.centre_mm[0], from_mm[1] - self.centre_mm[1]
        return (
            self.centre_mm[0] + x_mm * cos(angle) - y_mm * sin(angle),
            self.centre_mm[1] + x_mm * sin(angle) + y_mm * cos(angle),
        )


class Pace(Enum):
    """How the speed of a motion goes."""

    REACH = auto()  # minimum-jerk
    EVEN = auto()  # constant in the middle
    GATHERING = auto()  # from rest to a speed that it ends with
    FADING = auto()  # the other way round


@dataclass(frozen=True, slots=True)
class Leg:
    """The motion from one stance to the next."""

    start_ns: int
    end_ns: int
    begin: Stance
    end: Stance
    pace: Pace = Pace.REACH
    arc: Arc | None = None

    def share(self, t_ns: int) -> float:
        """Return how much of the way is done at a time within the leg."""
        s = (t_ns - self.start_ns) / (self.end_ns - self.start_ns)
        match self.pace:
            case Pace.REACH:
                return s * s * s * (10.0 + s * (6.0 * s - 15.0))
            case Pace.EVEN:
                return _even(s)
            case Pace.GATHERING:
                return _gathering(s)
            case Pace.FADING:
                return 1.0 - _gathering(1.0 - s)

    def at(self, t_ns: int) -> Stance:
        """Return the stance at a time within the leg."""
        share = self.share(t_ns)
        stance = self.begin.towards(self.end, share)
        return stance if self.arc is None else stance.moved(self.arc.moved(self.begin.at_mm, share))

    def rests(self, tip: int) -> bool:
        """Return whether a fingertip stays on the surface all along the leg."""
        return self.begin.lifts_mm[tip] == 0.0 == self.end.lifts_mm[tip]


class Way:
    """Collects the legs of a hand's way, one after the other."""

    def __init__(self, begin: Stance, start_ms: float) -> None:
        self.legs: list[Leg] = []
        self.here = begin
        self._t_ns = round(start_ms * _NS)

    @property
    def now_ms(self) -> float:
        """The time at which the way ends so far."""
        return self._t_ns / _NS

    def go(self, to: Stance, span_ms: float) -> None:
        """Move to a stance in so long, with the speed of a reach."""
        self._add(to, span_ms, Pace.REACH, arc=None)

    def stay(self, span_ms: float) -> None:
        """Do not move."""
        self.go(self.here, span_ms)

    def reach(self, to: Stance) -> None:
        """Move to a stance as fast as people do."""
        self.go(to, _REACH_MS + dist(self.here.at_mm, to.at_mm) / _REACH_MM_MS)

    def draw(self, to: Stance, speed_mm_s: float) -> None:
        """Move straight to a stance, at an even speed but for the beginning and the end."""
        self._add(to, dist(self.here.at_mm, to.at_mm) / speed_mm_s / (1.0 - _RAMP) * 1e3, Pace.EVEN, arc=None)

    def swipe(self, land: Stance, to: Stance, speed_mm_s: float) -> None:
        """Move to a stance, at a speed by then, and through it to another one at which it ends."""
        for stance, pace in ((land, Pace.GATHERING), (to, Pace.FADING)):
            length_mm = dist(self.here.at_mm, stance.at_mm)
            self._add(stance, length_mm / speed_mm_s / (1.0 - 0.5 * _RAMP) * 1e3, pace, arc=None)

    def wait(self, until_ms: float) -> None:
        """Do not move until a time, if it is not over."""
        left_ms = until_ms - self.now_ms
        if left_ms > 0.0:
            self.stay(left_ms)

    def circle(self, centre_mm: Place, turns: float, speed_mm_s: float) -> None:
        """Move around a centre, at an even speed but for the beginning and the end."""
        arc = Arc(centre_mm, turns)
        length_mm = tau * abs(turns) * dist(self.here.at_mm, centre_mm)
        end = self.here.moved(arc.moved(self.here.at_mm, 1.0))
        self._add(end, length_mm / speed_mm_s / (1.0 - _RAMP) * 1e3, Pace.EVEN, arc=arc)

    def _add(self, to: Stance, span_ms: float, pace: Pace, arc: Arc | None) -> None:
        end_ns = self._t_ns + max(1, round(span_ms * _NS))
        self.legs.append(Leg(self._t_ns, end_ns, self.here, to, pace, arc))
        self._t_ns, self.here = end_ns, to


def place_at(centre_mm: Place, distance_mm: float, bearing_deg: float) -> Place:
    """Return the place at a distance from another one; bearing 0 is up the picture, 90 to the right."""
    bearing = radians(bearing_deg)
    return (centre_mm[0] + distance_mm * sin(bearing), centre_mm[1] - distance_mm * cos(bearing))


def _place(a: Place, b: Place, share: float) -> Place:
    return (between(a[0], b[0], share), between(a[1], b[1], share))


def _even(s: float) -> float:
    """Return the share of the way of a motion whose speed rises, stays and falls, each without a jolt."""
    if s > 0.5:
        return 1.0 - _even(1.0 - s)
    whole = 1.0 - _RAMP
    if s >= _RAMP:
        return (s - 0.5 * _RAMP) / whole
    q = s / _RAMP
    return _RAMP * (q * q * q - 0.5 * q * q * q * q) / whole


def _gathering(s: float) -> float:
    """Return the share of the way of a motion whose speed rises without a jolt and then stays."""
    whole = 1.0 - 0.5 * _RAMP
    if s >= _RAMP:
        return (s - 0.5 * _RAMP) / whole
    q = s / _RAMP
    return _RAMP * (q * q * q - 0.5 * q * q * q * q) / whole
