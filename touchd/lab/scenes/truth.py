"""What really happened in a frame of a lab scene: every fingertip that is over the surface, and which ones touch it."""

from dataclasses import dataclass, replace
from typing import Any

from touchd.lab.scenes.upsets import Upset

NO_TOUCH = -1  # the number of a fingertip that only hovers


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """A touch from the moment its fingertip meets the surface to the moment it leaves it, on the scene's clock."""

    tip: int
    finger: int
    hand: int
    person: int
    down_ns: int
    lift_ns: int

    def later(self, by_ns: int) -> "TrueTouch":
        """Return the touch on a clock that began earlier."""
        return replace(self, down_ns=self.down_ns + by_ns, lift_ns=self.lift_ns + by_ns)


@dataclass(frozen=True, slots=True)
class TrueTip:
    """A fingertip over the surface.

    ``tip`` numbers touches from 1, each with its way down and up, and is -1 for a fingertip that only hovers.
    ``finger``, ``hand`` and ``person`` stay the same for a whole scene; a finger's number belongs to no other hand.
    ``x``, ``y`` are the touch point's area coordinates, ``x_mm``, ``y_mm``, ``z_mm`` the same point of the surface in
    table coordinates. ``height_mm`` is the gap between the pad's lowest point and the surface. ``down_ns`` and
    ``lift_ns`` belong to the touch ``tip``, before and after it as well; None where ``tip`` is -1. ``either`` is true
    for a fingertip that holds something so low that it may be taken for a touch or not.
    """

    tip: int
    finger: int
    hand: int
    person: int
    touching: bool
    x: float
    y: float
    x_mm: float
    y_mm: float
    z_mm: float
    height_mm: float
    speed_mm_s: float
    down_ns: int | None
    lift_ns: int | None
    radius_mm: float  # of the fingertip's ball
    side: str  # "left" or "right": which hand it is
    either: bool

    def later(self, by_ns: int) -> "TrueTip":
        """Return the fingertip on a clock that began earlier."""
        if self.down_ns is None or self.lift_ns is None:
            return self
        return replace(self, down_ns=self.down_ns + by_ns, lift_ns=self.lift_ns + by_ns)

    def as_json(self) -> dict[str, Any]:
        """Return the entry of a truth file; its first five keys are those of the example recording's."""
        return {
            "tip": self.tip,
            "x": self.x,
            "y": self.y,
            "clearance_mm": self.height_mm,
            "touching": self.touching,
            "finger": self.finger,
            "hand": self.hand,
            "person": self.person,
            "x_mm": self.x_mm,
            "y_mm": self.y_mm,
            "z_mm": self.z_mm,
            "speed_mm_s": self.speed_mm_s,
            "down_ns": self.down_ns,
            "lift_ns": self.lift_ns,
            "radius_mm": self.radius_mm,
            "side": self.side,
            "either": self.either,
        }


@dataclass(frozen=True, slots=True)
class TrueStack:
    """A stack of paper on the surface: the area coordinates of its middle, its width and its height."""

    x: float
    y: float
    size_mm: float
    height_mm: float


@dataclass(frozen=True, slots=True)
class TrueThing:
    """A thing on the table or in a hand.

    ``outline`` and ``footprint`` are the area coordinates of the corners of its upper side and of the table right under
    it, ``height_mm`` is how high its upper side is over the table. ``held``: a hand carries or pushes it.
    """

    number: int
    kind: str
    outline: tuple[tuple[float, float], ...]
    footprint: tuple[tuple[float, float], ...]
    height_mm: float
    held: bool

    def as_json(self) -> dict[str, Any]:
        """Return its entry in a file of happenings."""
        return {
            "id": self.number,
            "kind": self.kind,
            "outline": [list(corner) for corner in self.outline],
            "footprint": [list(corner) for corner in self.footprint],
            "height_mm": self.height_mm,
            "held": self.held,
        }


@dataclass(frozen=True, slots=True)
class TruthFrame:
    """The fingertips of one frame. What must not touch (a heel, a curled finger, an object) is not among them.

    ``stacks`` are those of the scene that asks at what height a thing is taken for a touch. ``things`` are the others.
    ``upset``: why no touch can be asked for, None where any can.
    """

    index: int
    t_ns: int
    tips: tuple[TrueTip, ...]
    stacks: tuple[TrueStack, ...] = ()
    things: tuple[TrueThing, ...] = ()
    upset: Upset | None = None

    def as_json(self) -> list[dict[str, Any]]:
        """Return the frame's entry of a truth file."""
        return [tip.as_json() for tip in self.tips]

    def happening(self) -> dict[str, Any] | None:
        """Return the frame's entry in a file of happenings: what there is besides fingertips; None for nothing."""
        if not self.things and self.upset is None:
            return None
        return {"frame": self.index, "upset": self.upset, "things": [thing.as_json() for thing in self.things]}
