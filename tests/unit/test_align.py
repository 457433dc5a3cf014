import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from touchd.align.alignment import Alignment, AlignmentError, AreaOrigin, Corners, KeptAlignment, area_in_force
from touchd.align.file import load_alignment, save_alignment
from touchd.align.hold import HoldDetector, Phase
from touchd.align.session import AlignProgress, AlignSession
from touchd.align.solve import CORNER_NAMES, GRID_NAMES, rectangle_residual_mm, solve_alignment
from touchd.errors import StateError, StateNotKept, UsageError
from touchd.geometry import (
    AreaMap,
    Doubles,
    SurfaceMap,
    distort,
    kinect_v1_sensor,
    map_area,
    map_surface,
    measured_size_mm,
    project_ideal,
    raw_of_depth,
    rays,
    whole_picture,
)
from touchd.model import AreaCorners, Cursor, Intrinsics, State, Surface, TouchFrame

LENS = Intrinsics(580.0, 580.0, 319.5, 239.5, k1=0.05, k2=-0.1)
SENSOR = kinect_v1_sensor(intrinsics=LENS)
FRAME_NS = 33_333_333
NORMAL = np.array([0.0, math.sin(0.3), -math.cos(0.3)])
# A rectangle of 500 x 300 mm on the tilted table, turned a little in it.
AROUND = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
GRID = np.array([(x, y) for y in (-1.0, 0.0, 1.0) for x in (-1.0, 0.0, 1.0)])


@pytest.fixture(scope="module")
def table() -> SurfaceMap:
    v, u = np.mgrid[0:480, 0:640].astype(float)
    directions = rays(LENS, np.stack([u, v], axis=-1))
    reference = raw_of_depth(SENSOR, 900.0 / (directions @ -NORMAL))
    everywhere = np.ones(reference.shape, bool)
    surface = Surface(
        sensor=SENSOR,
        reference=reference.astype(np.float32),
        dmax=np.floor(reference).astype(np.uint16),
        noise=np.full(reference.shape, 0.2, np.float32),
        valid=everywhere,
        moved=~everywhere,
        frames=1,
        made_from="a test",
    )
    return map_surface(surface)


def pixels(places: Doubles, off_mm: Doubles | float = 0.0) -> list[tuple[float, float]]:
    """Undistorted pixels of places in the rectangle, its corners at ±1, moved by so many mm on the table."""
    along = np.array([math.cos(0.1), math.sin(0.1), 0.0])
    along -= (along @ NORMAL) * NORMAL
    along /= np.linalg.norm(along)
    down = np.cross(along, NORMAL)
    down *= np.sign(down[1])
    flat = places * np.array([250.0, 150.0]) + off_mm
    points = np.array([0.0, 0.0, 900.0 / math.cos(0.3)]) + flat[:, :1] * along + flat[:, 1:] * down
    return [(u, v) for u, v in project_ideal(LENS, points).tolist()]


def test_four_touched_corners_are_the_corners_as_the_lens_shows_them(table: SurfaceMap) -> None:
    touched = pixels(AROUND)
    found = solve_alignment(touched, LENS, table)
    np.testing.assert_allclose(found.corners_px, distort(LENS, np.array(touched)))
    assert found.size_mm == pytest.approx((500.0, 300.0), abs=1.0)
    assert found.residual_mm < 0.5
    assert found.points == 4


def test_an_area_map_of_the_corners_found_puts_the_touched_points_at_its_corners(table: SurfaceMap) -> None:
    touched = pixels(AROUND)
    area = AreaCorners(solve_alignment(touched, LENS, table).corners_px)
    area_map = map_area(area, LENS, (1.0, 1.0))
    places = [area_map.of_ideal_pixel(u, v) for u, v in touched]
    np.testing.assert_allclose(places, [(0, 0), (1, 0), (1, 1), (0, 1)], atol=1e-4)
    assert measured_size_mm(area, table) == pytest.approx((500.0, 300.0), abs=3.0)


def test_a_corner_touched_beside_the_rectangle_shows_in_the_residual(table: SurfaceMap) -> None:
    off = np.zeros((4, 2))
    off[1] = (8.0, 0.0)
    assert 2.0 < solve_alignment(pixels(AROUND, off), LENS, table).residual_mm < 4.0


def test_nine_points_average_out_how_inexactly_each_was_touched(table: SurfaceMap) -> None:
    off = np.random.default_rng(5).normal(0.0, 2.0, (9, 2))
    found = solve_alignment(pixels(GRID, off), LENS, table)
    assert found.points == 9
    assert 0.5 < found.residual_mm < 4.0
    truth = distort(LENS, np.array(pixels(AROUND)))
    errors_mm = np.linalg.norm(np.array(found.corners_px) - truth, axis=1) * 900.0 / 580.0
    assert errors_mm.max() < 4.5
    exact = solve_alignment(pixels(GRID), LENS, table)
    assert exact.residual_mm < 0.01
    np.testing.assert_allclose(exact.corners_px, truth, atol=0.01)


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, -3.0])
def test_the_residual_is_how_far_corners_lie_from_the_best_rectangle(angle: float) -> None:
    turn = np.array([[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0, 0, 1]])
    rectangle = np.array([(0.0, 0.0, 700.0), (600.0, 0.0, 700.0), (600.0, 400.0, 700.0), (0.0, 400.0, 700.0)])
    assert rectangle_residual_mm(rectangle @ turn.T) == pytest.approx(0.0, abs=1e-4)
    # Of a parallelogram with sides a, b that lean by a small s the best rectangle takes back half at each corner ...
    leaning = rectangle + np.array([(4.0, 0, 0), (4.0, 0, 0), (-4.0, 0, 0), (-4.0, 0, 0)])
    share = 600.0 / math.hypot(600.0, 400.0)
    assert rectangle_residual_mm(leaning @ turn.T) == pytest.approx(4.0 * share, rel=0.02)
    # ... and of a warped one, nothing.
    warped = rectangle + np.array([(0, 0, 5.0), (0, 0, -5.0), (0, 0, 5.0), (0, 0, -5.0)])
    assert rectangle_residual_mm(warped @ turn.T) == pytest.approx(5.0, rel=1e-3)


@pytest.mark.parametrize(
    ("order", "sentence"),
    [
        (
            [0, 3, 2, 1],
            "the corners run anticlockwise for the camera, as in a mirror; align again, in the order top-left,",
        ),
        ([1, 0, 3, 2], "the corners run anticlockwise for the camera"),
        ([0, 2, 1, 3], "the top-right corner and the bottom-right corner look swapped; align again"),
        ([1, 0, 2, 3], "the top-left corner and the top-right corner look swapped; align again"),
        ([0, 1, 3, 2], "the bottom-right corner and the bottom-left corner look swapped; align again"),
        ([3, 1, 2, 0], "the bottom-left corner and the top-left corner look swapped; align again"),
    ],
)
def test_corners_touched_in_another_order_are_named(table: SurfaceMap, order: list[int], sentence: str) -> None:
    with pytest.raises(AlignmentError) as caught:
        solve_alignment(pixels(AROUND[order]), LENS, table)
    assert str(caught.value).startswith(sentence)
    assert caught.value.exit_code == 75


@pytest.mark.parametrize(
    ("corner", "place", "sentence"),
    [
        (2, (-0.5, -0.5), "the bottom-right corner dents the area inwards; align again"),
        (2, (0.0, 0.0), "the bottom-right corner lies in a line with its neighbours; align again"),
        (0, (0.99, -0.98), "the top-left corner and the top-right corner were touched 4 mm apart, and an area's sides"),
    ],
)
def test_a_corner_touched_at_a_wrong_place_is_named(
    table: SurfaceMap, corner: int, place: tuple[float, float], sentence: str
) -> None:
    places = AROUND.copy()
    places[corner] = place
    with pytest.raises(AlignmentError) as caught:
        solve_alignment(pixels(places), LENS, table)
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize("wrong", range(9))
def test_one_of_nine_points_touched_at_a_wrong_place_is_named(table: SurfaceMap, wrong: int) -> None:
    off = np.zeros((9, 2))
    off[wrong] = (50.0, 30.0)
    with pytest.raises(AlignmentError) as caught:
        solve_alignment(pixels(GRID, off), LENS, table)
    found = re.fullmatch(
        r"the ([\w -]+) was touched (\d+) mm from where the other points put it; align again, row by row from the "
        r"top-left corner",
        str(caught.value),
    )
    assert found is not None
    assert found[1] == GRID_NAMES[wrong]
    assert int(found[2]) == pytest.approx(math.hypot(50.0, 30.0), abs=2.0)


def test_nine_points_on_one_another_are_no_area(table: SurfaceMap) -> None:
    with pytest.raises(AlignmentError, match="align again"):
        solve_alignment([(300.0, 200.0)] * 9, LENS, table)


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
    assert two.why == "2 touches are seen: use one finger, steeply, with the rest of the hand high"
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


CORNERS: Corners = ((60.25, 40.1), (580.0, 44.0), (570.0, 430.0), (66.0, 424.0))
EDITED: Corners = ((61.0, 40.0), (580.0, 44.0), (570.0, 430.0), (66.0, 424.0))
FOUND: Corners = ((100.5, 80.0), (540.0, 84.0), (530.0, 390.0), (106.0, 384.0 + 1.0 / 3.0))
ALIGNMENT = Alignment(FOUND, (700.2, 500.1), 1.25, 4)


def kept(config_corners: Corners | None) -> KeptAlignment:
    return KeptAlignment(ALIGNMENT, 1_700_000_000.5, config_corners)


@pytest.mark.parametrize(
    ("config", "alignment", "expected", "origin"),
    [
        (None, None, None, AreaOrigin.GUESSED),
        (AreaCorners(CORNERS), None, AreaCorners(CORNERS), AreaOrigin.CONFIG),
        (None, kept(None), AreaCorners(FOUND), AreaOrigin.ALIGNMENT),
        (AreaCorners(CORNERS), kept(CORNERS), AreaCorners(FOUND), AreaOrigin.ALIGNMENT),
        (AreaCorners(CORNERS, (70.0, 50.0)), kept(CORNERS), AreaCorners(FOUND, (70.0, 50.0)), AreaOrigin.ALIGNMENT),
        (AreaCorners(EDITED), kept(CORNERS), AreaCorners(EDITED), AreaOrigin.CONFIG),
        (AreaCorners(EDITED), kept(None), AreaCorners(EDITED), AreaOrigin.CONFIG),
        (None, kept(CORNERS), None, AreaOrigin.GUESSED),
    ],
)
def test_the_newer_one_of_alignment_and_edited_corners_is_in_force(
    config: AreaCorners | None, alignment: KeptAlignment | None, expected: AreaCorners | None, origin: AreaOrigin
) -> None:
    assert area_in_force(config, alignment) == (expected, origin)


@pytest.mark.parametrize("config_corners", [None, CORNERS])
def test_an_alignment_comes_back_as_it_was_stored(tmp_path: Path, config_corners: Corners | None) -> None:
    save_alignment(tmp_path / "alignment.json", kept(config_corners), SENSOR)
    assert load_alignment(tmp_path / "alignment.json", SENSOR) == kept(config_corners)
    assert [path.name for path in tmp_path.iterdir()] == ["alignment.json"]


def test_no_stored_alignment_is_none(tmp_path: Path) -> None:
    assert load_alignment(tmp_path / "alignment.json", SENSOR) is None


def test_a_changed_byte_is_noticed_wherever_it_is(tmp_path: Path) -> None:
    path = tmp_path / "alignment.json"
    save_alignment(path, kept(CORNERS), SENSOR)
    whole = path.read_bytes()
    for place in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[place] = ord("7") if damaged[place] != ord("7") else ord("8")
        path.write_bytes(damaged)
        with pytest.raises(StateError, match=r"run touchd align$") as caught:
            load_alignment(path, SENSOR)
        assert caught.value.exit_code == 65


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b"[" * 100_000, b'{"kind": "touchd surface"}'])
def test_what_is_no_alignment_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "alignment.json"
    path.write_bytes(content)
    with pytest.raises(StateError) as caught:
        load_alignment(path, SENSOR)
    assert str(caught.value) == f"{path}: this is no alignment of touchd; run touchd align"


def test_an_alignment_of_another_camera_or_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "alignment.json"
    save_alignment(path, kept(None), SENSOR)
    with pytest.raises(StateError, match=r"made with another camera \(serial  there, B77 here\); run touchd align"):
        load_alignment(path, replace(SENSOR, serial="B77"))
    path.write_text(json.dumps({**json.loads(path.read_text()), "version": 2}))
    with pytest.raises(StateError, match="the alignment has version 2, this touchd reads version 1; run touchd align"):
        load_alignment(path, SENSOR)


def test_a_folder_in_place_of_the_alignment_is_named(tmp_path: Path) -> None:
    with pytest.raises(StateError, match="the alignment cannot be read: Is a directory; run touchd align"):
        load_alignment(tmp_path, SENSOR)


def test_an_alignment_that_cannot_be_stored_is_exit_code_73(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StateNotKept) as caught:
        save_alignment(tmp_path / "file" / "alignment.json", kept(None), SENSOR)
    assert caught.value.exit_code == 73
