"""What stands under the camera: where the table is, which solids are on it, and where they are seen.

Table coordinates are in millimetres, with the origin where the camera's optical axis meets the table: x to
the right and y down the picture (towards the viewer) along the table, z up from it. They are left-handed, as
pictures are.
"""

from dataclasses import dataclass
from math import cos, radians, sin
from typing import TypeAlias

import numpy as np

from touchd.geometry import Doubles, distort, project_ideal
from touchd.model import Intrinsics

Point: TypeAlias = tuple[float, float, float]
Place: TypeAlias = tuple[float, float]

KINECT_INTRINSICS = Intrinsics(575.8, 575.8, 319.5, 239.5)


@dataclass(frozen=True, slots=True)
class TableCamera:
    """A camera over a flat table.

    ``height_mm`` is the distance to the table along the optical axis. ``tilt_deg`` leans the camera so that
    the lower part of the picture looks at nearer table; ``roll_deg`` turns the table clockwise in the
    picture. ``knocked_deg`` is how a knock has turned the camera on the spot since, to the right and down; table
    coordinates stay those of before.
    """

    height_mm: float
    tilt_deg: float = 0.0
    roll_deg: float = 0.0
    intrinsics: Intrinsics = KINECT_INTRINSICS
    knocked_deg: tuple[float, float] = (0.0, 0.0)

    def axes(self) -> Doubles:
        """Return the table's x, y and z axis as the rows of a (3, 3) matrix in camera space."""
        tilt, roll = radians(self.tilt_deg), radians(self.roll_deg)
        leaned = np.array([[1.0, 0.0, 0.0], [0.0, cos(tilt), -sin(tilt)], [0.0, -sin(tilt), -cos(tilt)]])
        turn = np.array([[cos(roll), sin(roll), 0.0], [-sin(roll), cos(roll), 0.0], [0.0, 0.0, 1.0]])
        turned: Doubles = leaned @ turn @ self._knock()
        return turned

    def origin_mm(self) -> Doubles:
        """Return the table's origin (3,) in camera space."""
        origin: Doubles = np.array([0.0, 0.0, self.height_mm]) @ self._knock()
        return origin

    def to_camera(self, points_mm: Doubles) -> Doubles:
        """Return points (..., 3) of the table in camera space."""
        seen: Doubles = np.asarray(points_mm, np.float64) @ self.axes() + self.origin_mm()
        return seen

    def eye_mm(self) -> Doubles:
        """Return the camera's own place (3,) in table coordinates."""
        eye: Doubles = self.axes() @ -self.origin_mm()
        return eye

    def pixels(self, points_mm: Doubles) -> Doubles:
        """Return the pixels (..., 2) in which points (..., 3) of the table are seen, through the lens."""
        return distort(self.intrinsics, project_ideal(self.intrinsics, self.to_camera(points_mm)))

    def _knock(self) -> Doubles:
        """Return the matrix (3, 3) that takes rows of coordinates from before a knock to after it."""
        right, down = radians(self.knocked_deg[0]), radians(self.knocked_deg[1])
        sideways = np.array([[cos(right), 0.0, sin(right)], [0.0, 1.0, 0.0], [-sin(right), 0.0, cos(right)]])
        downwards = np.array([[1.0, 0.0, 0.0], [0.0, cos(down), sin(down)], [0.0, -sin(down), cos(down)]])
        knock: Doubles = sideways @ downwards
        return knock


@dataclass(frozen=True, slots=True)
class Area:
    """The active area: a rectangle on the table, along the table's axes."""

    centre_mm: Place
    size_mm: Place  # width, height

    def corners_mm(self) -> Doubles:
        """Return the top-left, top-right, bottom-right and bottom-left corner (4, 3) in table coordinates."""
        signs = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        corners = np.zeros((4, 3))
        corners[:, :2] = signs * np.array(self.size_mm) + np.array(self.centre_mm)
        return corners

    def at(self, x: float, y: float) -> Place:
        """Return the place on the table, in mm, of area coordinates (0..1)."""
        return (
            self.centre_mm[0] + (x - 0.5) * self.size_mm[0],
            self.centre_mm[1] + (y - 0.5) * self.size_mm[1],
        )


def area_corners_px(camera: TableCamera, area: Area) -> Doubles:
    """Return the area's TL, TR, BR, BL corners (4, 2) as depth pixels through the lens."""
    return camera.pixels(area.corners_mm())


@dataclass(frozen=True, slots=True)
class Capsule:
    """Everything within a radius of a line from a to b, the radius changing evenly between the two ends."""

    a_mm: Point
    b_mm: Point
    radius_a_mm: float
    radius_b_mm: float


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball."""

    centre_mm: Point
    radius_mm: float


@dataclass(frozen=True, slots=True)
class Block:
    """A cuboid: the middle of its base, its size along its own two sides and up, its turn, and how far it leans.

    Upright its top is level; it leans over the way its second side points, around the middle of its base.
    """

    base_mm: Point
    size_mm: Point
    turn_deg: float = 0.0  # clockwise in the picture
    lean_deg: float = 0.0

    def axes(self) -> Doubles:
        """Return its own axes as the rows of a (3, 3) matrix in table coordinates."""
        turn, lean = radians(self.turn_deg), radians(self.lean_deg)
        along, across = np.array([cos(turn), sin(turn), 0.0]), np.array([-sin(turn), cos(turn), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        return np.array([along, cos(lean) * across - sin(lean) * up, cos(lean) * up + sin(lean) * across])

    def corners_mm(self) -> Doubles:
        """Return its corners (8, 3) in table coordinates."""
        signs = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0.0, 1.0)])
        corners: Doubles = signs * np.array(self.size_mm) @ self.axes() + np.array(self.base_mm)
        return corners


Solid: TypeAlias = Capsule | Sphere | Block


@dataclass(frozen=True, slots=True)
class Fingertip:
    """A fingertip over the table: the place under its ball's centre, and the gap between ball and table."""

    at_mm: Place
    clearance_mm: float


@dataclass(frozen=True, slots=True)
class Hand:
    """A posed hand with its arm, or any other thing: its solids, and those of its fingertips that mean to touch.

    ``dark`` solids swallow the sensor's light (black cloth, hair), so that nothing can be read of them.
    """

    solids: tuple[Solid, ...]
    fingertips: tuple[Fingertip, ...]
    dark: tuple[Solid, ...] = ()
