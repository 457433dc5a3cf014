"""What happens over the surface: performers and things, and the truth that follows from them."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from touchd.geometry import Doubles, project_ideal
from touchd.lab.scenes.performer import Foot, Numbered, Performer, finger_number, numbered
from touchd.lab.scenes.things import Kind, Laid, Thing
from touchd.lab.scenes.timeline import Leg
from touchd.lab.scenes.truth import NO_TOUCH, TrueStack, TrueThing, TrueTip, TrueTouch
from touchd.table.relief import Ground
from touchd.table.scene import Area, Block, Hand, TableCamera

Prop: TypeAlias = Callable[[int], Hand | None]  # what a thing is at a time in ns; None where it is not there
Stacks: TypeAlias = Callable[[int], tuple[Block, ...]]  # the stacks that stand there at a time in ns
_HIGHEST_MM = 150.0  # fingertips higher than this are nobody's business
_SIZE = (640, 480)


class Play:
    """A scene's performers and things on a clock that begins when calibration is over."""

    def __init__(
        self,
        camera: TableCamera,
        area: Area,
        ground: Ground,
        performers: tuple[Performer, ...],
        props: tuple[Prop, ...],
        stacks: Stacks | None,
        things: tuple[Thing, ...],
        end_ns: int,
    ) -> None:
        """``end_ns`` is when the last thing is gone; performers may end later."""
        self._camera = camera
        self._ground = ground
        self._performers = performers
        self._props = props
        self._stacks = stacks
        self._things = things
        self._numbered = numbered(performers)
        self._to_area = _homography(camera, area)
        self.end_ns = max([end_ns, *(performer.end_ns for performer in performers)])

    @property
    def touches(self) -> tuple[TrueTouch, ...]:
        """All touches, in the order of their numbers."""
        return tuple(entry.touch for entry in self._numbered)

    def hands(self, t_ns: int) -> tuple[Hand, ...]:
        """Return all that is over the surface at a time."""
        shown = [performer.posed(leg, t_ns, self._under(performer)) for performer, leg in self._on_stage(t_ns)]
        things = [thing for thing in (prop(t_ns) for prop in self._props) if thing is not None]
        laid = ((thing, thing.laid(t_ns)) for thing in self._things)
        things += [Hand(thing.kind.solids(at), ()) for thing, at in laid if at is not None]
        stacks = self._stacks_at(t_ns)
        return (*shown, *things, Hand(stacks, ())) if stacks else (*shown, *things)

    def stacks(self, t_ns: int) -> tuple[TrueStack, ...]:
        """Return the stacks at a time."""
        blocks = self._stacks_at(t_ns)
        if not blocks:
            return ()
        places = self._area_coordinates(np.array([block.base_mm for block in blocks]))
        pairs = zip(places, blocks, strict=True)
        return tuple(TrueStack(x, y, block.size_mm[0], block.size_mm[2]) for (x, y), block in pairs)

    def things(self, t_ns: int) -> tuple[TrueThing, ...]:
        """Return the things at a time."""
        laid = ((number, thing.kind, thing.laid(t_ns)) for number, thing in enumerate(self._things, 1))
        return tuple(self._true_thing(number, kind, at) for number, kind, at in laid if at is not None)

    def tips(self, t_ns: int) -> tuple[TrueTip, ...]:
        """Return the fingertips in play that are in the picture at a time."""
        return tuple(tip for performer, leg in self._on_stage(t_ns) for tip in self._tips_of(performer, leg, t_ns))

    def _stacks_at(self, t_ns: int) -> tuple[Block, ...]:
        return () if self._stacks is None else self._stacks(t_ns)

    def _under(self, performer: Performer) -> Ground:
        """Return what a performer moves over."""
        return performer.ground or self._ground

    def _on_stage(self, t_ns: int) -> list[tuple[Performer, Leg]]:
        pairs = ((performer, performer.leg(t_ns)) for performer in self._performers)
        return [(performer, leg) for performer, leg in pairs if leg is not None]

    def _true_thing(self, number: int, kind: Kind, at: Laid) -> TrueThing:
        high = kind.size_mm[2]
        outline, footprint = (
            tuple((x, y) for x, y in self._area_coordinates(kind.corners_mm(at, up_mm))) for up_mm in (high, -at.z_mm)
        )
        return TrueThing(number, kind.name, outline, footprint, at.z_mm + high, at.held)

    def _tips_of(self, performer: Performer, leg: Leg, t_ns: int) -> list[TrueTip]:
        feet = performer.feet(leg, t_ns, self._under(performer))
        speeds = performer.speeds_mm_s(leg, t_ns)
        places = np.array([foot.place_mm for foot in feet])
        inside = self._in_picture(places)
        area = self._area_coordinates(places)
        return [
            self._tip(performer, leg, tip, t_ns, foot, speeds[tip], area[tip])
            for tip, foot in enumerate(feet)
            if inside[tip] and foot.height_mm < _HIGHEST_MM
        ]

    def _tip(
        self,
        performer: Performer,
        leg: Leg,
        tip: int,
        t_ns: int,
        foot: Foot,
        speed_mm_s: float,
        at: list[float],
    ) -> TrueTip:
        touch = self._touch(performer, performer.legs.index(leg), tip)
        x_mm, y_mm, z_mm = foot.place_mm
        return TrueTip(
            tip=NO_TOUCH if touch is None else touch.tip,
            finger=finger_number(performer.hand, performer.grip.fingers[tip]),
            hand=performer.hand,
            person=performer.person,
            touching=touch is not None and touch.down_ns <= t_ns < touch.lift_ns,
            x=at[0],
            y=at[1],
            x_mm=x_mm,
            y_mm=y_mm,
            z_mm=z_mm,
            height_mm=foot.height_mm,
            speed_mm_s=speed_mm_s,
            down_ns=None if touch is None else touch.down_ns,
            lift_ns=None if touch is None else touch.lift_ns,
            radius_mm=performer.build.tip_radius_mm(performer.grip.fingers[tip]),
            side="left" if performer.build.left else "right",
            either=foot.height_mm < performer.holding_mm,
        )

    def _touch(self, performer: Performer, leg: int, tip: int) -> TrueTouch | None:
        """Return the touch that a fingertip's leg belongs to; a way up that is a way down, too, is the next's."""
        mine = [entry for entry in self._of(performer, tip) if entry.first <= leg <= entry.last]
        return mine[-1].touch if mine else None

    def _of(self, performer: Performer, tip: int) -> list[Numbered]:
        which = self._performers.index(performer)
        return [entry for entry in self._numbered if entry.performer == which and entry.tip == tip]

    def _in_picture(self, places_mm: Doubles) -> list[bool]:
        pixels = self._camera.pixels(places_mm)
        inside = np.all((pixels >= 0.0) & (pixels <= np.array(_SIZE) - 1.0), axis=-1)
        return [bool(value) for value in inside]

    def _area_coordinates(self, places_mm: Doubles) -> list[list[float]]:
        ideal = project_ideal(self._camera.intrinsics, self._camera.to_camera(places_mm))
        mapped = np.concatenate([ideal, np.ones((len(ideal), 1))], 1) @ self._to_area.T
        shares: list[list[float]] = (mapped[:, :2] / mapped[:, 2:]).tolist()
        return shares


def _homography(camera: TableCamera, area: Area) -> Doubles:
    """Return the matrix (3, 3) from undistorted pixels to area coordinates that the area's four corners define."""
    corners = project_ideal(camera.intrinsics, camera.to_camera(area.corners_mm()))
    rows, wanted = [], []
    for (u, v), (x, y) in zip(corners.tolist(), ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
        rows += [[u, v, 1, 0, 0, 0, -x * u, -x * v], [0, 0, 0, u, v, 1, -y * u, -y * v]]
        wanted += [x, y]
    solution = np.linalg.solve(np.array(rows), np.array(wanted, np.float64))
    return np.append(solution, 1.0).reshape(3, 3)
