"""Golden replays: short recordings with what touchd made of them, kept so that a change shows.

Each is two files in tests/golden/replays: NAME.yaml, for people (camera, place, what must happen, config, the touches
that each method found), and NAME.xz, the depth pictures.
"""

import json
import lzma
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from touchd.cli import run_command_line
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.png_folder import write_png_folder
from touchd.geometry import ZeroPlane
from touchd.model import Frame

FOLDER = Path(__file__).parent / "replays"
PLACE_EVERY = 10  # frames
FRAMES_OFF, MM_OFF = 1, 1.0


@dataclass(frozen=True)
class Golden:
    """A golden replay without its pictures; ``touches`` by method: each one's frames and places."""

    name: str
    camera: str
    place: str
    must: str
    must_touches: int
    config: dict[str, Any]
    zero_plane: dict[str, float] | None  # of a Kinect; None: pictures in mm
    touches: dict[str, list[dict[str, Any]]]

    @property
    def size_mm(self) -> tuple[float, float]:
        width_mm, height_mm = self.config["area"]["size_mm"]
        return float(width_mm), float(height_mm)


def names() -> list[str]:
    return sorted(path.stem for path in FOLDER.glob("*.yaml"))


def load(name: str) -> Golden:
    return Golden(name=name, **yaml.safe_load((FOLDER / f"{name}.yaml").read_text(encoding="utf-8")))


def store(golden: Golden) -> None:
    content = {key: value for key, value in vars(golden).items() if key != "name"}
    lines = yaml.safe_dump(content, sort_keys=False, width=118, default_flow_style=None, allow_unicode=True)
    (FOLDER / f"{golden.name}.yaml").write_text(lines, encoding="utf-8")


def store_frames(name: str, frames: Sequence[Frame], calibrating: int) -> int:
    """Write pictures as their differences from the still scene; return the size in bytes."""
    raw = np.stack([frame.raw for frame in frames])
    still = np.median(raw[:calibrating], axis=0).astype(np.uint16)
    into = BytesIO()
    times_ns = np.array([frame.t_ns for frame in frames])
    np.savez(into, still=still, change=raw - still, times_ns=times_ns)  # uint16 wraps, and wraps back
    packed = lzma.compress(into.getvalue(), preset=9)
    (FOLDER / f"{name}.xz").write_bytes(packed)
    return len(packed)


def load_frames(name: str) -> list[Frame]:
    with np.load(BytesIO(lzma.decompress((FOLDER / f"{name}.xz").read_bytes()))) as arrays:
        raw: NDArray[np.uint16] = arrays["still"] + arrays["change"]
        return [Frame(i, int(t_ns), raw[i]) for i, t_ns in enumerate(arrays["times_ns"])]


def replay(golden: Golden, frames: Sequence[Frame], method: str, folder: Path) -> list[dict[str, Any]]:
    """Run `touchd replay` on the pictures and return the touches that it found."""
    if golden.zero_plane is None:
        write_png_folder(folder / "recording", frames)
    else:
        write_libfreenect(folder / "recording", frames, ZeroPlane(**golden.zero_plane))
    config, events = folder / "touchd.yaml", folder / "events.jsonl"
    config.write_text(json.dumps(golden.config | {"touch": {"method": method}}))
    code = run_command_line(["replay", str(folder / "recording"), "--config", str(config), "--events", str(events)])
    assert code == 0, f"{golden.name}: touchd replay ended with exit code {code}"
    return touches_in([json.loads(line) for line in events.read_text().splitlines()])


def touches_in(events: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return each touch's first and last frame, and its places [frame, x, y]: the first, every tenth, the last."""
    seen: dict[int, list[list[float]]] = {}
    for event in events:
        for cursor in event["cursors"]:
            place = [event["frame"], round(cursor["x"], 5), round(cursor["y"], 5)]
            seen.setdefault(cursor["id"], []).append(place)
    return [
        {
            "frames": [way[0][0], way[-1][0]],
            "places": [p for p in way if p in (way[0], way[-1]) or p[0] % PLACE_EVERY == 0],
        }
        for way in seen.values()
    ]


def differences(
    expected: Sequence[dict[str, Any]], found: Sequence[dict[str, Any]], size_mm: tuple[float, float]
) -> list[str]:
    """Return a sentence for each way in which touches differ by more than a frame or a millimetre."""
    if len(expected) != len(found):
        return [f"{len(found)} touches where {len(expected)} were: {_frames(found)} in place of {_frames(expected)}"]
    lines = []
    for number, (before, now) in enumerate(zip(expected, found, strict=True), 1):
        off = [abs(a - b) for a, b in zip(before["frames"], now["frames"], strict=True)]
        if max(off) > FRAMES_OFF:
            lines.append(f"touch {number}: frames {now['frames']} where {before['frames']} were")
        places = {p[0]: p[1:] for p in before["places"]}
        for frame, x, y in now["places"]:
            if frame in places:
                off_mm = np.hypot((x - places[frame][0]) * size_mm[0], (y - places[frame][1]) * size_mm[1])
                if off_mm > MM_OFF:
                    lines.append(f"touch {number}, frame {frame}: {off_mm:.1f} mm from where it was")
    return lines


def _frames(touches: Sequence[dict[str, Any]]) -> str:
    return ", ".join(f"{touch['frames'][0]}–{touch['frames'][1]}" for touch in touches) or "none"
