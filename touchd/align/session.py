"""An alignment in progress: which point is next, how far it is held, and what comes out."""

import math
from dataclasses import dataclass

import numpy as np

from touchd.align.alignment import Alignment
from touchd.align.hold import HoldDetector, HoldStep, Phase
from touchd.align.solve import POINT_NAMES, solve_alignment
from touchd.errors import UsageError
from touchd.geometry import AreaMap, SurfaceMap
from touchd.model import TouchFrame

# Two holds nearer than this are of one finger that did not move on.
_SAME_PLACE_MM = 20.0


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
    kept_in: str | None = None  # the file that the finished alignment was stored in


class AlignSession:
    """Asks for one point after the other and solves the alignment when the finger has left the last one.

    Feed it the frames of a pipeline whose area is the whole picture.
    """

    def __init__(self, points: int, area_map: AreaMap, surface_map: SurfaceMap) -> None:
        """``area_map`` is that of the frames. Raises UsageError for a number of points other than 4 and 9."""
        if points not in POINT_NAMES:
            raise UsageError(f"an alignment takes 4 points or 9, found {points}")
        self._names = POINT_NAMES[points]
        self._area_map = area_map
        self._surface_map = surface_map
        self._detector = HoldDetector(area_map.size_mm)
        self._held: list[tuple[float, float]] = []  # in the frames' area coordinates
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
            self._note(step.position)
        if step.phase is Phase.DONE and len(self._held) == len(self._names):
            self._alignment = self._solve()
            return self._finished(self._alignment)
        return self._progress(step)

    def _note(self, position: tuple[float, float]) -> None:
        width_mm, height_mm = self._area_map.size_mm
        self._repeated = None
        for name, (x, y) in zip(self._names, self._held, strict=False):
            if math.hypot((position[0] - x) * width_mm, (position[1] - y) * height_mm) < _SAME_PLACE_MM:
                self._repeated = f"that was the {name} again"
                return
        self._held.append(position)

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
        to_pixel = np.linalg.inv(np.array(self._area_map.to_area))
        touched = np.array([(x, y, 1.0) for x, y in self._held]) @ to_pixel.T
        pixels = touched[:, :2] / touched[:, 2:]
        return solve_alignment([(u, v) for u, v in pixels.tolist()], self._area_map.intrinsics, self._surface_map)

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
        )
