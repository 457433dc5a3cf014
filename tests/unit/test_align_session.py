import numpy as np
import pytest
from touchd.align.alignment import AlignmentError
from touchd.align.hold import HoldDetector, Phase
from touchd.align.session import AlignProgress, AlignSession
from touchd.align.solve import CORNER_NAMES, GRID_NAMES
from touchd.errors import UsageError
from touchd.geometry import (
    AreaMap,
    Doubles,
    SurfaceMap,
    distort,
    map_area,
    measured_size_mm,
    whole_picture,
)
from touchd.model import Cursor, State, TouchFrame

from aligned_table import AROUND, FRAME_NS, GRID, LENS, SENSOR, pixels, tilted_table


@pytest.fixture(scope="module")
def table() -> SurfaceMap:
    return tilted_table()


def touching(t_ns: int, *places: tuple[float, float], state: State = State.TRACKING) -> TouchFrame:
    cursors = tuple(Cursor(i + 1, x, y, 0.0, 0.0, 0.0, 5.0, 80.0, 0.0) for i, (x, y) in enumerate(places))
    return TouchFrame(t_ns // FRAME_NS, t_ns, state, cursors)


class Finger:
    """Feeds a detector of a square metre with a finger's doings, 30 times a second."""

    def __init__(self) -> None:
        self.detector = HoldDetector((1000.0, 1000.0))
        self.t_ns = 0
        self.positions: list[tuple[float, float]] = []
        self.phases: list[Phase] = []

    def do(self, seconds: float, *places: tuple[float, float], state: State = State.TRACKING) -> Phase:
        for _ in range(round(seconds * 30)):
            self.feed(touching(self.t_ns, *places, state=state))
        return self.phases[-1]

    def feed(self, frame: TouchFrame) -> None:
        step = self.detector.feed(frame)
        assert 0.0 <= step.share <= 1.0
        self.t_ns += FRAME_NS
        self.phases.append(step.phase)
        if step.position is not None:
            self.positions.append(step.position)


def test_a_touch_held_still_counts_once_at_its_mean_place() -> None:
    finger = Finger()
    jitter = np.random.default_rng(1).normal(0.0, 0.001, (60, 2))
    for dx, dy in jitter:
        finger.feed(touching(finger.t_ns, (0.3 + dx, 0.6 + dy)))
    assert finger.phases[-1] is Phase.LIFT
    assert len(finger.positions) == 1
    assert finger.positions[0] == pytest.approx((0.3, 0.6), abs=0.001)


def test_a_touch_must_be_held_for_0_8_s() -> None:
    finger = Finger()
    assert finger.do(0.75, (0.5, 0.5)) is Phase.HOLD
    assert finger.do(0.15, (0.5, 0.5)) is Phase.LIFT


def test_the_next_hold_counts_only_after_the_finger_was_lifted() -> None:
    finger = Finger()
    finger.do(3.0, (0.5, 0.5))
    assert len(finger.positions) == 1
    assert finger.do(0.1) is Phase.LIFT  # a touch that flickers is not lifted
    finger.do(2.0, (0.5, 0.5))
    assert len(finger.positions) == 1
    finger.do(0.5)
    assert Phase.DONE in finger.phases
    finger.do(1.0, (0.7, 0.5))
    assert finger.positions[1] == pytest.approx((0.7, 0.5))


def test_a_slow_slide_is_no_hold_and_its_end_is() -> None:
    finger = Finger()
    for step in range(90):
        finger.feed(touching(finger.t_ns, (0.5 + step * 0.02 / 90, 0.5)))  # 20 mm in 3 s
    assert finger.positions == []
    finger.do(1.6, (0.52, 0.5))
    assert finger.positions[0] == pytest.approx((0.52, 0.5), abs=0.002)


def test_a_second_finger_a_lost_touch_and_lost_frames_begin_the_hold_anew() -> None:
    two, none = ((0.5, 0.5), (0.8, 0.8)), ()
    for places, state in ((two, State.TRACKING), (none, State.TRACKING), (none, State.NO_FRAMES)):
        finger = Finger()
        finger.do(0.7, (0.5, 0.5))
        assert finger.do(0.1, *places, state=state) is Phase.TOUCH
        assert finger.do(0.7, (0.5, 0.5)) is Phase.HOLD
        assert finger.positions == []


def test_what_keeps_a_hold_from_counting_is_said() -> None:
    detector = HoldDetector((1000.0, 1000.0))
    two = detector.feed(touching(0, (0.1, 0.1), (0.2, 0.1)))
    assert two.why == "2 touches are seen: use one finger, with the rest of the hand high"
    lost = TouchFrame(0, 0, State.NO_FRAMES, why="no frame came from the source")
    assert detector.feed(lost).why == "no frame came from the source"
    assert detector.feed(touching(0)).why is None


class Aligner:
    """Somebody who goes through an alignment, and writes down what was asked."""

    def __init__(self, points: int, table: SurfaceMap) -> None:
        corners = whole_picture(SENSOR)
        self.area_map: AreaMap = map_area(corners, LENS, measured_size_mm(corners, table))
        self.session = AlignSession(points, self.area_map, table)
        self.t_ns = 0
        self.asked: list[str] = []

    def touch(self, pixel: tuple[float, float]) -> AlignProgress:
        place = self.area_map.of_ideal_pixel(*pixel)
        for frame in [place] * 30:
            progress = self.feed(frame)
            assert progress.phase in (Phase.HOLD, Phase.LIFT)
        self.asked.append(progress.target)
        for _ in range(10):
            progress = self.feed()
        return progress

    def feed(self, *places: tuple[float, float]) -> AlignProgress:
        self.t_ns += FRAME_NS
        return self.session.feed(touching(self.t_ns, *places))


@pytest.mark.parametrize(("places", "names"), [(AROUND, CORNER_NAMES), (GRID, GRID_NAMES)])
def test_a_session_asks_for_each_point_and_ends_with_the_alignment(
    table: SurfaceMap, places: Doubles, names: tuple[str, ...]
) -> None:
    aligner = Aligner(len(names), table)
    first = aligner.feed()
    assert (first.point, first.points, first.target, first.phase) == (1, len(names), names[0], Phase.TOUCH)
    for pixel in pixels(places):
        assert aligner.session.alignment is None
        last = aligner.touch(pixel)
    assert aligner.asked == list(names)
    assert last.done
    found = aligner.session.alignment
    assert found is not None
    assert (last.residual_mm, last.size_mm) == (found.residual_mm, found.size_mm)
    np.testing.assert_allclose(found.corners_px, distort(LENS, np.array(pixels(AROUND))), atol=0.05)
    assert aligner.feed() == last


def test_a_corner_touched_twice_is_asked_for_no_more_and_the_user_is_told(table: SurfaceMap) -> None:
    aligner = Aligner(4, table)
    touched = pixels(AROUND)
    aligner.touch(touched[0])
    again = aligner.touch(touched[0])
    assert (again.target, again.phase) == ("top-right corner", Phase.TOUCH)
    assert again.why == "that was the top-left corner again"
    for pixel in touched[1:]:
        last = aligner.touch(pixel)
    assert last.done


def test_a_session_of_points_that_are_no_area_says_so_at_its_end(table: SurfaceMap) -> None:
    aligner = Aligner(4, table)
    touched = pixels(AROUND[[0, 2, 1, 3]])
    for pixel in touched[:3]:
        aligner.touch(pixel)
    with pytest.raises(AlignmentError, match="look swapped"):
        aligner.touch(touched[3])


def test_an_alignment_takes_4_points_or_9(table: SurfaceMap) -> None:
    with pytest.raises(UsageError, match="an alignment takes 4 points or 9, found 5"):
        Aligner(5, table)
