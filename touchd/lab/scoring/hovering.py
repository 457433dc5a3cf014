"""Fingertips in the air, and the first frames of the touches that follow."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from touchd.lab.scoring.matching import Match, Place, ScoredFrame
from touchd.lab.scoring.touches import Life, Sighting, TrueTouch, match_of

# Fingertips so high above the surface are to be seen as hovers, where they rise or sink slowly.
LOWEST_MM, HIGHEST_MM = 5.0, 38.0
_SINKING_MM_S, _FAST_MM_S = 60.0, 500.0
_BEFORE_S = 0.25  # a touch follows a hover if its fingertip was low for so long before
_BEFORE_MM = 40.0

Samples = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class HoverScore:
    """How fingertips in the air were seen.

    - ``hovering``: how often a fingertip was at 5 to 38 mm in a frame, rising or sinking slower than 60 mm/s, with no
      cursor on it; only of runs in which the program told of any hover. ``found``: how often a hover stood for it.
    - ``height_errors_mm``: height as said minus as it was, without sign, of each of those.
    - ``landing_errors_mm``, ``landing_speed_errors_mm_s``: in the first frame of touches that follow a hover, how far
      the cursor lies from the touch point, and by how much its velocity differs from the finger's.
    """

    hovering: int = 0
    found: int = 0
    height_errors_mm: Samples = ()
    landing_errors_mm: Samples = ()
    landing_speed_errors_mm_s: Samples = ()


def hover_score(
    frames: Sequence[ScoredFrame],
    touches: Mapping[int, TrueTouch],
    own: Mapping[int, Sequence[Sighting]],
    cursors: Mapping[int, Life],
    found: set[int],
) -> HoverScore:
    """Score hovers and landings; ``own`` are the sightings of each touch's own cursors."""
    told = any(frame.hovers for frame in frames)
    asked = [(frame, place) for frame in frames for place in frame.places if told and _is_hover(frame, place)]
    errors = tuple(error for frame, place in asked for error in _height_errors_mm(frame, place))
    landings = list(_landings(frames, touches, own, cursors, found))
    return HoverScore(
        hovering=len(asked),
        found=len(errors),
        height_errors_mm=errors,
        landing_errors_mm=tuple(hypot(match.dx_mm, match.dy_mm) for _, match in landings),
        landing_speed_errors_mm_s=tuple(error for frame, match in landings for error in _speed_errors(frame, match)),
    )


def _is_hover(frame: ScoredFrame, place: Place) -> bool:
    tip = place.tip
    quiet = abs(place.rising_mm_s) < _SINKING_MM_S and place.speed_mm_s < _FAST_MM_S
    free = frame.upset is None and tip.inside and not tip.touching and not tip.either
    return free and quiet and LOWEST_MM <= tip.clearance_mm <= HIGHEST_MM and not _has_cursor(frame, place)


def _has_cursor(frame: ScoredFrame, place: Place) -> bool:
    return any(match.place is place for match in frame.matches)


def _height_errors_mm(frame: ScoredFrame, place: Place) -> Iterator[float]:
    """Yield the error of the height of what stands for a fingertip, if anything does."""
    for match in frame.hover_matches:
        if match.place is place:
            yield abs(frame.hovers[match.cursor].height_mm - place.tip.clearance_mm)


def _landings(
    frames: Sequence[ScoredFrame],
    touches: Mapping[int, TrueTouch],
    own: Mapping[int, Sequence[Sighting]],
    cursors: Mapping[int, Life],
    found: set[int],
) -> Iterator[tuple[ScoredFrame, Match]]:
    """Yield the first frame of each found touch that follows a hover, and what its cursor stands for there."""
    for number in sorted(found):
        touch, cursor = touches[number], own[number][0].cursor
        frame = frames[cursors[cursor].born]
        match = match_of(frame, cursor)
        if match is not None and match.place.tip.touch == number and _hovered_before(frames, touch):
            yield frame, match


def _hovered_before(frames: Sequence[ScoredFrame], touch: TrueTouch) -> bool:
    begin_s = frames[touch.first].t_s - _BEFORE_S
    before = [frame for frame in frames[: touch.first] if frame.t_s >= begin_s]
    return bool(before) and all(_is_low(frame, touch) for frame in before)


def _is_low(frame: ScoredFrame, touch: TrueTouch) -> bool:
    tips = (place.tip for place in frame.places)
    return any((tip.hand, tip.finger) == touch.finger and tip.clearance_mm <= _BEFORE_MM for tip in tips)


def _speed_errors(frame: ScoredFrame, match: Match) -> Iterator[float]:
    """Yield by how much a cursor's velocity differs from its finger's, if the program gives one."""
    if match.cursor in frame.velocities_mm_s:
        vx, vy = frame.velocities_mm_s[match.cursor]
        yield hypot(vx - match.place.vx_mm_s, vy - match.place.vy_mm_s)
