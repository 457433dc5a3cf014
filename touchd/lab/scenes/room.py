"""Where a scene takes place: camera, area, surface and sensor, drawn from a seed."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from touchd.geometry import KINECT_SIZE
from touchd.lab.scenes.upsets import Upsets
from touchd.model import AreaCorners, Intrinsics, Sensor
from touchd.table.misreading import TRUE_READING, Misreading, uneven
from touchd.table.relief import Book, Bowl, Ground
from touchd.table.scene import KINECT_INTRINSICS, Area, TableCamera, area_corners_px
from touchd.table.sensor_kinect import KinectModel
from touchd.table.sensor_stereo import StereoModel
from touchd.table.table import SensorModel, Table, table_sensor

_SHAPE = (1.0, 0.7)  # the area's width and height
_MARGIN_PX = 28.0
_BLIND_PX = 10.0  # at the picture's right end
_EDGE_R2 = (319.5 / KINECT_INTRINSICS.fx) ** 2
_LARGEST_BEND = 0.025  # at the picture's edge
_LARGEST_SHIFT_PX = 15.0
_UNEVEN_DRIFT = 0.15  # by which drift differs over the picture
_DRIFT_KEY = 7  # apart from the other numbers drawn from a scene's seed
_DROWNED = 0.998  # of the readings, in glaring light


class View(StrEnum):
    """What is special about a room."""

    PLAIN = "plain"
    TILTED = "tilted"  # by 20 to 35 degrees, and rolled
    LENS = "lens"  # a bent lens that touchd knows
    UNKNOWN_LENS = "unknown-lens"  # one that it takes for a straight one
    BOOK = "book"
    BOWL = "bowl"
    EDGES = "edges"  # the table ends within the picture
    STEREO = "stereo"


@dataclass(frozen=True, slots=True)
class Room:
    """A table under a camera. ``told`` is the sensor as touchd is told of it."""

    camera: TableCamera
    area: Area
    ground: Ground
    model: SensorModel
    told: Sensor
    rng: np.random.Generator

    @property
    def height_mm(self) -> float:
        """How far the camera is from the table."""
        return self.camera.height_mm

    @property
    def lift(self) -> float:
        """By how much people lift their fingers higher than at 0.75 m: twice at 1.5 m."""
        return max(1.0, self.height_mm / 750.0)

    def between(self, low: float, high: float) -> float:
        """Return a number drawn evenly."""
        return float(self.rng.uniform(low, high))

    def corners(self) -> AreaCorners:
        """Return where the area is seen, through the lens, and its size."""
        (a, b), (c, d), (e, f), (g, h) = area_corners_px(self.camera, self.area).tolist()
        return AreaCorners(((a, b), (c, d), (e, f), (g, h)), self.area.size_mm)


class Stage:
    """The table of a room, made when its first frame is asked for: that takes most of a second.

    Times are on the scene's clock, on which those of the calibration lie below 0.
    """

    def __init__(self, room: Room, seed: int, upsets: Upsets) -> None:
        self._room = room
        self._seed = seed
        self._upsets = upsets
        self._tables: dict[bool, Table] = {}  # by whether the camera was knocked
        self._unevenness = uneven(KINECT_SIZE, _UNEVEN_DRIFT, np.random.default_rng([seed, _DRIFT_KEY]))

    def camera_at(self, t_ns: int) -> TableCamera:
        """Return the camera as it stands at a time."""
        knock = self._upsets.knock
        if knock is None or t_ns < knock.upset.start_ns:
            return self._room.camera
        return replace(self._room.camera, knocked_deg=knock.turned_deg)

    def table_at(self, t_ns: int) -> Table:
        """Return the table that renders the frames of a time."""
        camera = self.camera_at(t_ns)
        knocked = camera is not self._room.camera
        if knocked not in self._tables:
            self._tables[knocked] = Table(camera, self._seed, self._room.model, self._room.ground)
        return self._tables[knocked]

    def misreading_at(self, t_ns: int) -> Misreading:
        """Return how the sensor reads wrongly at a time."""
        glare, drift = self._upsets.glare, self._upsets.drift
        if glare is not None and t_ns in glare:
            return Misreading(drowned=_DROWNED)
        if drift is not None and t_ns > 0:
            return Misreading(off=self._unevenness * np.float32(drift.at(t_ns)))
        return TRUE_READING


def make_room(view: View, height_mm: float, seed: int, rng: np.random.Generator) -> Room:
    """Return a room of a kind, with camera, area and the rest drawn at random."""
    camera = TableCamera(height_mm, *_lean(view, rng), intrinsics=_lens(view, rng))
    area = _largest_area(camera, 0.80 if view is View.EDGES else 1.0)
    model: SensorModel = StereoModel() if view is View.STEREO else KinectModel()
    told = table_sensor(camera, seed, model)
    if view is View.UNKNOWN_LENS:
        told = replace(told, intrinsics=KINECT_INTRINSICS)
    return Room(camera, area, _ground(view, area, rng), model, told, rng)


def _lean(view: View, rng: np.random.Generator) -> tuple[float, float]:
    """Return tilt and roll in degrees."""
    sign = -1.0 if rng.random() < 0.3 else 1.0
    if view is View.TILTED:
        return sign * float(rng.uniform(20.0, 35.0)), float(rng.uniform(-20.0, 20.0))
    return sign * float(rng.uniform(0.0, 12.0)), float(rng.uniform(-6.0, 6.0))


def _lens(view: View, rng: np.random.Generator) -> Intrinsics:
    if view not in (View.LENS, View.UNKNOWN_LENS):
        return KINECT_INTRINSICS
    bend = float(rng.uniform(-_LARGEST_BEND, _LARGEST_BEND))
    share = float(rng.uniform(0.7, 1.0))  # of k1; the rest is k2's
    shift_u, shift_v = rng.uniform(-_LARGEST_SHIFT_PX, _LARGEST_SHIFT_PX, 2).tolist()
    return replace(
        KINECT_INTRINSICS,
        cx=KINECT_INTRINSICS.cx + shift_u,
        cy=KINECT_INTRINSICS.cy + shift_v,
        k1=share * bend / _EDGE_R2,
        k2=(1.0 - share) * bend / _EDGE_R2**2,
    )


def _largest_area(camera: TableCamera, share: float) -> Area:
    """Return a part of the largest rectangle around the optical axis that is seen whole."""
    low, high = 0.1 * camera.height_mm, 2.0 * camera.height_mm
    right, bottom = KINECT_SIZE[0] - 1.0 - _BLIND_PX, KINECT_SIZE[1] - 1.0
    for _ in range(20):
        width = 0.5 * (low + high)
        corners = area_corners_px(camera, Area((0.0, 0.0), (width, width * _SHAPE[1])))
        inside = (corners > _MARGIN_PX).all() and (corners < np.array([right, bottom]) - _MARGIN_PX).all()
        low, high = (width, high) if inside else (low, width)
    size = round(low * share)
    return Area((0.0, 0.0), (float(size), float(round(size * _SHAPE[1]))))


def _ground(view: View, area: Area, rng: np.random.Generator) -> Ground:
    width, height = area.size_mm
    spot = (float(rng.uniform(-0.1, 0.1)) * width, float(rng.uniform(-0.1, 0.1)) * height)
    if view is View.BOOK:
        size = (float(rng.uniform(0.42, 0.55)) * width, float(rng.uniform(0.5, 0.65)) * height)
        return Ground((Book(spot, size, float(rng.uniform(15.0, 35.0)), float(rng.uniform(-25.0, 25.0))),))
    if view is View.BOWL:
        radius = float(rng.uniform(0.34, 0.42)) * height
        return Ground((Bowl(spot, radius, float(rng.uniform(0.05, 0.11)) * radius),))
    if view is View.EDGES:
        left, top, right, bottom = (float(rng.uniform(12.0, 40.0)) for _ in range(4))
        return Ground(edges_mm=(-width / 2 - left, -height / 2 - top, width / 2 + right, height / 2 + bottom))
    return Ground()
