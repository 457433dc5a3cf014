"""The whole config: every key's default, range, unit and meaning is in its sections, and only there."""

from dataclasses import replace
from typing import Annotated

from pydantic import AfterValidator

from touchd.config.checks import check_version
from touchd.config.input_sections import Area, Camera, Source
from touchd.config.output_sections import Output, Tuio, check_profiles_are_apart
from touchd.config.section import Emptiable, Expects, Section, field
from touchd.config.touch_sections import Calibration, Objects, Surface, Touch, Tracking
from touchd.contacts.aim import EyeOffsets
from touchd.contacts.settings import BlobSettings
from touchd.hands.settings import ObjectSettings
from touchd.model import AreaCorners, Intrinsics
from touchd.surface.settings import CalibrationSettings, LivingSettings, ShellSettings
from touchd.tracking.settings import TrackingSettings


class Config(Section):
    """A valid config; ``Config()`` is the default one. Paths in it are resolved already."""

    version: Annotated[int, Expects("1"), AfterValidator(check_version)] = field(1, "Layout of this file", "restart")
    source: Annotated[Source, Emptiable] = field(Source(), "Where depth pictures come from", "source")
    camera: Annotated[Camera, Emptiable] = field(
        Camera(), "The depth camera's constants; what is left out comes from the sensor", "source"
    )
    calibration: Annotated[Calibration, Emptiable] = field(Calibration(), "How the empty surface is learned")
    surface: Annotated[Surface, Emptiable] = field(Surface(), "How the surface lives after it was learned")
    area: Area | None = field(
        None,
        "The active area. Left out: found by 'touchd align', else guessed; in a replay the whole picture",
    )
    touch: Annotated[Touch, Emptiable] = field(Touch(), "What counts as a touch")
    tracking: Annotated[Tracking, Emptiable] = field(Tracking(), "How touches are followed from frame to frame")
    objects: Annotated[Objects, Emptiable] = field(
        Objects(), "Things that are put down on the surface; they are no touches"
    )
    outputs: Annotated[
        tuple[Output, ...],
        Expects("list items '- tuio:' or '- events:', or [] for no output"),
        AfterValidator(check_profiles_are_apart),
    ] = field((Output(tuio=Tuio()),), "Where touches go, any number of outputs; [] for none")

    def was_set(self, path: str) -> bool:
        """Return whether the file gives the key with this dotted path, such as "calibration.frames".

        A section counts as given when its name is there. Lists are taken as a whole: "outputs".
        Raises ValueError for a key that no config has.
        """
        section: object = self
        for name in path.split("."):
            if section is None:
                return False
            if not isinstance(section, Section) or name not in type(section).model_fields:
                raise ValueError(f'"{path}" is no key of the config')
            if name not in section.model_fields_set:
                return False
            section = getattr(section, name)
        return True

    def calibration_settings(self) -> CalibrationSettings:
        """Return how the surface stage is to learn the empty surface."""
        given = self.calibration
        return CalibrationSettings(frames=given.frames, min_share=given.min_share, give_up_s=given.give_up_s)

    def living_settings(self) -> LivingSettings:
        """Return how the surface stage is to go with a surface that changes."""
        return LivingSettings(follow=self.surface.follow)

    def shell_settings(self) -> ShellSettings:
        """Return the layer in which the surface stage looks for contacts; None stands for "auto"."""
        near_mm, far_mm = self.touch.near_mm, self.touch.far_mm
        return ShellSettings(
            near_mm=None if near_mm == "auto" else near_mm,
            far_mm=None if far_mm == "auto" else far_mm,
            delta_raw=self.touch.shell.delta_raw,
        )

    def blob_settings(self) -> BlobSettings:
        """Return how the contact stage is to make contacts of pixels."""
        shell = self.touch.shell
        return BlobSettings(
            boxcar_px=shell.boxcar_px,
            threshold=shell.threshold,
            keep_threshold=shell.keep_threshold,
            min_area_mm2=self.touch.min_area_mm2,
            max_area_mm2=self.touch.max_area_mm2,
        )

    def eye_offsets(self) -> EyeOffsets | None:
        """Return how far ahead of their touch people aim, or None where the file does not say."""
        given = self.touch.eye_offset_mm
        if not given.model_fields_set:
            return None
        return EyeOffsets(given.bottom, given.top, given.left, given.right)

    def tracking_settings(self) -> TrackingSettings:
        """Return how the tracking stage is to follow contacts."""
        return TrackingSettings(**self.tracking.model_dump())

    def object_settings(self) -> ObjectSettings:
        """Return how things on the surface are to be treated."""
        return ObjectSettings(**self.objects.model_dump())

    def area_corners(self) -> AreaCorners | None:
        """Return the active area, or None where the file gives none."""
        return None if self.area is None else AreaCorners(self.area.corners_px, self.area.size_mm)

    def intrinsics(self, default: Intrinsics) -> Intrinsics:
        """Return the camera's constants: those that the file gives, and the rest of ``default``."""
        return replace(default, **self.camera.model_dump(exclude_none=True))
