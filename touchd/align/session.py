"""An alignment in progress: which point is next, how far it is held, and what comes out."""

import math
from dataclasses import dataclass, replace

import numpy as np

from touchd.align.alignment import Alignment, AlignmentError
from touchd.align.eye import Round, offsets_by_side, solve_aim
from touchd.align.hold import HoldDetector, HoldStep, Phase
from touchd.align.solve import POINT_NAMES, on_surface, solve_alignment
from touchd.contacts.aim import EyeOffsets
from touchd.errors import UsageError
from touchd.geometry import AreaMap, Doubles, SurfaceMap, project_ideal, undistort
from touchd.model import TouchFrame

# Two holds nearer than this are of one finger that did not move on.
_SAME_PLACE_MM = 20.0
_AHEAD_MM = 5.0  # along a finger, to see where it points
_FROM_ELSEWHERE = ", from another side"


@dataclass(frozen=True, slots=True)
class _Held:
    """A touch that was held: where, in the frames' area coordinates, and where its finger pointed, if that is known."""

    place: tuple[float, float]
    towards: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class AlignProgress:
    """How far an alignment is: what is waited for at which point, and at the end what came out.

    ``why`` is a sentence for people: what keeps a hold from counting, or what became of a finished alignment.
    """

    point: int  # the one that is asked for, counted from 1
    points: int
    target: str  # its name
    phase: Phase
    share: float = 0.0  # of the time that the touch must be held
    why: str | None = None
    done: bool = False
    residual_mm: float | None = None
    size_mm: tuple[float, float] | None = None
    eye: EyeOffsets | None = None
    kept_in: str | None = None  # the file that the finished alignment was stored in


class AlignSession:
    """Asks for one point after the other and solves the alignment when the finger has left the last one.

    Feed it the frames of a pipeline whose area is the whole picture.
    """

    def __init__(self, points: int, area_map: AreaMap, surface_map: SurfaceMap, sides: int = 1) -> None:
        """``area_map`` is that of the frames. From two ``sides`` each point is touched twice, for the eye's offset.

        Raises UsageError for a number of points other than 4 and 9, or of sides other than 1 and 2.
        """
        if points not in POINT_NAMES:
            raise UsageError(f"an alignment takes 4 points or 9, found {points}")
        if sides not in (1, 2):
            raise UsageError(f"an alignment is made from 1 side or 2, found {sides}")
        self._points = points
        self._names = POINT_NAMES[points]
        if sides == 2:
            self._names += tuple(name + _FROM_ELSEWHERE for name in self._names)
        self._area_map = area_map
        self._surface_map = surface_map
        self._detector = HoldDetector(area_map.size_mm)
        self._held: list[_Held] = []
        self._repeated: str | None = None
        self._alignment: Alignment | None = None

    @property
    def alignment(self) -> Alignment | None:
        """What came out, None until then."""
        return self._alignment

    def feed(self, frame: TouchFrame) -> AlignProgress:
        """Take in the next frame. Raises AlignmentError if the points, all touched, are no outline of an area."""
        if self._alignment is not None:
            return self._finished(self._alignment)
        step = self._detector.feed(frame)
        if step.position is not None:
            self._note(_Held(step.position, step.towards))
        if step.phase is Phase.DONE and len(self._held) == len(self._names):
            self._alignment = self._solve()
            return self._finished(self._alignment)
        return self._progress(step)

    def _note(self, held: _Held) -> None:
        width_mm, height_mm = self._area_map.size_mm
        self._repeated = None
        begin = len(self._held) // self._points * self._points  # of this round
        for name, other in zip(self._names[begin:], self._held[begin:], strict=False):
            x, y = other.place
            if math.hypot((held.place[0] - x) * width_mm, (held.place[1] - y) * height_mm) < _SAME_PLACE_MM:
                self._repeated = f"that was the {name} again"
                return
        self._held.append(held)

    def _progress(self, step: HoldStep) -> AlignProgress:
        # While the finger is still there, the point in question is the one that it holds.
        lifting = step.phase is Phase.LIFT and self._repeated is None
        index = len(self._held) - lifting
        if step.phase is Phase.HOLD:
            self._repeated = None
        phase = Phase.TOUCH if step.phase is Phase.DONE else step.phase
        return AlignProgress(
            point=index + 1,
            points=len(self._names),
            target=self._names[index],
            phase=phase,
            share=step.share if phase is not Phase.TOUCH else 0.0,
            why=step.why or self._repeated,
        )

    def _solve(self) -> Alignment:
        if len(self._held) == self._points:
            return self._solve_for(self._pixels(np.array([held.place for held in self._held])))
        intrinsics = self._area_map.intrinsics
        rounds = self._round(self._held[: self._points]), self._round(self._held[self._points :])
        aim = solve_aim(*rounds)
        alignment = self._solve_for(project_ideal(intrinsics, aim.meant_mm))
        corners = undistort(intrinsics, np.array(alignment.corners_px))
        return replace(alignment, eye=offsets_by_side(aim, rounds, on_surface(self._surface_map, intrinsics, corners)))

    def _solve_for(self, pixels: Doubles) -> Alignment:
        return solve_alignment([(u, v) for u, v in pixels.tolist()], self._area_map.intrinsics, self._surface_map)

    def _round(self, held: list[_Held]) -> Round:
        """Return touches and their fingers' directions on the surface. Raises AlignmentError where one has none."""
        towards = [each.towards for each in held if each.towards is not None]
        if len(towards) < len(held):
            raise AlignmentError(
                "it cannot be told where the fingers point (touch.method: fingertip tells it); align without --eye"
            )
        places = np.array([each.place for each in held])
        ahead = places + np.array(towards) * _AHEAD_MM / np.array(self._area_map.size_mm)
        intrinsics = self._area_map.intrinsics
        here, there = (on_surface(self._surface_map, intrinsics, self._pixels(each)) for each in (places, ahead))
        way = there - here
        return Round(here, way / np.linalg.norm(way, axis=1, keepdims=True))

    def _pixels(self, places: Doubles) -> Doubles:
        """Return the undistorted pixels (N, 2) of places (N, 2) in the frames' area coordinates."""
        to_pixel = np.linalg.inv(np.array(self._area_map.to_area))
        touched = np.column_stack([places, np.ones(len(places))]) @ to_pixel.T
        pixels: Doubles = touched[:, :2] / touched[:, 2:]
        return pixels

    def _finished(self, alignment: Alignment) -> AlignProgress:
        return AlignProgress(
            point=len(self._names),
            points=len(self._names),
            target=self._names[-1],
            phase=Phase.DONE,
            share=1.0,
            done=True,
            residual_mm=alignment.residual_mm,
            size_mm=alignment.size_mm,
            eye=alignment.eye,
        )
