"""The chart of docs/accuracy.md, as SVG: the share of cursors that lie within a distance of the touch point."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_WIDTH, _HEIGHT, _MARGIN, _LEGEND = 380, 250, 46, 120
_FARTHEST_MM = 20.0
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#999999", "#e69f00", "#56b4e9")


def error_chart(results: Mapping[str, Any]) -> str:
    """Return a panel for each height of the first sensor, with a line for each method."""
    sensor = results["sensors"][0]
    heights = results["heights_mm"]
    width = len(heights) * _WIDTH + _LEGEND
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {_HEIGHT + 20}" font-family="sans-serif" '
        f'font-size="12"><rect width="100%" height="100%" fill="white"/>'
    ]
    for place, height in enumerate(heights):
        rows = [s for s in results["summaries"] if (s["sensor"], s["height_mm"]) == (sensor, height)]
        title = f"simulated: model of {sensor}, {height / 1000:g} m"
        parts += _panel(place * _WIDTH, title, rows, results["percents"])
    parts += _legend(len(heights) * _WIDTH, [s["method"] for s in results["summaries"] if s["sensor"] == sensor])
    return "\n".join([*parts, "</svg>\n"])


def _panel(left: int, title: str, rows: Sequence[Mapping[str, Any]], percents: Sequence[float]) -> Iterator[str]:
    right, bottom = left + _WIDTH - 16, _HEIGHT - _MARGIN

    def at(mm: float, percent: float) -> str:
        x = left + _MARGIN + (right - left - _MARGIN) * min(mm, _FARTHEST_MM) / _FARTHEST_MM
        return f"{x:.1f},{bottom - (bottom - 30) * percent / 100:.1f}"

    yield f'<text x="{left + _MARGIN}" y="18">{title}</text>'
    for percent in (0, 25, 50, 75, 100):
        (x0, y), (x1, _) = at(0, percent).split(","), at(_FARTHEST_MM, percent).split(",")
        yield f'<line x1="{x0}" y1="{y}" x2="{x1}" y2="{y}" stroke="#ddd"/>'
        yield f'<text x="{float(x0) - 6}" y="{float(y) + 4}" text-anchor="end">{percent} %</text>'
    for mm in range(0, int(_FARTHEST_MM) + 1, 5):
        x, y = at(mm, 0).split(",")
        yield f'<text x="{x}" y="{float(y) + 16}" text-anchor="middle">{mm}</text>'
    middle = (left + _MARGIN + right) / 2
    yield f'<text x="{middle}" y="{_HEIGHT - 12}" text-anchor="middle">mm from the touch point</text>'
    for colour, row in zip(_COLOURS, rows, strict=False):
        errors = row["error_percentiles_mm"]
        if errors:
            points = " ".join(at(mm, percent) for mm, percent in zip([0.0, *errors], [0, *percents], strict=True))
            yield f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'


def _legend(left: int, methods: Sequence[str]) -> Iterator[str]:
    for row, (colour, method) in enumerate(zip(_COLOURS, dict.fromkeys(methods), strict=False)):
        y = 40 + 20 * row
        yield f'<line x1="{left}" y1="{y}" x2="{left + 20}" y2="{y}" stroke="{colour}" stroke-width="2"/>'
        yield f'<text x="{left + 26}" y="{y + 4}">{method}</text>'
