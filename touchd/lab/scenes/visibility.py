"""How much of each fingertip the camera sees: what nobody sees nobody can find."""

import numpy as np

from touchd.geometry import Doubles
from touchd.lab.scenes.scene import LabScene
from touchd.lab.scenes.truth import TrueTip
from touchd.model import Floats
from touchd.table.scene import TableCamera

_POINTS = 160  # spread evenly over a ball
_BEHIND_MM = 30.0  # so much higher the finger's own last bone may lie, which shows where the tip is
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def visible_shares(scene: LabScene, index: int) -> dict[int, float]:
    """Return, by finger, which share of its fingertip's camera-facing side only its own last bone hides (0..1).

    On a bowl the ball is taken to stand upright over the touch point.
    """
    tips = scene.truth(index).tips
    if not tips:
        return {}
    depth = scene.true_depth(index)
    readable = depth.depth_mm if depth.dark is None else np.where(depth.dark, np.float32(0.0), depth.depth_mm)
    camera = scene.camera_at(index)
    return {tip.finger: _visible_share(tip, camera, readable) for tip in tips}


def _visible_share(tip: TrueTip, camera: TableCamera, depth_mm: Floats) -> float:
    centre = np.array([tip.x_mm, tip.y_mm, tip.z_mm + tip.height_mm + tip.radius_mm])
    outwards = _sphere()
    facing = outwards[outwards @ (camera.eye_mm() - centre) > 0.0]
    points = centre + tip.radius_mm * facing
    pixels = np.rint(camera.pixels(points)).astype(int)
    inside = np.all((pixels >= 0) & (pixels < np.array(depth_mm.shape[::-1])), axis=-1)
    seen = depth_mm[pixels[inside, 1], pixels[inside, 0]] > camera.to_camera(points[inside])[:, 2] - _BEHIND_MM
    return float(np.count_nonzero(seen)) / len(points)


def _sphere() -> Doubles:
    """Return directions (N, 3) spread evenly (Fibonacci's spiral)."""
    number = np.arange(_POINTS) + 0.5
    height = 1.0 - 2.0 * number / _POINTS
    around, level = _GOLDEN_ANGLE * number, np.sqrt(1.0 - height * height)
    directions: Doubles = np.stack([level * np.cos(around), level * np.sin(around), height], -1)
    return directions
