"""What TUIO clients are told of besides the touches themselves: fingertips with their height, and blobs."""

from dataclasses import dataclass
from typing import TypeAlias

from touchd.model import Cursor


@dataclass(frozen=True, slots=True)
class AirCursor:
    """A fingertip, touching or above the surface: profile 25Dcur. ``x``, ``y`` as in a cursor.

    ``z`` is 0 on the surface and 1 at the greatest height that is followed. Velocities are in these axes a second,
    ``accel`` is the change of the length of all three.
    """

    session_id: int
    x: float
    y: float
    z: float
    vx: float
    vy: float
    vz: float
    accel: float


@dataclass(frozen=True, slots=True)
class Blob:
    """A thing on the surface, as the rectangle around it: profile 2Dblb.

    ``width`` lies along ``angle`` (radians, clockwise from the x axis, 0..2 pi) and is a share of the screen's width,
    ``height`` lies across it and is a share of the screen's height; ``area`` is a share of the screen's area. ``turn``
    is in full turns a second, ``turn_accel`` its change a second.
    """

    session_id: int
    x: float
    y: float
    angle: float
    width: float
    height: float
    area: float
    vx: float
    vy: float
    turn: float
    accel: float
    turn_accel: float


Thing: TypeAlias = Cursor | AirCursor | Blob
