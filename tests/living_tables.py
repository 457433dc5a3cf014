"""A table with a pipeline that has learned it: what tests of a living surface begin with."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from touchd.model import AreaCorners, Floats, Frame, Mask, Surface, TouchFrame
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings, prepare
from touchd.surface.calibrate import Calibration
from touchd.surface.coarse import CoarseHeights
from touchd.surface.living import LivingSurface
from touchd.surface.settings import CalibrationSettings
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.misreading import TRUE_READING
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.table import Table

from shifting_table import off_by

LEARNING = 60
AT_MM = (40.0, 20.0)


@cache
def learned(height_mm: float) -> tuple[Table, Surface]:
    """Return an empty table that is so far away, and its surface."""
    table = Table(TableCamera(height_mm, tilt_deg=6.0), seed=4)
    calibration = Calibration(table.sensor, CalibrationSettings(frames=LEARNING), "a test")
    for index in range(LEARNING):
        calibration.add(table.render([], 0, index).raw)
    return table, calibration.surface_so_far()


def settings(height_mm: float, method: str = "fingertip") -> PipelineSettings:
    area = Area((0.0, 0.0), (0.75 * height_mm, 0.5 * height_mm))
    a, b, c, d = ((u, v) for u, v in area_corners_px(TableCamera(height_mm, tilt_deg=6.0), area).tolist())
    return PipelineSettings(method=method, area=AreaCorners((a, b, c, d), area.size_mm))


@cache
def ready(height_mm: float) -> CoarseHeights:
    made = prepare(learned(height_mm)[1], settings(height_mm, "shell"))
    return made.coarse


def finger(clearance_mm: float = 0.0, at_mm: tuple[float, float] = AT_MM, heading_deg: float = 180.0) -> Hand:
    return pointing_hand(HandPose(at_mm, clearance_mm, heading_deg, pitch_deg=50.0))


@dataclass
class Desk:
    """A table that is played frame by frame into a pipeline; ``shift`` makes it read differently from then on."""

    height_mm: float
    method: str = "fingertip"
    frame_ns: int = 33_333_333
    accel_g: tuple[float, float, float] | None = None
    frames: int = LEARNING
    results: list[TouchFrame] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.table, surface = learned(self.height_mm)
        self.wrong = TRUE_READING
        self.pipeline = Pipeline(surface.sensor, settings(self.height_mm, self.method), "a test")
        self.pipeline.use(surface)

    def shift(self, raw: Floats | float) -> None:
        """Read farther by so many raw steps, a number or (H, W), from the next frame on."""
        self.wrong = off_by(raw)

    @property
    def living(self) -> LivingSurface:
        living = self.pipeline._living
        assert living is not None
        return living

    def frame(self, hands: Sequence[Hand] = ()) -> Frame:
        index, self.frames = self.frames, self.frames + 1
        frame = self.table.render(hands, index * self.frame_ns, index, self.wrong)
        return Frame(index, frame.t_ns, frame.raw, accel_g=self.accel_g)

    def play(self, count: int, *hands: Hand) -> list[TouchFrame]:
        """Play so many frames with these hands over the table."""
        return [self.pipeline.step(self.frame(hands)) for _ in range(count)]

    def mask_of(self, *things: Hand) -> Mask:
        """Return where (H, W) things are seen."""
        mask: Mask = self.table.true_depth([]).depth_mm - self.table.true_depth(things).depth_mm > 0.5
        return mask


def cursor_counts(results: Sequence[TouchFrame]) -> list[int]:
    return [len(result.cursors) for result in results]


def off_raw(desk: Desk, shift: Floats | float) -> Floats:
    """Return by how much (H, W) the living surface reads off the truth, where the surface is known."""
    surface = learned(desk.height_mm)[1]
    off = desk.living.whole().reference - surface.reference - np.asarray(shift, np.float32)
    return np.where(surface.valid, off, np.float32(0.0))
