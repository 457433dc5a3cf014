"""docs/accuracy.md: the generated part between its marks, and the files that it shows."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2

from touchd.errors import RecordingError
from touchd.formats.folder import writing
from touchd.lab.report.chart import error_chart
from touchd.lab.report.stages import stage_pictures
from touchd.lab.report.tables import markdown

BEGIN = "<!-- begin: written by python -m touchd.lab.report -->"
END = "<!-- end -->"
_SKELETON = f"# How accurate touchd is\n\n{BEGIN}\n{END}\n"


def write_report(docs: Path, results: Mapping[str, Any]) -> Iterator[Path]:
    """Write everything into a folder and yield each file's path. ``results``: as `touchd bench accuracy --json` has it.

    Raises RecordingError where accuracy.md has lost its marks, and OutputError.
    """
    page, pictures = docs / "accuracy.md", docs / "accuracy"
    with writing(pictures):
        pictures.mkdir(parents=True, exist_ok=True)
    text = page.read_text(encoding="utf-8") if page.exists() else _SKELETON
    with writing(page):
        page.write_text(between_marks(text, "\n".join(markdown(results))), encoding="utf-8")
    yield page
    chart = pictures / "errors.svg"
    with writing(chart):
        chart.write_text(error_chart(results), encoding="utf-8")
    yield chart
    for name, picture in stage_pictures():
        path = pictures / f"{name}.png"
        with writing(path):
            path.write_bytes(cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes())
        yield path


def between_marks(text: str, generated: str) -> str:
    """Return a page with what is between its marks replaced. RecordingError where a mark is missing."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise RecordingError(
            f"accuracy.md has no line {BEGIN!r} with {END!r} after it: put them where the tables belong"
        )
    return f"{before}{BEGIN}\n{generated}\n{END}{after}"
