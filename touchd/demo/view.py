"""What the demo shows, drawn as lines of text that fit a terminal of any size."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from math import hypot
from typing import TypeAlias

from touchd.demo.area_picture import area_cells
from touchd.demo.styles import Line, Signs, Span, Style, cut, signs_for
from touchd.metrics import MetricsSnapshot
from touchd.model import Cursor, Mask, State

Size: TypeAlias = tuple[int, int]

_LIST_COLUMNS = 25
_GAP = "  "
_WIDE_COLUMNS = 62  # from here on the list stands beside the picture
_LEAST_PICTURE = (16, 4)  # columns and rows within its border, below which there is none
_LARGEST_COLUMNS = 120
_CELL_ASPECT = 2.0  # a character is about twice as high as it is wide


@dataclass(frozen=True, slots=True)
class DemoView:
    """Everything that the demo shows at one moment."""

    scenario: str
    seed: int
    destination: str
    state: State | None  # None before the first frame
    why: str | None
    metrics: MetricsSnapshot
    left_out: int  # frames that were not rendered in time
    cursors: tuple[Cursor, ...]
    touches: int  # that began so far
    area_mm: tuple[float, float]
    risen: Mask  # (H, W) over the area: where something is above the table
    trouble: str | None  # what keeps touches from being sent


def draw(view: DemoView, size: Size, encoding: str) -> list[Line]:
    """Return at most ``size`` (columns, rows) of lines; without UTF-8 in plain ASCII."""
    columns, rows = size
    signs = signs_for(encoding)
    head: list[Line] = [_title(view, signs), _status(view)]
    foot: list[Line] = []
    if rows >= 8:
        foot.append((Span(_hint(view), Style.DIM),))
    if view.trouble:
        foot.append((Span(f"not sent: {view.trouble}", Style.BAD),))
    body = _body(view, (columns, rows - len(head) - len(foot)), signs)
    return [cut(line, columns) for line in [*head, *body, *foot]][:rows]


def plain_line(view: DemoView) -> str:
    """Return what there is to see as one line of ASCII."""
    parts = [_state_words(view), *_figures(view)]
    if view.cursors:
        parts[-1] += ": " + ", ".join(f"{c.session_id} at ({c.x:.3f}, {c.y:.3f})" for c in view.cursors)
    if view.trouble:
        parts.append(f"not sent: {view.trouble}")
    return "   ".join(parts)


def last_line(view: DemoView, seconds: float) -> str:
    """Return what happened in all."""
    return (
        f"touchd demo: {view.metrics.frames} frames in {seconds:.0f} s, {view.touches} touches sent to "
        f"{view.destination}, {view.metrics.dropped} frames dropped, {view.left_out} not rendered in time"
    )


def _title(view: DemoView, signs: Signs) -> Line:
    return (
        Span("touchd demo", Style.BOLD),
        Span(f"   scenario {view.scenario}, seed {view.seed} {signs.arrow} TUIO to {view.destination}"),
    )


def _hint(view: DemoView) -> str:
    return f"Ctrl-C ends it. Any TUIO client on {view.destination} sees these touches."


def _status(view: DemoView) -> Line:
    style = Style.GOOD if view.state is State.TRACKING else Style.BAD
    return (Span(_state_words(view), style), Span(_GAP + _GAP.join(_figures(view))))


def _state_words(view: DemoView) -> str:
    if view.state is None:
        return "setting up the synthetic table"
    return f"{view.state.value} ({view.why})" if view.why else view.state.value


def _figures(view: DemoView) -> list[str]:
    figures = view.metrics
    now = len(view.cursors)
    return [
        f"{figures.fps or 0.0:.1f} frames/s",
        f"latency {_ms(figures.latency_p50_ms)}, p99 {_ms(figures.latency_p99_ms)}",
        f"{now} {'touch' if now == 1 else 'touches'}",
    ]


def _ms(latency_ms: float | None) -> str:
    return "-" if latency_ms is None else f"{latency_ms:.1f} ms"


def _body(view: DemoView, size: Size, signs: Signs) -> list[Line]:
    """Return the picture of the area with the list of touches beside it, or below where there is more room."""
    columns, rows = size
    wide = columns >= _WIDE_COLUMNS
    listed = 0 if wide else min(4, rows // 4)
    beside = _LIST_COLUMNS + len(_GAP) if wide else 0
    picture = _picture(view, (columns - beside, rows - listed), signs)
    if not picture:
        return list(_touches(view, rows, signs))
    if not wide:
        return [*picture, *_touches(view, listed, signs)]
    table = _touches(view, len(picture), signs)
    return [(*left, Span(_GAP), *right) for left, right in zip_longest(picture, table, fillvalue=())]


def _picture(view: DemoView, size: Size, signs: Signs) -> list[Line]:
    """Return the area with its border, as large as fits and as long as it is wide; nothing where it would be tiny."""
    aspect = view.area_mm[0] / view.area_mm[1] * _CELL_ASPECT
    columns = min(size[0] - 2, round((size[1] - 2) * aspect), _LARGEST_COLUMNS)
    rows = min(size[1] - 2, round(columns / aspect))
    if columns < _LEAST_PICTURE[0] or rows < _LEAST_PICTURE[1]:
        return []
    side = Span(signs.vertical, Style.DIM)
    top, bottom = (Span(f"{a}{signs.horizontal * columns}{b}", Style.DIM) for a, b in signs.corners)
    cells = area_cells(view.risen, view.cursors, (columns, rows), signs)
    return [(top,), *((side, *row, side) for row in cells), (bottom,)]


def _touches(view: DemoView, rows: int, signs: Signs) -> Iterator[Line]:
    """Yield a headed list of the touches of so many lines at most."""
    if rows < 2:
        return
    yield (Span(" id      x      y   mm/s", Style.DIM),)
    cursors = view.cursors
    shown = cursors if len(cursors) <= rows - 1 else cursors[: rows - 2]
    for cursor in shown:
        speed_mm_s = hypot(cursor.vx * view.area_mm[0], cursor.vy * view.area_mm[1])
        yield (
            Span(f"{cursor.session_id:>3}", Style.TOUCH),
            Span(f"  {cursor.x:.3f}  {cursor.y:.3f}  {speed_mm_s:>5.0f}"),
        )
    if len(shown) < len(cursors):
        yield (Span(f"{signs.more} and {len(cursors) - len(shown)} more", Style.DIM),)
