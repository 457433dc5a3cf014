"""The data that travels between the stages. Frozen; the arrays inside are read-only.

Units are in the names wherever they are not obvious: ``_mm``, ``_px``, ``_ns``, ``_mm_s``. "Raw" always means the
sensor's own unit (shift for a Kinect v1, millimetres for most others).
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Image16: TypeAlias = NDArray[np.uint16]
Floats: TypeAlias = NDArray[np.float32]
Mask: TypeAlias = NDArray[np.bool_]

T = TypeVar("T", bound=np.generic)


def frozen_array(array: NDArray[T]) -> NDArray[T]:
    """Return a read-only view of ``array``, so that a stage cannot change what another one holds."""
    view = array.view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera with radial distortion: focal lengths and principal point in px, k1 and k2 without unit.

    The distortion is Brown's: with x, y the undistorted direction (X/Z, Y/Z) and r² = x² + y², the picture shows
    the point at (fx·x·d + cx, fy·y·d + cy) where d = 1 + k1·r² + k2·r⁴.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0


@dataclass(frozen=True, slots=True)
class AreaCorners:
    """The active area: its top-left, top-right, bottom-right, bottom-left corners as depth pixels (u, v) as seen.

    ``size_mm`` is its width and height on the surface, or None where it is to be derived from the surface.
    """

    corners_px: tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]
    size_mm: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Sensor:
    """What the core needs to know of a depth camera. Differences between cameras are data here, never special cases.

    ``to_mm`` and ``step_mm`` are float32 tables indexed by a raw value: its depth along the optical axis, and the
    size of one raw step there; both are NaN where the value is no reading. ``to_mm`` rises with the raw value.
    """

    kind: str
    serial: str
    size: tuple[int, int]  # width, height in px
    intrinsics: Intrinsics
    unit: str  # "shift" or "mm"
    invalid: int  # the raw value that means "no reading"
    to_mm: Floats  # (number of raw values,)
    step_mm: Floats  # (number of raw values,)
    noise: float  # typical standard deviation of a still pixel, raw
    shadow_side: str  # "left", "right" or "none": where the projector's shadow of a near object lies
    fatten_px: float  # by how much outlines of near objects grow


@dataclass(frozen=True, slots=True)
class Frame:
    """One depth picture. ``t_ns`` is monotonic and the only clock that the core sees."""

    index: int
    t_ns: int
    raw: Image16  # (H, W)
    missing_packets: int = 0
    accel_g: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class FollowedArea:
    """An area whose corners are seen elsewhere since the camera was knocked.

    ``area``: as it was configured then, None where it was not; ``corners``: where they have been seen since.
    """

    area: AreaCorners | None
    corners: AreaCorners


@dataclass(frozen=True, slots=True)
class Surface:
    """The empty surface, per pixel, as calibration found it.

    ``reference`` is the mean reading, ``dmax`` the paper's: the least depth that the empty surface shows, so that
    anything nearer stands above it. Both are in the sensor's unit and meaningless where ``valid`` is false.
    """

    sensor: Sensor
    reference: Floats  # (H, W) raw
    dmax: Image16  # (H, W) raw
    noise: Floats  # (H, W) standard deviation over time, raw
    valid: Mask  # (H, W)
    moved: Mask  # (H, W) pixels masked because something moved there
    frames: int  # how many frames it was made from
    made_from: str  # a name for people: a recording's path, a camera's serial
    followed: FollowedArea | None = None


@dataclass(frozen=True, slots=True)
class Shell:
    """The layer above the surface in which the paper looks for contacts: ``dmin < raw < dmax`` (both (H, W) uint16).

    Where the surface is not valid both are 0, so that nothing is ever inside.
    """

    dmin: Image16
    dmax: Image16
    near_mm: float  # median height of the lower boundary over the surface
    far_mm: float  # median height of the upper one


@dataclass(frozen=True, slots=True, eq=False)
class Slide:
    """That a thing which is part of the surface was pushed: its masks (H, W) before the last picture, and now."""

    before: Mask
    now: Mask


@dataclass(frozen=True, slots=True)
class SurfaceRows:
    """How a few rows of the empty surface read by now: what those who look at pictures of it go by from then on.

    ``reference`` (rows, W) is told everywhere; where the surface gave no reading it is that of its surroundings. It
    holds until the next picture: who needs it for longer copies it.
    """

    rows: slice
    reference: Floats  # raw


COARSE_PX = 4


@dataclass(frozen=True, slots=True)
class CoarsePicture:
    """One pixel of every ``COARSE_PX`` in rows and columns: enough to tell hands, arms and things.

    ``heights_mm`` (H / 4, W / 4) float32 above the surface; 0 where ``readings`` (the same shape) is false, because
    there is none or the surface is not known there. Pixel (row, column) is that at (4 · row + 2, 4 · column + 2).
    """

    heights_mm: Floats
    readings: Mask


@dataclass(frozen=True, slots=True)
class Contact:
    """A touch seen in one frame.

    ``x``, ``y`` are area coordinates (0..1 inside the area, y down), ``x_mm``, ``y_mm`` the same in millimetres.
    """

    x: float
    y: float
    x_mm: float
    y_mm: float
    height_mm: float  # mean height of what was seen above the surface
    area_mm2: float
    angle: float  # of its long axis in the area, radians, 0 along x, in (-pi/2, pi/2]
    firm: bool  # strong enough to begin a touch; a weak one may only continue one
    towards: tuple[float, float] | None = None  # where the finger points on the area's mm axes, of length 1; if known
    aim_mm: tuple[float, float] = (0.0, 0.0)  # how far it is told beside where it is, because people aim so


@dataclass(frozen=True, slots=True)
class Unseen:
    """Touches of which no contact tells that they last, nor anything that they ended; expected ones, counted from 0.

    ``hidden``: by something far above, such as another arm. ``standing``: beside others, where something as low as a
    finger that touches is still there.
    """

    hidden: frozenset[int] = frozenset()
    standing: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Cursor:
    """A touch over time. Velocities are in area axes a second, ``accel`` in area axes a second squared, as in TUIO."""

    session_id: int
    x: float  # 0..1
    y: float  # 0..1
    vx: float
    vy: float
    accel: float
    height_mm: float
    area_mm2: float
    angle: float
    hand: int | None = None  # the id of the hand it belongs to, where that can be told
    hover_id: int | None = None  # the hover that it was before it touched, where that was followed
    towards: tuple[float, float] | None = None  # as of the contact


@dataclass(frozen=True, slots=True)
class Hover:
    """A fingertip in the air over time. ``x``, ``y`` (0..1) are of the surface under it, its height is the gap.

    ``vx``, ``vy`` are in area axes a second, ``vz_mm_s`` is how fast it rises; all are 0 at rest.
    """

    hover_id: int
    x: float
    y: float
    height_mm: float
    hand: int | None = None
    vx: float = 0.0
    vy: float = 0.0
    vz_mm_s: float = 0.0
    session_id: int | None = None  # the touch that it was before it was lifted, where that was followed


@dataclass(frozen=True, slots=True)
class Hand:
    """A hand over the surface, for as long as its arm stays in the picture.

    ``x``, ``y``: area coordinates of the surface under its middle, not clamped; ``height_mm``: how high that is above
    the surface. ``side``: "left" or "right", None where it cannot be told. ``person``: whose it is.
    """

    hand_id: int
    x: float
    y: float
    height_mm: float
    side: str | None
    person: int


@dataclass(frozen=True, slots=True)
class TableObject:
    """A thing that lies on the surface and that no hand holds.

    ``outline``: the corners of the polygon around it, in area coordinates; ``height_mm``: how high it typically is.
    """

    object_id: int
    outline: tuple[tuple[float, float], ...]
    height_mm: float


class State(StrEnum):
    """What the pipeline is doing; the words are part of the event format."""

    CALIBRATING = "calibrating"
    TRACKING = "tracking"
    PAUSED = "paused"
    NO_SURFACE = "no-surface"
    NO_FRAMES = "no-frames"


@dataclass(frozen=True, slots=True)
class TouchFrame:
    """What the pipeline says of one frame. What it lists is in the order of the ids.

    ``area_mm``: the area's width and height, which turn its axes into lengths on the surface.
    """

    index: int
    t_ns: int
    state: State
    cursors: tuple[Cursor, ...] = ()
    why: str | None = None
    hovers: tuple[Hover, ...] = ()
    hands: tuple[Hand, ...] = ()
    objects: tuple[TableObject, ...] = ()
    area_mm: tuple[float, float] = (1.0, 1.0)

    def as_event(self) -> dict[str, Any]:
        """Return the event line's object: see "Events" in docs/design.md."""
        return {
            "frame": self.index,
            "t": self.t_ns / 1e9,
            "state": self.state.value,
            "why": self.why,
            "cursors": [
                {
                    "id": c.session_id,
                    "x": c.x,
                    "y": c.y,
                    "vx": c.vx,
                    "vy": c.vy,
                    "accel": c.accel,
                    "height_mm": c.height_mm,
                    "area_mm2": c.area_mm2,
                    "angle": c.angle,
                    "hand": c.hand,
                }
                for c in self.cursors
            ],
            "hovers": [
                {"id": h.hover_id, "x": h.x, "y": h.y, "height_mm": h.height_mm, "hand": h.hand} for h in self.hovers
            ],
            "hands": [
                {"id": h.hand_id, "x": h.x, "y": h.y, "height_mm": h.height_mm, "side": h.side, "person": h.person}
                for h in self.hands
            ],
            "objects": [
                {"id": o.object_id, "outline": [list(corner) for corner in o.outline], "height_mm": o.height_mm}
                for o in self.objects
            ],
        }
