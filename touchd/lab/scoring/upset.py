"""What becomes of cursors when the camera is knocked or blinded, and of the touches afterwards."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from touchd.lab.scoring.matching import ScoredFrame
from touchd.lab.scoring.touches import Life, TrueTouch, match_of

_EARLY_FRAMES = 3


@dataclass(frozen=True, slots=True)
class UpsetScore:
    """How a program came through ``upsets``: times in which no touch can be asked for.

    - ``outlived_ms``: for each cursor that is there when one begins, or that appears in one without standing for a
      touching finger, how long it lives from then on.
    - ``after``: touches that begin after one, ``found_after``: of those the found; ``errors_after_mm``: how far cursors
      lie from the touch points in each frame of those touches.
    """

    upsets: int = 0
    outlived_ms: tuple[float, ...] = ()
    after: int = 0
    found_after: int = 0
    errors_after_mm: tuple[float, ...] = ()


def upset_score(
    frames: Sequence[ScoredFrame], touches: Mapping[int, TrueTouch], cursors: Mapping[int, Life], found: set[int]
) -> UpsetScore:
    """Score what came of upsets."""
    spans = list(_spans(frames))
    if not spans:
        return UpsetScore()
    end = spans[0][1]
    after = {number for number, touch in touches.items() if touch.first > end}
    errors = (
        hypot(match.dx_mm, match.dy_mm)
        for frame in frames[end + 1 :]
        for match in frame.contacts()
        if match.place.tip.touch in after
    )
    outlived = tuple(ms for span in spans for ms in _outlived_ms(frames, cursors, span))
    return UpsetScore(len(spans), outlived, len(after), len(after & found), tuple(errors))


def _spans(frames: Sequence[ScoredFrame]) -> Iterator[tuple[int, int]]:
    """Yield the first and the last frame of each upset."""
    begin = None
    for at, frame in enumerate(frames):
        if frame.upset is not None and begin is None:
            begin = at
        if frame.upset is None and begin is not None:
            yield begin, at - 1
            begin = None
    if begin is not None:
        yield begin, len(frames) - 1


def _outlived_ms(frames: Sequence[ScoredFrame], cursors: Mapping[int, Life], span: tuple[int, int]) -> Iterator[float]:
    """Yield how long cursors live that an upset should have ended, counted to the first frame without them."""
    begin, end = span
    for cursor, life in cursors.items():
        there = life.born < begin <= life.ended
        appears = begin <= life.born <= end and not _stands_for_touch(frames, cursor, life)
        if there or appears:
            gone = min(life.ended + 1, len(frames) - 1)
            yield round(1e3 * (frames[gone].t_s - frames[max(begin, life.born)].t_s), 3)


def _stands_for_touch(frames: Sequence[ScoredFrame], cursor: int, life: Life) -> bool:
    """Return whether a finger touches where a cursor begins, or does so soon: a cursor may be a little early."""
    first = frames[life.born : min(life.ended, life.born + _EARLY_FRAMES) + 1]
    return any(match is not None and match.place.tip.touching for match in (match_of(at, cursor) for at in first))
