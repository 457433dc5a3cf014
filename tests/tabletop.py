"""A table under a camera for tests of hands and things over it: rendered pictures, and the stage that looks at them."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from touchd.geometry import map_area, map_surface
from touchd.hands.lookout import Lookout
from touchd.hands.settings import ObjectSettings
from touchd.hands.stage import HandStage
from touchd.model import AreaCorners, Image16, Mask, Slide, Surface
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.calibrate import Calibration
from touchd.surface.coarse import CoarseHeights
from touchd.surface.settings import CalibrationSettings
from touchd.table.scene import Area, Block, Capsule, Hand, Place, TableCamera, area_corners_px
from touchd.table.table import Table

FRAME_NS = 33_333_333
_CALIBRATION_FRAMES = 25


class Tabletop:
    """A table at a height below its camera, with its surface learned. ``scale``: of the picture, 1 at 0.75 m."""

    def __init__(self, height_mm: float) -> None:
        camera = TableCamera(height_mm, tilt_deg=6.0)
        self.table = Table(camera, seed=5)
        self.area = Area((0.0, 0.0), (0.8 * height_mm, 0.55 * height_mm))
        self.scale = height_mm / 750.0
        (a, b), (c, d), (e, f), (g, h) = area_corners_px(camera, self.area).tolist()
        self.corners = AreaCorners(((a, b), (c, d), (e, f), (g, h)), self.area.size_mm)
        self.surface = self._learned()
        self.surface_map = map_surface(self.surface)
        self.area_map = map_area(self.corners, self.surface.sensor.intrinsics, self.area.size_mm)

    def _learned(self) -> Surface:
        calibration = Calibration(self.table.sensor, CalibrationSettings(frames=_CALIBRATION_FRAMES), "a test")
        for index in range(_CALIBRATION_FRAMES):
            calibration.add(self.picture([], index))
        return calibration.surface_so_far()

    def picture(self, hands: Sequence[Hand], index: int) -> Image16:
        """Return what the camera sees of hands and things."""
        return self.table.render(hands, index * FRAME_NS, index).raw

    def mm_of(self, place: Place) -> Place:
        """Return the place on the table, in mm, of area coordinates."""
        return self.area.at(*place)

    def pipeline(self) -> Pipeline:
        """Return a pipeline that looks at the table."""
        pipeline = Pipeline(self.table.sensor, PipelineSettings(area=self.corners), "a test")
        pipeline.use(self.surface)
        return pipeline


class Watch:
    """Shows pictures of a table to the stage of the hands, 30 a second."""

    def __init__(self, top: Tabletop, join_after_s: float = 3.0) -> None:
        self._top = top
        self._coarse = CoarseHeights(top.surface, top.surface_map)
        self.stage = HandStage(Lookout(top.surface, top.surface_map, top.area_map), ObjectSettings(join_after_s))
        self._index = _CALIBRATION_FRAMES

    @property
    def t_ns(self) -> int:
        """The time of the last picture."""
        return self._index * FRAME_NS

    def see(self, *hands: Hand, joined: Mask | None = None, slides: Sequence[Slide] = ()) -> HandStage:
        """Show one picture and return the stage."""
        return self.see_raw(self._top.picture(hands, self._index + 1), joined, slides)

    def see_nothing_readable(self) -> HandStage:
        """Show one picture without any readings."""
        return self.see_raw(np.full(self._top.surface.valid.shape, self._top.table.sensor.invalid, np.uint16))

    def see_raw(self, raw: Image16, joined: Mask | None = None, slides: Sequence[Slide] = ()) -> HandStage:
        """Show one picture as it is."""
        self._index += 1
        self.stage.see(self._coarse.over(raw), self.t_ns, joined, slides)
        return self.stage


@cache
def tabletop(height_mm: float) -> Tabletop:
    """Return the table at a height, made once."""
    return Tabletop(height_mm)


def phone(at_mm: Place, lift_mm: float = 0.0) -> Hand:
    """Return a phone that lies flat, or is held so high."""
    return Hand((Block((*at_mm, lift_mm), (146.0, 71.0, 8.5), 70.0),), ())


def booklet(at_mm: Place, lift_mm: float = 0.0) -> Hand:
    """Return a booklet that lies flat, or is held so high."""
    return Hand((Block((*at_mm, lift_mm), (148.0, 105.0, 15.0), 10.0),), ())


def cup(at_mm: Place, lift_mm: float = 0.0) -> Hand:
    """Return a cup, 93 mm high."""
    x_mm, y_mm = at_mm
    return Hand((Capsule((x_mm, y_mm, lift_mm + 38.0), (x_mm, y_mm, lift_mm + 55.0), 38.0, 38.0),), ())


def in_dark_sleeve(hand: Hand) -> Hand:
    """Return a pointing hand whose arm gives no readings."""
    return Hand(hand.solids[:-2], hand.fingertips, dark=hand.solids[-2:])
