"""What the tests of the whole daemon have the virtual Kinect play, and how they start a daemon on it."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scenarios import AREA, CAMERA, area_corners
from touchd.table.scene import Hand

from virtual_kinect.bus import KinectPlan
from virtual_kinect.pictures import table_pictures
from virtual_kinect.umock import VirtualBus

EMPTY_FRAMES = 45
CALIBRATION_FRAMES = 20
TOUCHED_AT = (0.4, 0.6)
DRAGGED = ((0.3, 0.35), (0.7, 0.65))
_DRAG_FRAMES = 30
_HOLD_FRAMES = 300


@dataclass(frozen=True, slots=True)
class Played:
    """Pictures, and the order in which they are shown, over and over and anew whenever the stream is started."""

    pictures: list[bytes]
    order: list[int]

    def on_a_bus(
        self,
        folder: Path,
        kinects: Sequence[KinectPlan] = (KinectPlan(),),
        plugged: Sequence[int] | None = None,
        *,
        patient: bool = False,
    ) -> VirtualBus:
        """Return a bus, to be entered, whose Kinects play it."""
        return VirtualBus(folder, self.pictures, kinects, self.order, plugged, patient=patient)


def held_touch() -> Played:
    """Return an empty table, long enough to learn it, and then a finger that rests on it for 10 s."""
    finger = [_finger(*TOUCHED_AT)]
    shown: list[list[Hand]] = [[]] * 6 + [finger] * 4
    pictures = table_pictures(CAMERA, 1, shown)
    return Played(pictures, [i % 6 for i in range(EMPTY_FRAMES)] + [6 + i % 4 for i in range(_HOLD_FRAMES)])


def drags() -> Played:
    """Return an empty table, and then a finger that is dragged over it and leaves."""
    (x0, y0), (x1, y1) = DRAGGED
    shares = [i / (_DRAG_FRAMES - 1) for i in range(_DRAG_FRAMES)]
    fingers = [[_finger(x0 + share * (x1 - x0), y0 + share * (y1 - y0))] for share in shares]
    shown: list[list[Hand]] = [[]] * 6 + fingers
    pictures = table_pictures(CAMERA, 1, shown)
    return Played(pictures, [i % 6 for i in range(EMPTY_FRAMES)] + list(range(6, 6 + _DRAG_FRAMES)))


def _finger(x: float, y: float) -> Hand:
    return pointing_hand(HandPose(AREA.at(x, y)))


def write_config(path: Path, destinations: Sequence[str], source: str = "", frames: int = CALIBRATION_FRAMES) -> Path:
    """Write a daemon's config, with a file of events beside it; return the path. ``source``: more keys of it."""
    corners = [list(corner) for corner in area_corners().corners_px]
    path.write_text(
        f"source: {{kind: kinect{source}}}\n"
        f"calibration: {{frames: {frames}}}\n"
        f"area: {{corners_px: {corners}, size_mm: {list(AREA.size_mm)}}}\n"
        "touch: {method: shell}\n"
        "outputs:\n"
        f"  - events: {{path: {path.with_suffix('.jsonl')}}}\n"
        + "".join(f"  - tuio: {{to: [{destination}]}}\n" for destination in destinations)
    )
    return path


def touchd_on(bus: VirtualBus, *before: str) -> tuple[str, ...]:
    """Return the command that runs touchd where it sees the virtual bus; ``before`` is put in front of it."""
    mock = [f"{name}={bus.environment[name]}" for name in ("LD_PRELOAD", "UMOCKDEV_DIR")]
    return (*before, "env", *mock, sys.executable, "-m", "touchd")
