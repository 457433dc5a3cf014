"""The config's sections on calibration, touch and tracking; defaults are those of the stages' settings."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from touchd.config.checks import check_odd, fault
from touchd.config.section import Emptiable, Section, field
from touchd.contacts.names import method_names
from touchd.contacts.settings import BlobSettings
from touchd.hands.settings import ObjectSettings
from touchd.surface.settings import CalibrationSettings, LivingSettings
from touchd.tracking.settings import TrackingSettings

_CALIBRATION = CalibrationSettings()
_LIVING = LivingSettings()
_BLOBS = BlobSettings()
_TRACKING = TrackingSettings()
_OBJECTS = ObjectSettings()
_Auto = Literal["auto"]


def _known_method(name: str) -> str:
    """Return ``name`` if a contact method is called so."""
    names = method_names()
    if name not in names:
        raise fault(f"there is no method {name!r}; choose one of {', '.join(names)}")
    return name


class Calibration(Section):
    """How the empty surface is learned."""

    frames: Annotated[int, Field(ge=10, le=10_000)] = field(
        _CALIBRATION.frames, "How many depth frames are learned from", unit="frames"
    )
    on_start: Literal["if-missing", "always", "never"] = field(
        "if-missing", "When to calibrate at the start: only where no surface is stored, each time, or never"
    )
    give_up_s: Annotated[float, Field(ge=1, le=3600)] = field(
        _CALIBRATION.give_up_s,
        "How long a running touchd waits for a scene without motion before the surface from before is used again",
        unit="seconds",
    )
    min_share: Annotated[float, Field(ge=0, le=0.5)] = field(
        _CALIBRATION.min_share, "Rarer readings of a pixel are taken for noise", unit="share of its readings"
    )


class Surface(Section):
    """How the surface lives after it was learned."""

    follow: bool = field(
        _LIVING.follow,
        "Follow drift, and learn the surface again by itself once the camera or the table was moved; false: it stays"
        " as it was learned",
    )


class Shell(Section):
    """The paper's method: pixels in a layer above the surface are touching it."""

    delta_raw: Annotated[int, Field(ge=1, le=1000)] | None = field(
        None,
        "The paper's literal thickness of the layer, in place of far_mm",
        unit="raw steps of the sensor",
        example=4,
    )
    boxcar_px: Annotated[int, Field(ge=1, le=51), AfterValidator(check_odd)] = field(
        _BLOBS.boxcar_px, "Side of the window that smooths the layer's pixels, an odd number", unit="pixels"
    )
    threshold: Annotated[float, Field(ge=0.01, le=1)] = field(
        _BLOBS.threshold, "How much of the window must be in the layer for a new touch", unit="share"
    )
    keep_threshold: Annotated[float, Field(ge=0.01, le=1)] = field(
        _BLOBS.keep_threshold, "The same for a touch that is already there; at most threshold", unit="share"
    )

    @model_validator(mode="after")
    def _keeping_is_no_harder_than_beginning(self) -> Self:
        if self.keep_threshold > self.threshold:
            key = "keep_threshold" if "keep_threshold" in self.model_fields_set else "threshold"
            raise fault(
                f"keep_threshold ({self.keep_threshold:g}) is above threshold ({self.threshold:g}); a touch"
                f" would end as it begins; set keep_threshold to {self.threshold:g} or less",
                key,
            )
        return self


_AimMm = Annotated[float, Field(ge=-30, le=30)]
_AIM = "Of fingers that reach in from the area's {} edge"


class EyeOffset(Section):
    """How far ahead of the touch, along the finger, people aim; in place of what 'touchd align --eye' measured."""

    bottom: _AimMm = field(0.0, _AIM.format("bottom"), unit="millimetres")
    top: _AimMm = field(0.0, _AIM.format("top"), unit="millimetres")
    left: _AimMm = field(0.0, _AIM.format("left"), unit="millimetres")
    right: _AimMm = field(0.0, _AIM.format("right"), unit="millimetres")


class Touch(Section):
    """What counts as a touch."""

    method: Annotated[str, AfterValidator(_known_method)] = field(
        "fingertip", "How touches are found: fingertip, shell (the paper's), or one that an installed package brings"
    )
    near_mm: _Auto | Annotated[float, Field(ge=0, le=100)] = field(
        "auto",
        "Method shell: lower boundary of the layer that touches, above the surface; auto: from the sensor's noise",
        unit="millimetres",
    )
    far_mm: _Auto | Annotated[float, Field(ge=1, le=200)] = field(
        "auto",
        "Method shell: upper boundary of the layer, above the surface; auto: from the sensor's step",
        unit="millimetres",
    )
    min_area_mm2: Annotated[float, Field(ge=0, le=100_000)] = field(
        _BLOBS.min_area_mm2, "Method shell: smaller contacts are no fingers", unit="square millimetres"
    )
    max_area_mm2: Annotated[float, Field(ge=1, le=1_000_000)] = field(
        _BLOBS.max_area_mm2, "Method shell: larger contacts are no fingers", unit="square millimetres"
    )
    shell: Annotated[Shell, Emptiable] = field(Shell(), "The paper's method in detail")
    eye_offset_mm: Annotated[EyeOffset, Emptiable] = field(
        EyeOffset(),
        "How far ahead of the touch, along the finger, people aim; without any of these as 'touchd align --eye' found",
    )

    @model_validator(mode="after")
    def _bounds_enclose_something(self) -> Self:
        if self.near_mm != "auto" and self.far_mm != "auto" and self.far_mm <= self.near_mm:
            raise fault(f"expected more than near_mm ({self.near_mm:g}), found {self.far_mm:g}", "far_mm")
        if self.far_mm != "auto" and self.shell.delta_raw is not None:
            raise fault("set beside shell.delta_raw, which replaces it; remove one of the two", "far_mm")
        if self.max_area_mm2 <= self.min_area_mm2:
            key = "max_area_mm2" if "max_area_mm2" in self.model_fields_set else "min_area_mm2"
            raise fault(
                f"max_area_mm2 ({self.max_area_mm2:g}) is not above min_area_mm2 ({self.min_area_mm2:g});"
                " no contact could count",
                key,
            )
        return self


class Tracking(Section):
    """How touches are followed from frame to frame."""

    stall_ms: Annotated[float, Field(ge=34, le=5000)] = field(
        _TRACKING.stall_ms, "Without a frame for this long all touches end", unit="milliseconds"
    )
    coast_ms: Annotated[float, Field(ge=0, le=1000)] = field(
        _TRACKING.coast_ms, "How long a touch outlives its contact", unit="milliseconds"
    )
    gate_mm: Annotated[float, Field(ge=1, le=500)] = field(
        _TRACKING.gate_mm,
        "How far from where it was expected a touch may be found a frame later; a moving one half its way farther",
        unit="millimetres",
    )
    stray_mm: Annotated[float, Field(ge=0, le=100)] = field(
        _TRACKING.stray_mm, "How far a touch may slide out of the area before it ends", unit="millimetres"
    )
    min_cutoff_hz: Annotated[float, Field(ge=0.01, le=100)] = field(
        _TRACKING.min_cutoff_hz, "Smoothing at rest: lower is steadier and slower", unit="hertz"
    )
    beta_hz_s_mm: Annotated[float, Field(ge=0, le=100)] = field(
        _TRACKING.beta_hz_s_mm,
        "How fast the smoothing gives way with speed: higher follows closer",
        unit="hertz per mm/s",
    )
    rest_mm_s: Annotated[float, Field(ge=0, le=500)] = field(
        _TRACKING.rest_mm_s, "Below this speed a touch is at rest", unit="millimetres a second"
    )
    hover_mm: Annotated[float, Field(ge=0, le=45)] = field(
        _TRACKING.hover_mm,
        "Fingertips up to this height over the surface are followed as hovers; 0 for none",
        unit="millimetres",
    )


class Objects(Section):
    """Things that are put down on the surface; they are no touches."""

    join_after_s: Annotated[float, Field(ge=0.5, le=3600)] = field(
        _OBJECTS.join_after_s,
        "After lying still for so long, once no hand is over or near it, a thing joins the surface and can be touched",
        unit="seconds",
    )
