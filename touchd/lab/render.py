"""`touchd lab render`: a lab scene as a recording that any program can be run on, with the truth beside it."""

import json
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path

from touchd.errors import UsageError
from touchd.formats.folder import writing
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.png_folder import write_png_folder
from touchd.geometry import ZeroPlane
from touchd.lab.scenes import LAB_SCENES, LabScene, lab_scene
from touchd.lab.scoring import HAPPENINGS_NAME
from touchd.model import Frame

TRUTH_NAME, CONFIG_NAME, README_NAME = "truth.json", "touchd.yaml", "README.md"


def render(name: str, height_mm: float, seed: int, folder: Path, say: Callable[[str], None]) -> None:
    """Render the scene of this name into a folder. Raises UsageError for one that is none, and OutputError."""
    if not 400.0 <= height_mm <= 4000.0:
        raise UsageError(f"--height: expected 400 to 4000 mm, found {height_mm:g}")
    render_scene(lab_scene(name, height_mm, seed), folder, say)


def render_scene(scene: LabScene, folder: Path, say: Callable[[str], None]) -> None:
    """Write a scene's frames, ``truth.json``, the ``touchd.yaml`` it is meant for, and a README.md.

    Where there is more than fingertips, ``happenings.json`` tells it.
    A Kinect's scene becomes a libfreenect recording, one of a camera in mm a folder of 16-bit PNG. The folder must be
    new or empty. Raises OutputError where it is not, or nothing can be written.
    """
    if scene.sensor.unit == "shift":
        count = write_libfreenect(folder, _frames(scene, say), ZeroPlane())
    else:
        count = write_png_folder(folder, _frames(scene, say))
    _write(folder / TRUTH_NAME, truth_text(scene))
    happenings = happenings_text(scene)
    if happenings is not None:
        _write(folder / HAPPENINGS_NAME, happenings)
    _write(folder / CONFIG_NAME, config_text(scene))
    _write(folder / README_NAME, _readme_text(scene, count))
    say(f"{count} frames in {folder}; next: touchd replay {folder} --config {folder / CONFIG_NAME} --events OUT.jsonl")


def _frames(scene: LabScene, say: Callable[[str], None]) -> Iterator[Frame]:
    total = total_frames(scene)
    for index in range(total):
        if index % 100 == 0:
            say(f"frame {index} of {total}")
        yield scene.frame(index)


def total_frames(scene: LabScene) -> int:
    """Return how many frames a scene has, those of the empty surface among them."""
    return scene.calibration_frames + scene.frames


def truth_text(scene: LabScene) -> str:
    """Return the truth file: a line for each frame, with the list of its fingertips."""
    frames = (json.dumps(scene.truth(index).as_json()) for index in range(total_frames(scene)))
    return "[" + ",\n".join(frames) + "]\n"


def happenings_text(scene: LabScene) -> str | None:
    """Return the file of what there is besides fingertips, a line for each frame in which there is; None: nothing."""
    frames = (scene.truth(index).happening() for index in range(total_frames(scene)))
    lines = [json.dumps(happening) for happening in frames if happening is not None]
    return "[" + ",\n".join(lines) + "]\n" if lines else None


def config_text(scene: LabScene) -> str:
    """Return a config with what touchd must be told of the place: camera, area and the frames to learn from."""
    k = scene.sensor.intrinsics
    corners = [[round(u, 4), round(v, 4)] for u, v in scene.corners.corners_px]
    lines = [
        "source: {kind: recording}",
        f"camera: {{fx: {k.fx!r}, fy: {k.fy!r}, cx: {k.cx!r}, cy: {k.cy!r}, k1: {k.k1!r}, k2: {k.k2!r}}}",
        f"calibration: {{frames: {scene.calibration_frames}, on_start: always}}",
        "area:",
        f"  corners_px: {json.dumps(corners)}",
    ]
    if scene.corners.size_mm is not None:
        lines.append(f"  size_mm: {json.dumps(list(scene.corners.size_mm))}")
    return "\n".join(lines) + "\n"


def _readme_text(scene: LabScene, frames: int) -> str:
    return f"""# {scene.name}: {LAB_SCENES[scene.name]}

Simulated, no real recording: scene `{scene.name}`, seed {scene.seed}, model of {scene.sensor.kind} at
{scene.height_mm:g} mm, touchd {version("touchd")}. {frames} depth frames at 30 Hz, of which the first
{scene.calibration_frames} show the empty surface.

`{CONFIG_NAME}` is the config it is meant for. `{TRUTH_NAME}` has a list for each frame with its fingertips:
`tip` numbers touches from 1 and is -1 for a fingertip that only hovers, `x`, `y` are the touch point's area
coordinates, `clearance_mm` is the gap between fingertip and surface; `touching` is whether there is none.
`{HAPPENINGS_NAME}`, if there is one, has an entry for each frame with things on the table, or in which no touch can be
asked for because the camera was knocked or sees nothing.

    touchd replay {{this folder}} --config {{this folder}}/{CONFIG_NAME} --events OUT.jsonl
    touchd lab score OUT.jsonl {{this folder}}/{TRUTH_NAME}
"""


def _write(path: Path, text: str) -> None:
    with writing(path):
        path.write_text(text, encoding="utf-8")
