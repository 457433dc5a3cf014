"""`make golden`: turns a recording, or a scene of the lab, into a golden replay; `--update` has all of them made anew.

A recording's folder needs a file golden.yaml with: name, camera, place, must (what must happen, in words), touches (how
many), and if only a part is wanted, frames: [first, last] beyond those of the calibration. Its touchd.yaml tells
camera and area.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray
from touchd.config.load import load_config
from touchd.config.schema import Config
from touchd.contacts.methods import OWN_METHODS
from touchd.formats.device_json import read_device_json
from touchd.formats.recording import open_recording
from touchd.geometry import ZeroPlane
from touchd.lab.render import config_text
from touchd.lab.scenes import lab_scene
from touchd.model import Frame

from golden.replays import Golden, differences, load, load_frames, names, replay, store, store_frames

CALIBRATING = 10
HEADER = "golden.yaml"
# A pixel this many steps off the still scene, with its neighbours, belongs to something; around it all is kept.
OFF_STEPS, KEPT_AROUND_PX, KEPT_BESIDE_AREA_PX = 3, 12, 15


class GoldenError(Exception):
    """It cannot be made; the message says why and what to do."""


def from_recording(folder: Path) -> tuple[Golden, list[Frame]]:
    """Return a golden of a recording, and its frames as they were."""
    try:
        header = yaml.safe_load((folder / HEADER).read_text(encoding="utf-8"))
        name, camera, place, must, touches = (header[key] for key in ("name", "camera", "place", "must", "touches"))
    except (OSError, KeyError, TypeError, yaml.YAMLError) as error:
        raise GoldenError(f"{folder / HEADER}: {type(error).__name__} {error}: {__doc__}") from error
    recording, config = open_recording(folder), load_config(folder / "touchd.yaml")
    if config.area is None or config.area.size_mm is None:
        raise GoldenError(f"{folder / 'touchd.yaml'} gives no area with size_mm: a golden replay needs both")
    empty = np.linspace(0, config.calibration.frames - 1, CALIBRATING).astype(int).tolist()
    first, last = header.get("frames", [config.calibration.frames, len(recording) - 1])
    frames = [recording.read(i) for i in [*empty, *range(first, last + 1)]]
    device = folder / "device.json"
    zero_plane = vars_of(read_device_json(device) if device.exists() else ZeroPlane())
    return Golden(
        name=name,
        camera=camera,
        place=place,
        must=must,
        must_touches=touches,
        config=place_of(yaml.safe_load((folder / "touchd.yaml").read_text())),
        zero_plane=zero_plane if recording.sensor.unit == "shift" else None,
        touches={},
    ), in_step(frames)


def from_scene(text: str, must_touches: int) -> tuple[Golden, list[Frame]]:
    """Return a golden of NAME:HEIGHT:SEED:FIRST:LAST, frames counted after the calibration's."""
    name, *numbers = text.split(":")
    height, seed, first, last = (int(number) for number in numbers)
    scene = lab_scene(name, float(height), seed)
    begin = scene.calibration_frames
    frames = [scene.frame(i) for i in [*range(CALIBRATING), *range(begin + first, begin + last + 1)]]
    return Golden(
        name=f"{name}-{height}",
        camera=f"simulated: model of {scene.sensor.kind}",
        place=f"lab scene {text}, camera {height} mm away",
        must=f"{must_touches} touches",
        must_touches=must_touches,
        config=place_of(yaml.safe_load(config_text(scene))),
        zero_plane=vars_of(ZeroPlane()) if scene.sensor.unit == "shift" else None,
        touches={},
    ), in_step(frames)


def place_of(config: dict[str, Any]) -> dict[str, Any]:
    """Return of a config what it says of the place, with the golden's calibration."""
    kept = {key: config[key] for key in ("camera", "area") if key in config}
    return kept | {"calibration": {"frames": CALIBRATING}}


def vars_of(zero_plane: ZeroPlane) -> dict[str, float]:
    return {name: getattr(zero_plane, name) for name in ZeroPlane.__slots__}


def in_step(frames: Sequence[Frame]) -> list[Frame]:
    """Return the frames numbered anew; the empty ones lie as far apart as the others."""
    step_ns = 33_333_333
    begin_ns = frames[CALIBRATING].t_ns - CALIBRATING * step_ns
    times_ns = [begin_ns + i * step_ns for i in range(CALIBRATING)] + [frame.t_ns for frame in frames[CALIBRATING:]]
    return [Frame(i, t_ns - begin_ns, frame.raw) for i, (t_ns, frame) in enumerate(zip(times_ns, frames, strict=True))]


def quietened(frames: Sequence[Frame], corners_px: Sequence[Sequence[float]]) -> list[Frame]:
    """Return the frames with the still scene's own values wherever nothing is: without their noise they pack small.

    The calibrating frames keep theirs in the area and around it, and what else is there wherever something is.
    """
    still = np.median(np.stack([frame.raw for frame in frames[:CALIBRATING]]), axis=0).astype(np.uint16)
    area = np.zeros(still.shape, np.uint8)
    cv2.fillConvexPoly(area, np.rint(np.array(corners_px)).astype(np.int32), (1,))
    beside = widened(area, KEPT_BESIDE_AREA_PX)
    kept = [beside if i < CALIBRATING else something(frame.raw, still) for i, frame in enumerate(frames)]
    return [replace(f, raw=np.where(mask > 0, f.raw, still)) for f, mask in zip(frames, kept, strict=True)]


def something(raw: NDArray[np.uint16], still: NDArray[np.uint16]) -> NDArray[np.uint8]:
    off = (np.abs(raw.astype(np.int32) - still) >= OFF_STEPS).astype(np.uint8)
    return widened(
        np.asarray(cv2.morphologyEx(off, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), np.uint8), KEPT_AROUND_PX
    )


def widened(mask: NDArray[np.uint8], by_px: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.dilate(mask, np.ones((2 * by_px + 1, 2 * by_px + 1), np.uint8)), np.uint8)


def found_by_all(golden: Golden, frames: Sequence[Frame]) -> dict[str, list[dict[str, Any]]]:
    """Return the touches that each of our methods finds in the frames as they are stored."""
    found = {}
    for method in OWN_METHODS:
        with tempfile.TemporaryDirectory() as folder:
            found[method] = replay(golden, frames, method, Path(folder))
    return found


def add(golden: Golden, frames: Sequence[Frame], say: Callable[[str], None]) -> None:
    """Store a golden of which the default method makes what it must."""
    quiet = quietened(frames, golden.config["area"]["corners_px"])
    found = found_by_all(golden, quiet)
    seen = len(found[Config().touch.method])
    if seen != golden.must_touches:
        raise GoldenError(
            f"{golden.name}: {seen} touches were found where {golden.must_touches} must be: mend the method first, or "
            f"correct the number; they are {[touch['frames'] for touch in found[Config().touch.method]]}"
        )
    store(replace(golden, touches=found))
    size = store_frames(golden.name, quiet, CALIBRATING)
    say(f"{golden.name}: {size / 1000:.0f} kB, {len(quiet)} frames, {seen} touches")


def update(say: Callable[[str], None]) -> None:
    """Replay every golden anew, say what is different, and store it."""
    for name in names():
        golden = load(name)
        found = found_by_all(golden, load_frames(name))
        for line in changes(golden, found):
            say(f"{name}: {line}")
        store(replace(golden, touches=found))
    say("look at the differences above, and at git diff, before you commit them")


def changes(golden: Golden, found: dict[str, list[dict[str, Any]]]) -> Iterator[str]:
    for method, touches in found.items():
        lines = differences(golden.touches.get(method, []), touches, golden.size_mm)
        yield from (f"{method}: {line}" for line in lines or ["as before"])
        if method == Config().touch.method and len(touches) != golden.must_touches:
            yield f"{method}: {golden.must_touches} touches must be found ({golden.must})"


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")


def main() -> int:
    """Return 0 where it was done."""
    parser = argparse.ArgumentParser(prog="make golden", description=__doc__)
    parser.add_argument("recording", nargs="?", type=Path, help="a recording's folder with a golden.yaml")
    parser.add_argument("--scene", metavar="NAME:HEIGHT:SEED:FIRST:LAST", help="a scene of the lab instead")
    parser.add_argument("--touches", type=int, default=0, help="how many touches must be found in the scene")
    parser.add_argument("--update", action="store_true", help="replay all goldens anew and show the differences")
    options = parser.parse_args()
    try:
        if options.update:
            update(_say)
        elif options.scene:
            add(*from_scene(options.scene, options.touches), _say)
        elif options.recording:
            add(*from_recording(options.recording), _say)
        else:
            parser.error("name a recording: make golden RECORDING=folder")
    except GoldenError as error:
        _say(str(error))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
