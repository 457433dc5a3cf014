"""Pictures of a frame on its way through each method, stage by stage, as in the paper's Figure 2."""

from collections.abc import Iterator, Sequence
from math import cos, sin
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.contacts.fingertip import FingertipMethod
from touchd.contacts.patch import finger_height
from touchd.geometry import depth_mm
from touchd.lab.accuracy.contenders import Contender
from touchd.lab.accuracy.trials import learn, pipeline_of
from touchd.lab.scenes import LabScene, TruthFrame, lab_scene
from touchd.model import Cursor, Floats, Image16, Shell
from touchd.pipeline import Pipeline
from touchd.ready import Ready

Picture: TypeAlias = NDArray[np.uint8]
Panel: TypeAlias = tuple[str, Picture]
Crop: TypeAlias = tuple[slice, slice]

_SCENE, _SEED, _HEIGHTS_MM = "pinch", 7, (750.0, 1500.0)
_METHODS = ("shell", "fingertip")
_AROUND_PX, _PANEL_PX, _HEADING_PX = 70, 300, 26
_TOUCH, _TRUTH, _INK, _PAPER = (60, 230, 255), (120, 255, 120), (50, 40, 36), (250, 248, 246)
_HIGHEST_MM = 60.0
_BOXCAR_PX = 9
_SHOWN_MM = 25.0  # of a fitted finger
_FRAMES_BEFORE = 60  # that a method has seen: hands come before they touch


def stage_pictures() -> Iterator[tuple[str, Picture]]:
    """Yield a name and a picture for each method and height: panels of one frame, side by side."""
    for height_mm in _HEIGHTS_MM:
        scene = lab_scene(_SCENE, height_mm, _SEED)
        truth = _chosen(scene)
        learned = learn(scene)
        for method in _METHODS:
            pipeline = pipeline_of(Contender(method, method), scene, learned)
            yield f"stages-{method}-{height_mm:.0f}", _sheet(_panels(pipeline, scene, truth, method))


def _chosen(scene: LabScene) -> TruthFrame:
    """Return the middle one of the frames in which most fingers touch."""
    frames = [scene.truth(i) for i in range(scene.calibration_frames, scene.calibration_frames + scene.frames)]
    most = max(sum(tip.touching for tip in frame.tips) for frame in frames)
    crowded = [frame for frame in frames if sum(tip.touching for tip in frame.tips) == most]
    return crowded[len(crowded) // 2]


def _panels(pipeline: Pipeline, scene: LabScene, truth: TruthFrame, method: str) -> list[Panel]:
    ready = pipeline.ready
    if ready is None:
        raise ValueError("the scene's pipeline has no surface")
    for index in range(truth.index - _FRAMES_BEFORE, truth.index):
        pipeline.step(scene.frame(index))
    frame = scene.frame(truth.index)
    raw, cursors = frame.raw, pipeline.step(frame).cursors
    crop = _crop(scene, truth)
    heights = heights_mm(ready, raw)
    touches = ("touches (yellow) and the truth (green)", _marked(_shaded(heights), ready, cursors, truth)[crop])
    if method == "shell":
        shares = in_shell(ready.shell, raw)
        low_passed = cv2.blur(shares, (_BOXCAR_PX, _BOXCAR_PX))
        return [
            ("raw depth", _grey(raw, crop)),
            ("in the shell", _colour(shares)[crop]),
            (f"low-passed, {_BOXCAR_PX} px", _colour(np.asarray(low_passed, np.uint8))[crop]),
            touches,
        ]
    return [
        ("raw depth", _grey(raw, crop)),
        ("height above the surface", _shaded(heights)[crop]),
        ("outlines at 6 and 12 mm", _outlined(heights)[crop]),
        ("the fitted fingertips", _shaded(fitted_mm(ready, raw))[crop]),
        touches,
    ]


def heights_mm(ready: Ready, raw: Image16) -> Floats:
    """Return how much nearer than the empty surface each pixel is, in mm along the optical axis; 0 without reading."""
    sensor = ready.surface.sensor
    above = depth_mm(sensor, ready.surface.reference) - sensor.to_mm[raw]
    return np.nan_to_num(above, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)


def fitted_mm(ready: Ready, raw: Image16) -> Floats:
    """Return the heights in mm of the fingertips that the method fits to a picture, 0 beside them."""
    heights = np.zeros(raw.shape, np.float32)
    found = ready.method.look(raw, ()) if isinstance(ready.method, FingertipMethod) else None
    rows, columns = np.indices(raw.shape)
    for tip in found.tips if found else ():
        lay, du, dv = tip.guess.lay, columns - tip.u, rows - tip.v
        area = lay.u_by_x * lay.v_by_y - lay.u_by_y * lay.v_by_x
        x_mm, y_mm = (lay.v_by_y * du - lay.u_by_y * dv) / area, (lay.u_by_x * dv - lay.v_by_x * du) / area
        along, across = x_mm * cos(tip.angle) + y_mm * sin(tip.angle), y_mm * cos(tip.angle) - x_mm * sin(tip.angle)
        finger = finger_height(np.asarray(along), np.asarray(across), tip.radius_mm, tip.pitch_rad)
        near = (finger > 0.0) & (along < _SHOWN_MM)
        heights[near] = np.maximum(heights, finger + tip.clearance_mm)[near]
    return heights


def in_shell(shell: Shell, raw: Image16) -> Picture:
    """Return 255 where a pixel is in the shell, else 0."""
    return np.where((raw > shell.dmin) & (raw < shell.dmax), 255, 0).astype(np.uint8)


def _crop(scene: LabScene, truth: TruthFrame) -> Crop:
    places = scene.camera.pixels(np.array([[tip.x_mm, tip.y_mm, tip.z_mm] for tip in truth.tips if tip.touching]))
    width, height = scene.sensor.size
    u, v = places.mean(axis=0)
    left = int(np.clip(u - _AROUND_PX, 0, width - 2 * _AROUND_PX))
    top = int(np.clip(v - _AROUND_PX, 0, height - 2 * _AROUND_PX))
    return slice(top, top + 2 * _AROUND_PX), slice(left, left + 2 * _AROUND_PX)


def _grey(raw: Image16, crop: Crop) -> Picture:
    part = raw[crop].astype(np.float32)
    low, high = np.percentile(part[part < part.max()], [1, 99])
    return _colour(np.clip((high - part) * 255.0 / max(1.0, high - low), 0, 255).astype(np.uint8))


def _colour(grey: Picture) -> Picture:
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def _shaded(heights: Floats) -> Picture:
    shades = np.clip(20.0 + cv2.medianBlur(heights, 3) * (235.0 / _HIGHEST_MM), 0, 255).astype(np.uint8)
    return np.asarray(cv2.applyColorMap(shades, cv2.COLORMAP_INFERNO), np.uint8)


def _outlined(heights: Floats) -> Picture:
    picture = _shaded(heights)
    smooth = cv2.blur(cv2.medianBlur(heights, 3), (3, 3))
    for level, colour in ((6.0, (255, 200, 80)), (12.0, (255, 255, 255))):
        outlines, _ = cv2.findContours((smooth > level).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, [one for one in outlines if len(one) > 12], -1, colour, 1)
    return picture


def _marked(picture: Picture, ready: Ready, cursors: Sequence[Cursor], truth: TruthFrame) -> Picture:
    corners = np.array(ready.settings.area.corners_px if ready.settings.area else (), np.float32)
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    to_px = np.asarray(cv2.getPerspectiveTransform(unit, corners), np.float64)
    for tip in truth.tips:
        if tip.touching:
            cv2.drawMarker(picture, _pixel(to_px, tip.x, tip.y), _TRUTH, cv2.MARKER_CROSS, 7, 1)
    for cursor in cursors:
        cv2.circle(picture, _pixel(to_px, cursor.x, cursor.y), 4, _TOUCH, 1, cv2.LINE_AA)
    return picture


def _pixel(to_px: NDArray[np.float64], x: float, y: float) -> tuple[int, int]:
    u, v = cv2.perspectiveTransform(np.array([[[x, y]]], np.float64), to_px)[0, 0]
    return round(float(u)), round(float(v))


def _sheet(panels: Sequence[Panel]) -> Picture:
    sheet = np.full((_PANEL_PX + _HEADING_PX, len(panels) * (_PANEL_PX + 8), 3), _PAPER, np.uint8)
    for place, (title, picture) in enumerate(panels):
        left = place * (_PANEL_PX + 8)
        large = cv2.resize(picture, (_PANEL_PX, _PANEL_PX), interpolation=cv2.INTER_NEAREST)
        sheet[_HEADING_PX:, left : left + _PANEL_PX] = large // 8 * 8 + 4  # fewer colours make a smaller file
        cv2.putText(sheet, title, (left + 2, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.42, _INK, 1, cv2.LINE_AA)
    return sheet
