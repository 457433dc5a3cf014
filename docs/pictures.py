"""Draws the README's picture, docs/demo.png: what the camera sees beside what `touchd demo` shows of it.

Run it from the repository's root with the Python of its virtual environment: .venv/bin/python docs/pictures.py
"""
# ruff: noqa: INP001  a script, no package

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from touchd.demo.styles import Line, Style
from touchd.demo.view import DemoView, draw
from touchd.demo.watching import Relief
from touchd.metrics import MetricsSnapshot
from touchd.model import AreaCorners, Cursor, Frame, Mask, State, Surface
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.scenarios import AREA, CAMERA, area_corners
from touchd.table.show import Show, frame_time_ns
from touchd.table.table import Table

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]

PATH = Path(__file__).parent / "demo.png"
SCENARIO, SEED = "ten", 1
CALIBRATION_FRAMES, SHOWN_FRAME = 60, 138
TERMINAL = (78, 21)  # columns, rows
CELL = (9, 19)  # px
FONT = cv2.FONT_HERSHEY_SIMPLEX
MARGIN, HEADING = 14, 34  # px
HIGHEST_MM = 140.0
# Speed is no part of a deterministic picture: these are from 62 s of `touchd demo --scenario ten` on two slow cores.
MEASURED = MetricsSnapshot(
    frames=1833, dropped=7, fps=30.0, latency_p50_ms=3.9, latency_p99_ms=7.8, latency_max_ms=None
)

PAPER, INK, TOUCH = (250, 248, 246), (50, 40, 36), (60, 230, 255)
TERMINAL_PAPER = (38, 30, 27)
TERMINAL_INKS: dict[Style, Colour] = {
    Style.PLAIN: (222, 222, 222),
    Style.BOLD: (255, 255, 255),
    Style.DIM: (140, 140, 140),
    Style.HAND: (200, 180, 70),
    Style.TOUCH: TOUCH,
    Style.GOOD: (120, 230, 120),
    Style.BAD: (100, 100, 255),
}
BRAILLE_DOTS = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3))  # column, row of each bit's dot
BOX_LINES = {"─": "lr", "│": "tb", "┌": "rb", "┐": "lb", "└": "rt", "┘": "lt"}


def main() -> None:
    """Render, detect, draw, write."""
    frame, cursors, surface = seen()
    corners = area_corners()
    left = camera_view(frame, cursors, surface, corners)
    relief = Relief(surface.sensor, corners).risen(frame, surface)
    right = terminal_view(draw(demo_view(cursors, relief), TERMINAL, "utf-8"))
    picture = side_by_side(
        ("What the depth camera sees: warmer is higher above the table", left),
        ("What touchd demo shows: hands, and the touches that it sends", right),
    )
    cv2.imwrite(str(PATH), quantized(picture), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def seen() -> tuple[Frame, tuple[Cursor, ...], Surface]:
    """Return one frame of the synthetic table, the touches found in it, and the surface that was learned."""
    table, show = Table(CAMERA, SEED), Show(SCENARIO, SEED, CALIBRATION_FRAMES)
    settings = PipelineSettings(calibration=CalibrationSettings(frames=CALIBRATION_FRAMES), area=area_corners())
    pipeline = Pipeline(table.sensor, settings, "the picture")
    pipeline.calibrate()
    for index in range(SHOWN_FRAME):
        pipeline.step(table.render(show.moment(index).hands, frame_time_ns(index), index))
    frame = table.render(show.moment(SHOWN_FRAME).hands, frame_time_ns(SHOWN_FRAME), SHOWN_FRAME)
    cursors = pipeline.step(frame).cursors
    if pipeline.ready is None:
        raise RuntimeError("the table was not calibrated")
    return frame, cursors, pipeline.ready.surface


def demo_view(cursors: tuple[Cursor, ...], risen: Mask) -> DemoView:
    """Return what the demo would show."""
    return DemoView(
        scenario=SCENARIO,
        seed=SEED,
        destination="127.0.0.1:3333",
        state=State.TRACKING,
        why=None,
        metrics=MEASURED,
        left_out=0,
        cursors=cursors,
        touches=len(cursors),
        area_mm=AREA.size_mm,
        risen=risen,
        trouble=None,
    )


def camera_view(frame: Frame, cursors: Sequence[Cursor], surface: Surface, corners: AreaCorners) -> Picture:
    """Return the frame in false colours, with the area's outline and the touches."""
    to_mm = surface.sensor.to_mm
    reference = to_mm[np.rint(surface.reference).astype(int).clip(0, len(to_mm) - 1)]
    heights = cv2.medianBlur(np.nan_to_num(reference - to_mm[frame.raw], nan=0.0).astype(np.float32), 5)
    shades = np.clip(20.0 + heights * (235.0 / HIGHEST_MM), 0.0, 255.0).astype(np.uint8)
    picture = np.asarray(cv2.applyColorMap(shades, cv2.COLORMAP_INFERNO), np.uint8)
    outline = np.rint(np.array(corners.corners_px)).astype(np.int32)
    cv2.polylines(picture, [outline], isClosed=True, color=(235, 235, 235), thickness=1, lineType=cv2.LINE_AA)
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    to_pixels = cv2.getPerspectiveTransform(unit, np.array(corners.corners_px, np.float32))
    for cursor in cursors:
        u, v = cv2.perspectiveTransform(np.array([[[cursor.x, cursor.y]]]), to_pixels)[0, 0]
        centre = (round(u), round(v))
        cv2.circle(picture, centre, 9, (0, 0, 0), 4, cv2.LINE_AA)
        cv2.circle(picture, centre, 9, TOUCH, 2, cv2.LINE_AA)
        label = (centre[0] - 4 * len(str(cursor.session_id)), centre[1] - 15)
        write(picture, str(cursor.session_id), label, 0.42, TOUCH)
    return picture[:, :632]  # the rightmost columns of a Kinect's picture are blind


def terminal_view(lines: Sequence[Line]) -> Picture:
    """Return the lines as a terminal shows them."""
    columns, rows = TERMINAL
    picture = np.full((rows * CELL[1] + 16, columns * CELL[0] + 16, 3), TERMINAL_PAPER, np.uint8)
    for row, line in enumerate(lines):
        signs = [(sign, TERMINAL_INKS[span.style]) for span in line for sign in span.text]
        for column, (sign, colour) in enumerate(signs):
            draw_sign(picture, sign, (8 + column * CELL[0], 8 + row * CELL[1]), colour)
    return picture


def draw_sign(picture: Picture, sign: str, at: tuple[int, int], colour: Colour) -> None:
    """Draw one character into its cell, whose top left corner is ``at``."""
    left, top = at
    width, height = CELL
    if 0x2800 <= ord(sign) <= 0x28FF:
        for bit, (column, row) in enumerate(BRAILLE_DOTS):
            if (ord(sign) - 0x2800) >> bit & 1:
                place = (left + (1 + 2 * column) * width // 4, top + (1 + 2 * row) * height // 8)
                cv2.circle(picture, place, 1, colour, -1, cv2.LINE_AA)
    elif sign in BOX_LINES:
        middle = (left + width // 2, top + height // 2)
        ends = {"l": (left, middle[1]), "r": (left + width, middle[1]), "t": (middle[0], top)}
        ends["b"] = (middle[0], top + height)
        for side in BOX_LINES[sign]:
            cv2.line(picture, middle, ends[side], colour, 1)
    elif sign == "●":
        cv2.circle(picture, (left + width // 2, top + height // 2), 4, colour, -1, cv2.LINE_AA)
    elif sign == "→":
        middle_row = top + height // 2
        cv2.arrowedLine(picture, (left, middle_row), (left + width, middle_row), colour, 1, cv2.LINE_AA, tipLength=0.4)
    elif sign != " ":
        (wide, _), _ = cv2.getTextSize(sign, FONT, 0.42, 1)
        write(picture, sign, (left + (width - wide) // 2, top + height - 6), 0.42, colour)


def side_by_side(*parts: tuple[str, Picture]) -> Picture:
    """Return the pictures with their headings, scaled to one height."""
    height = max(picture.shape[0] for _, picture in parts)
    scaled = [(text, scaled_to(picture, height)) for text, picture in parts]
    width = sum(picture.shape[1] for _, picture in scaled) + MARGIN * (len(parts) + 1)
    sheet = np.full((height + HEADING + MARGIN, width, 3), PAPER, np.uint8)
    left = MARGIN
    for text, picture in scaled:
        write(sheet, text, (left, HEADING - 11), 0.55, INK)
        sheet[HEADING : HEADING + height, left : left + picture.shape[1]] = picture
        left += picture.shape[1] + MARGIN
    return sheet


def scaled_to(picture: Picture, height: int) -> Picture:
    """Return a picture of this height."""
    width = round(picture.shape[1] * height / picture.shape[0])
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def quantized(picture: Picture) -> Picture:
    """Return a picture with fewer colours, which makes a smaller file."""
    return np.asarray(picture // 8 * 8 + 4, np.uint8)


def write(picture: Picture, text: str, at: tuple[int, int], scale: float, colour: Colour) -> None:
    """Write text whose baseline begins at a place."""
    cv2.putText(picture, text, at, FONT, scale, colour, 1, cv2.LINE_AA)


if __name__ == "__main__":
    main()
