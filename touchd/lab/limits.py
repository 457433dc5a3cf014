"""`touchd lab limits`: how much of each touching fingertip an ideal camera sees, which no method can go beyond."""

from collections.abc import Iterator
from itertools import product

import numpy as np

from touchd.errors import UsageError
from touchd.lab.accuracy.ranges import heights_of, names_of, seeds_of
from touchd.lab.scenes import LAB_SCENES, LONG_SCENES, LabScene, TrueTip, lab_scene
from touchd.model import Floats

# A finger's upper side is 11 to 16 mm above the surface where it touches: what shows nothing lower is hidden.
HIDDEN_MM = 20.0
_NEAR_MM = 10.0
_RISEN_MM = 2.0
_LOWEST_PERCENT = 5


def limits(scenes: str | None, heights: str, seeds: str) -> Iterator[str]:
    """Yield a table: for each scene and height the touches, how low they are seen, and how many are hidden.

    Lists apart by commas as for `touchd bench accuracy`; without any, all scenes but the long ones. Raises UsageError.
    """
    names = names_of(scenes) or tuple(name for name in LAB_SCENES if name not in LONG_SCENES)
    unknown = [name for name in names if name not in LAB_SCENES]
    if unknown:
        raise UsageError(f"--scenes: there is no lab scene {unknown[0]!r}; choose from {', '.join(LAB_SCENES)}")
    yield f"simulated, ideal camera, seeds {seeds}: the lowest that is seen within {_NEAR_MM:g} mm of each touch point"
    yield f"{'':24s}{'height':>8s}{'touches':>9s}{'median':>9s}{'p90':>9s}{f'above {HIDDEN_MM:g} mm':>14s}"
    for name, height_mm in product(names, heights_of(heights)):
        scenes_run = (lab_scene(name, height_mm, seed) for seed in seeds_of(seeds))
        seen = [height for scene in scenes_run for height in lowest_seen_mm(scene)]
        if seen:
            hidden = np.count_nonzero(np.array(seen) > HIDDEN_MM) / len(seen)
            median, p90 = np.percentile(seen, [50, 90])
            row = f"{name:24s}{height_mm / 1000:>6g} m{len(seen):9d}{median:6.1f} mm{p90:6.1f} mm"
            yield f"{row}{100 * hidden:12.0f} %"


def lowest_seen_mm(scene: LabScene) -> list[float]:
    """Return for each touch, in the middle one of its frames, how low above the surface anything of it is seen.

    That is the 5th percentile of the heights (along the optical axis, of what rises by 2 mm or more) within 10 mm of
    the touch point in a picture without noise; infinite where nothing rises there.
    """
    touching: dict[int, list[tuple[int, TrueTip]]] = {}
    for index in range(scene.calibration_frames, scene.calibration_frames + scene.frames):
        for tip in scene.truth(index).tips:
            if tip.touching:
                touching.setdefault(tip.tip, []).append((index, tip))
    middles = (frames[len(frames) // 2] for frames in touching.values())
    return [_lowest_mm(scene, index, tip) for index, tip in middles]


def _lowest_mm(scene: LabScene, index: int, tip: TrueTip) -> float:
    heights: Floats = scene.empty_depth(index).depth_mm - scene.true_depth(index).depth_mm
    u, v = scene.camera_at(index).pixels(np.array([tip.x_mm, tip.y_mm, tip.z_mm]))
    reach_px = _NEAR_MM * scene.camera.intrinsics.fx / scene.height_mm
    rows, columns = np.indices(heights.shape)
    risen = heights[((columns - u) ** 2 + (rows - v) ** 2 < reach_px**2) & (heights >= _RISEN_MM)]
    return float(np.percentile(risen, _LOWEST_PERCENT)) if risen.size else float("inf")
