"""The way of a frame through the core: surface, contacts, tracking. Pure: no clock, thread, socket, file or log.

The same frames, settings and versions give the same touches, to the byte.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import cv2
import numpy as np

from touchd.contacts.locate import Locator
from touchd.contacts.settings import BlobSettings
from touchd.contacts.shell import ShellFinder
from touchd.geometry import AreaMap, SurfaceMap, map_area, map_surface, measured_size_mm, whole_picture
from touchd.model import AreaCorners, Frame, Mask, Sensor, Shell, State, Surface, TouchFrame
from touchd.surface.calibrate import Calibration
from touchd.surface.quality import SurfaceReport, report
from touchd.surface.region import flat_area
from touchd.surface.settings import CalibrationSettings, ShellSettings
from touchd.surface.shell import shell_over
from touchd.tracking.settings import TrackingSettings
from touchd.tracking.tracker import Tracker

# Given and measured sizes of the area that differ by more than this mean wrong camera constants.
_SIZE_TOLERANCE = 0.03
# Blobs are looked for this far outside the area, so that a finger on its border is seen whole.
_MARGIN_MM = 30.0


class MissingArea(StrEnum):
    """What to take as the active area when none is configured."""

    WHOLE_PICTURE = "whole picture"
    FLAT_REGION = "flat region"


@dataclass(frozen=True, slots=True)
class PipelineSettings:
    """The settings of all stages."""

    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    shell: ShellSettings = field(default_factory=ShellSettings)
    blobs: BlobSettings = field(default_factory=BlobSettings)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    area: AreaCorners | None = None
    missing_area: MissingArea = MissingArea.WHOLE_PICTURE


@dataclass(frozen=True, slots=True)
class Ready:
    """Everything that is derived once per surface, so that a frame only has to be looked up in it."""

    surface: Surface
    surface_map: SurfaceMap
    shell: Shell
    area: AreaMap
    finder: ShellFinder
    locator: Locator
    report: SurfaceReport
    notes: tuple[str, ...]


class Pipeline:
    """Turns frames into touches: ``step`` one frame, ``stall`` when none came, ``calibrate`` to learn the surface anew.

    It begins without a surface: call ``calibrate``, or ``use`` a stored one.
    """

    def __init__(self, sensor: Sensor, settings: PipelineSettings, made_from: str) -> None:
        self._sensor = sensor
        self._settings = settings
        self._made_from = made_from
        self._calibration: Calibration | None = None
        self._ready: Ready | None = None
        self._tracker = Tracker(settings.tracking, (1.0, 1.0))
        self._last_index = 0

    @property
    def sensor(self) -> Sensor:
        """The camera whose frames it takes."""
        return self._sensor

    @property
    def made_from(self) -> str:
        """What surfaces learned here are said to be made from."""
        return self._made_from

    @property
    def surface(self) -> Surface | None:
        """The surface in force, None while there is none yet."""
        return self._ready.surface if self._ready else None

    @property
    def ready(self) -> Ready | None:
        """What frames are looked up in, None while there is no surface yet."""
        return self._ready

    @property
    def report(self) -> SurfaceReport | None:
        """What the surface in force is worth, None while there is none yet."""
        return self._ready.report if self._ready else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about the area in force that a user should read."""
        return self._ready.notes if self._ready else ()

    def step(self, frame: Frame) -> TouchFrame:
        """Return what one frame shows."""
        self._last_index = frame.index
        if self._calibration is not None:
            return self._calibrate_on(self._calibration, frame)
        if self._ready is None:
            return TouchFrame(frame.index, frame.t_ns, State.NO_SURFACE, why="no surface was learned: calibrate")
        blobs = self._ready.finder.find(frame.raw)
        contacts = self._ready.locator.contacts(blobs)
        cursors = self._tracker.step(contacts, frame.t_ns)
        return TouchFrame(frame.index, frame.t_ns, State.TRACKING, cursors)

    def stall(self, t_ns: int) -> TouchFrame:
        """End every touch because no frame came for a while."""
        self._tracker.end_all()
        return TouchFrame(self._last_index, t_ns, State.NO_FRAMES, why="no frame came from the source")

    def calibrate(self) -> None:
        """Learn the surface from the next frames; every touch ends."""
        self._tracker.end_all()
        self._calibration = Calibration(self._sensor, self._settings.calibration, self._made_from)

    def _calibrate_on(self, calibration: Calibration, frame: Frame) -> TouchFrame:
        calibration.add(frame.raw)
        why = f"frame {calibration.frames} of {self._settings.calibration.frames}"
        if calibration.complete:
            self._calibration = None
            self.use(calibration.surface())
        return TouchFrame(frame.index, frame.t_ns, State.CALIBRATING, why=why)

    def use(self, surface: Surface) -> None:
        """Take a surface of this sensor as it is. Live touches go on."""
        self._ready = _ready_for(surface, self._settings)
        self._tracker.adopt(self._settings.tracking, self._ready.area.size_mm)


def _ready_for(surface: Surface, settings: PipelineSettings) -> Ready:
    surface_map = map_surface(surface)
    shell = shell_over(surface, settings.shell)
    corners, notes = _corners(surface, surface_map, settings)
    measured = measured_size_mm(corners, surface_map)
    area = map_area(corners, surface.sensor.intrinsics, corners.size_mm or measured)
    if corners.size_mm is not None:
        notes += _size_notes(corners.size_mm, measured)
    inside = _inside(corners, surface.valid.shape)
    with_margin = _grown(inside, area, surface_map)
    return Ready(
        surface=surface,
        surface_map=surface_map,
        shell=shell,
        area=area,
        finder=ShellFinder(surface, shell, settings.blobs, with_margin),
        locator=Locator(surface.sensor, surface_map, area, settings.blobs),
        report=report(surface, surface_map, shell, inside),
        notes=notes,
    )


def _corners(
    surface: Surface, surface_map: SurfaceMap, settings: PipelineSettings
) -> tuple[AreaCorners, tuple[str, ...]]:
    if settings.area is not None:
        return settings.area, ()
    if settings.missing_area is MissingArea.WHOLE_PICTURE:
        return whole_picture(surface.sensor), ()
    guessed = flat_area(surface, surface_map)
    if guessed is not None:
        return guessed, ("area guessed: run touchd align",)
    return whole_picture(surface.sensor), (
        "no flat region around the picture's centre, so the whole picture is the area: run touchd align",
    )


def _size_notes(given: tuple[float, float], measured: tuple[float, float]) -> tuple[str, ...]:
    off = max(abs(m / g - 1.0) for m, g in zip(measured, given, strict=True))
    if off <= _SIZE_TOLERANCE:
        return ()
    return (
        f"area.size_mm says {given[0]:.0f} x {given[1]:.0f} mm but the camera measures {measured[0]:.0f} x "
        f"{measured[1]:.0f} mm, {off:.0%} off: measure the area again, else the camera constants (camera.fx, fy) are "
        "wrong",
    )


def _inside(corners: AreaCorners, shape: tuple[int, ...]) -> Mask:
    mask = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(mask, np.rint(np.array(corners.corners_px)).astype(np.int32), (1,))
    return mask > 0


def _grown(inside: Mask, area: AreaMap, surface_map: SurfaceMap) -> Mask:
    if not inside.any():
        return inside
    reach = int(_MARGIN_MM * area.intrinsics.fx / float(np.median(surface_map.depth[inside]))) + 1
    return cv2.dilate(inside.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0
