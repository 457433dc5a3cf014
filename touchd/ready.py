"""What a pipeline looks frames up in: all that is derived once per surface, and where it lies after a knock."""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import dist

from touchd.contacts.aim import EyeOffsets
from touchd.contacts.method import ContactMethod, FollowsArea, FollowsSurface, Place
from touchd.contacts.methods import method_maker
from touchd.contacts.settings import BlobSettings
from touchd.geometry import AreaMap, Plane, SurfaceMap, map_area, map_surface, measured_size_mm, whole_picture
from touchd.hands.lookout import Lookout
from touchd.hands.settings import ObjectSettings
from touchd.model import AreaCorners, FollowedArea, Shell, Surface, SurfaceRows
from touchd.surface.coarse import CoarseHeights
from touchd.surface.quality import SurfaceReport, report
from touchd.surface.region import flat_area, inside_of, with_margin
from touchd.surface.settings import CalibrationSettings, LivingSettings, ShellSettings
from touchd.surface.shell import shell_over
from touchd.surface.turning import corners_after
from touchd.tracking.settings import TrackingSettings

# Given and measured sizes of the area that differ by more than this mean wrong camera constants.
_SIZE_TOLERANCE = 0.03
_MOVED_NOTE = "the camera or the table was moved: if touches lie beside the fingers, run touchd align"
_FOLLOWED_NOTE = (
    "the camera was knocked, and the corners of the area followed, by up to {:.0f} px: if touches lie beside the "
    "fingers, run touchd align"
)


class MissingArea(StrEnum):
    """What to take as the active area when none is configured."""

    WHOLE_PICTURE = "whole picture"
    FLAT_REGION = "flat region"


@dataclass(frozen=True, slots=True)
class PipelineSettings:
    """The settings of all stages."""

    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    living: LivingSettings = field(default_factory=LivingSettings)
    method: str = "fingertip"
    shell: ShellSettings = field(default_factory=ShellSettings)
    blobs: BlobSettings = field(default_factory=BlobSettings)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    objects: ObjectSettings = field(default_factory=ObjectSettings)
    area: AreaCorners | None = None
    missing_area: MissingArea = MissingArea.WHOLE_PICTURE
    eye: EyeOffsets | None = None


@dataclass(frozen=True, slots=True)
class Ready:
    """Everything that is derived once per surface, so that a frame only has to be looked up in it."""

    settings: PipelineSettings
    surface: Surface
    surface_map: SurfaceMap
    shell: Shell
    corners: AreaCorners
    area: AreaMap
    place: Place
    coarse: CoarseHeights
    method: ContactMethod
    lookout: Lookout
    report: SurfaceReport
    surface_notes: tuple[str, ...]
    move_note: str | None = None  # of a knock that the area's corners could not follow

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the area."""
        followed = _followed_by(self.surface, self.settings)
        told = (*self.surface_notes, self.move_note, None if followed is None else _followed_note(followed))
        return tuple(note for note in told if note is not None)

    def area_after_knock(self, planes: tuple[Plane, Plane] | None) -> FollowedArea | None:
        """Return where the area's corners are seen once its plane has become another; None where that cannot be told.

        ``planes``: before and after.
        """
        corners = None
        if planes is not None:
            corners = corners_after(self.corners, self.surface.sensor.intrinsics, *planes)
        return None if corners is None else FollowedArea(self.settings.area, corners)

    def after_move(self, surface: Surface) -> "Ready":
        """Return it for the same surface after the camera was knocked; the area is where that says."""
        followed = _followed_by(surface, self.settings)
        if followed is None:
            return replace(self, surface=surface, move_note=_MOVED_NOTE)
        area = map_area(followed.corners, surface.sensor.intrinsics, self.area.size_mm)
        if isinstance(self.method, FollowsArea):
            self.method.relocate(area)
        self.lookout.relocate(area)
        place = replace(self.place, area=area)
        return replace(self, surface=surface, corners=followed.corners, area=area, place=place, move_note=None)

    def serves(self, settings: PipelineSettings) -> bool:
        """Return whether it holds under other settings as well: those of its own stages alone matter."""
        own = self.settings
        return own == replace(
            settings,
            calibration=own.calibration,
            living=own.living,
            tracking=own.tracking,
            objects=own.objects,
            eye=own.eye,
        )

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the surface to read differently from now on."""
        self.coarse.follow(now)
        if isinstance(self.method, FollowsSurface):
            self.method.follow(now)

    def lines(self) -> list[str]:
        """Return what a user should know about the surface and the area."""
        return [*self.report.lines(), *self.notes]


def prepare(surface: Surface, settings: PipelineSettings, known: Ready | None = None) -> Ready:
    """Return everything that is derived from a surface under settings; takes a fraction of a second.

    ``known``: what was made before; what is costly and holds for the same surface is taken from it.
    """
    surface_map = known.surface_map if known is not None and known.surface is surface else map_surface(surface)
    shell = shell_over(surface, settings.shell)
    corners, notes = _corners(surface, surface_map, settings)
    followed = _followed_by(surface, settings)
    if followed is not None:
        corners = followed.corners
    measured = measured_size_mm(corners, surface_map)
    area = map_area(corners, surface.sensor.intrinsics, corners.size_mm or measured)
    if corners.size_mm is not None:
        notes += _size_notes(corners.size_mm, measured)
    inside = inside_of(corners, surface.valid.shape)
    place = Place(surface, surface_map, shell, area, with_margin(inside, area, surface_map), settings.blobs)
    return Ready(
        settings=settings,
        surface=surface,
        surface_map=surface_map,
        shell=shell,
        corners=corners,
        area=area,
        place=place,
        coarse=CoarseHeights(surface, surface_map),
        method=method_maker(settings.method)(place),
        lookout=Lookout(surface, surface_map, area),
        report=report(surface, surface_map, shell, inside),
        surface_notes=notes,
        move_note=known.move_note if known is not None and known.surface is surface else None,
    )


def _followed_by(surface: Surface, settings: PipelineSettings) -> FollowedArea | None:
    """Return where the configured area is since a knock, None where none is known of."""
    followed = surface.followed
    return followed if followed is not None and followed.area == settings.area else None


def _followed_note(followed: FollowedArea) -> str:
    if followed.area is None:
        return _MOVED_NOTE
    pairs = zip(followed.corners.corners_px, followed.area.corners_px, strict=True)
    return _FOLLOWED_NOTE.format(max(dist(now, then) for now, then in pairs))


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
