from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.demo.area_picture import area_cells
from touchd.demo.styles import Line, Span, Style, cut, signs_for, text_of
from touchd.demo.view import DemoView, draw, last_line, plain_line
from touchd.demo.watching import Relief, WatchedSource
from touchd.geometry import kinect_v1_sensor
from touchd.metrics import MetricsSnapshot
from touchd.model import AreaCorners, Cursor, Frame, Mask, Sensor, State, Surface

METRICS = MetricsSnapshot(
    frames=412, dropped=2, fps=29.97, latency_p50_ms=1.24, latency_p99_ms=3.06, latency_max_ms=9.0
)
NOTHING: Mask = np.zeros((112, 160), np.bool_)


def cursor(session_id: int, x: float = 0.25, y: float = 0.75, vx: float = 0.0, vy: float = 0.0) -> Cursor:
    return Cursor(session_id, x, y, vx, vy, accel=0.0, height_mm=8.0, area_mm2=90.0, angle=0.0)


VIEW = DemoView(
    scenario="pinch",
    seed=3,
    destination="127.0.0.1:3333",
    state=State.TRACKING,
    why=None,
    metrics=METRICS,
    left_out=1,
    cursors=(cursor(7, 0.25, 0.75, vx=0.5, vy=0.0),),
    touches=7,
    area_mm=(600.0, 420.0),
    risen=NOTHING,
    trouble=None,
)


def drawn(view: DemoView, size: tuple[int, int] = (80, 24), encoding: str = "utf-8") -> list[str]:
    return [text_of(line).rstrip() for line in draw(view, size, encoding)]


def many(count: int) -> tuple[Cursor, ...]:
    return tuple(cursor(number, number / (count + 1), 0.5) for number in range(1, count + 1))


def test_the_head_says_what_is_played_where_it_goes_and_how_it_runs() -> None:
    assert drawn(VIEW)[:2] == [
        "touchd demo   scenario pinch, seed 3 → TUIO to 127.0.0.1:3333",
        "tracking  30.0 frames/s  latency 1.2 ms, p99 3.1 ms  1 touch",
    ]


def test_the_foot_says_how_to_end_it_and_who_sees_the_touches() -> None:
    assert drawn(VIEW)[-1] == "Ctrl-C ends it. Any TUIO client on 127.0.0.1:3333 sees these touches."


def test_each_touch_is_listed_with_its_place_and_speed() -> None:
    lines = drawn(VIEW)
    assert lines[2].endswith(" id      x      y   mm/s")
    assert lines[3].endswith("  7  0.250  0.750    300")


def test_a_touch_is_marked_in_the_picture_where_it_is() -> None:
    lines = drawn(VIEW)
    top, bottom = (next(i for i, line in enumerate(lines) if line.startswith(corner)) for corner in "┌└")
    row = next(i for i, line in enumerate(lines) if "●7" in line)
    width = lines[top].index("┐") - 1
    assert (row - top - 0.5) / (bottom - top - 1) == pytest.approx(0.75, abs=0.05)
    assert (lines[row].index("●") - 0.5) / width == pytest.approx(0.25, abs=0.02)


def test_the_picture_is_as_long_as_the_area_is_wide() -> None:
    lines = drawn(VIEW, (120, 30))
    height = sum(line.startswith("│") for line in lines)
    assert lines[2].index("┐") - 1 == pytest.approx(2.0 * height * 600 / 420, abs=1.5)


def test_what_stands_above_the_table_is_drawn_in_dots() -> None:
    risen = NOTHING.copy()
    risen[56:, :80] = True
    lines = drawn(replace(VIEW, risen=risen, cursors=()))
    assert all("⣿" not in line for line in lines[:10])
    for line in lines[15:19]:
        picture = line.split("│")[1]
        assert picture.count("⣿") == pytest.approx(len(picture) / 2, abs=1)
        assert picture.startswith("⣿⣿⣿")


def test_without_utf_8_everything_is_ascii() -> None:
    risen = np.ones_like(NOTHING)
    text = "\n".join(drawn(replace(VIEW, risen=risen, cursors=many(60)), encoding="iso8859-1"))
    assert text.isascii()
    assert "#" in text
    assert "O" in text
    assert ".. and " in text
    assert drawn(VIEW, encoding="no such encoding") == drawn(VIEW, encoding="ascii")


def test_the_state_says_why() -> None:
    calibrating = replace(VIEW, state=State.CALIBRATING, why="frame 12 of 60", cursors=())
    assert drawn(calibrating)[1].startswith("calibrating (frame 12 of 60)  30.0 frames/s")
    assert drawn(replace(VIEW, state=None))[1].startswith("setting up the synthetic table")


def test_before_the_first_frame_there_are_no_figures() -> None:
    view = replace(VIEW, state=None, cursors=(), metrics=MetricsSnapshot(0, 0, None, None, None, None))
    assert drawn(view)[1] == "setting up the synthetic table  0.0 frames/s  latency -, p99 -  0 touches"


def test_touches_that_cannot_be_sent_are_told() -> None:
    assert drawn(replace(VIEW, trouble="no route to host"))[-1] == "not sent: no route to host"
    assert plain_line(replace(VIEW, trouble="no route to host")).endswith("   not sent: no route to host")


def test_more_touches_than_lines_are_counted() -> None:
    lines = drawn(replace(VIEW, cursors=many(60)))
    listed = [line[-24:] for line in lines if "  0.500" in line]
    assert lines[-2].endswith(f"… and {60 - len(listed)} more")
    assert len(listed) >= 15


def test_a_narrow_terminal_has_the_list_below_the_picture() -> None:
    lines = drawn(VIEW, (40, 24))
    assert lines.index(" id      x      y   mm/s") > next(i for i, line in enumerate(lines) if "●7" in line)


def test_a_tiny_terminal_has_no_picture() -> None:
    assert drawn(VIEW, (30, 4)) == [
        "touchd demo   scenario pinch,",
        "tracking  30.0 frames/s  laten",
        " id      x      y   mm/s",
        "  7  0.250  0.750    300",
    ]
    assert drawn(VIEW, (10, 1)) == ["touchd dem"]


@settings(deadline=None, max_examples=200)
@given(
    columns=st.integers(1, 250),
    rows=st.integers(1, 90),
    places=st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.integers(1, 9999)), max_size=60),
    encoding=st.sampled_from(["utf-8", "ascii"]),
    trouble=st.sampled_from([None, "network is unreachable"]),
)
def test_it_fits_every_terminal(
    columns: int, rows: int, places: list[tuple[float, float, int]], encoding: str, trouble: str | None
) -> None:
    cursors = tuple(cursor(number, x, y) for x, y, number in places)
    lines = draw(replace(VIEW, cursors=cursors, trouble=trouble), (columns, rows), encoding)
    assert len(lines) <= rows
    assert all(len(text_of(line)) <= columns for line in lines)
    text_of(lines[0]).encode(encoding)


@settings(deadline=None)
@given(places=st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), max_size=12))
def test_no_label_covers_a_mark(places: list[tuple[float, float]]) -> None:
    cursors = [cursor(100 + number, x, y) for number, (x, y) in enumerate(places)]
    rows = area_cells(NOTHING, cursors, (50, 18), signs_for("utf-8"))
    cells = {(min(int(x * 50), 49), min(int(y * 18), 17)) for x, y in places}
    assert sum(text_of(row).count("●") for row in rows) == len(cells)


def test_a_plain_line_tells_state_figures_and_touches() -> None:
    assert plain_line(replace(VIEW, cursors=(cursor(7), cursor(8, 0.5, 0.1)))) == (
        "tracking   30.0 frames/s   latency 1.2 ms, p99 3.1 ms   2 touches: 7 at (0.250, 0.750), 8 at (0.500, 0.100)"
    )


def test_the_last_line_tells_what_happened() -> None:
    assert last_line(VIEW, 13.7) == (
        "touchd demo: 412 frames in 14 s, 7 touches sent to 127.0.0.1:3333, 2 frames dropped, 1 not rendered in time"
    )


def test_a_line_is_cut_across_its_spans() -> None:
    line: Line = (Span("touch", Style.BOLD), Span("down"), Span("up"))
    assert cut(line, 7) == (Span("touch", Style.BOLD), Span("do"))
    assert cut(line, 0) == ()


SENSOR = kinect_v1_sensor()
WHOLE = AreaCorners(((0.0, 0.0), (639.0, 0.0), (639.0, 479.0), (0.0, 479.0)))


def flat_surface(raw: int) -> Surface:
    still = np.ones((480, 640), np.bool_)
    reference = np.full((480, 640), raw, np.float32)
    return Surface(
        sensor=SENSOR,
        reference=reference,
        dmax=reference.astype(np.uint16),
        noise=np.zeros_like(reference),
        valid=still,
        moved=~still,
        frames=1,
        made_from="a test",
    )


def test_the_relief_shows_what_is_above_the_surface_and_nothing_where_there_is_no_reading() -> None:
    raw = np.full((480, 640), 700, np.uint16)
    raw[:240, :320] = 650  # nearer by about 10 cm
    raw[240:, :320] = SENSOR.invalid
    raw[240:, 320:] = 698  # by 5 mm
    risen = Relief(SENSOR, WHOLE).risen(Frame(0, 0, raw), flat_surface(700))
    assert risen.shape == (112, 160)
    assert risen[:55, :79].all()
    assert not risen[57:].any()
    assert not risen[:, 81:].any()


def test_the_relief_is_empty_until_there_is_a_frame_and_a_surface() -> None:
    frame = Frame(0, 0, np.full((480, 640), 700, np.uint16))
    relief = Relief(SENSOR, WHOLE)
    assert not relief.risen(None, flat_surface(700)).any()
    assert not relief.risen(frame, None).any()


class ThreeFrames:
    """A source of frames 0, 1 and 4."""

    name = "three frames"
    waiting = "for the test"

    def __init__(self) -> None:
        self.closed = False

    @property
    def sensor(self) -> Sensor:
        return SENSOR

    @property
    def identified(self) -> bool:
        return True

    def show(self, state: State) -> None:
        pass

    @property
    def reconnects(self) -> int:
        return 0

    @property
    def packet_loss(self) -> float | None:
        return None

    def frames(self) -> Iterator[Frame]:
        return iter([Frame(index, index, np.zeros((2, 2), np.uint16)) for index in (0, 1, 4)])

    def close(self) -> None:
        self.closed = True


def test_a_watched_source_is_the_same_source_with_its_gaps_counted() -> None:
    source = ThreeFrames()
    watched = WatchedSource(source)
    assert (watched.sensor, watched.name, watched.waiting) == (SENSOR, "three frames", "for the test")
    assert [frame.index for frame in watched.frames()] == [0, 1, 4]
    assert watched.last is not None
    assert (watched.last.index, watched.left_out) == (4, 2)
    watched.close()
    assert source.closed
