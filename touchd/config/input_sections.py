"""The config's sections on what touchd sees: the source, its camera, and the active area."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from touchd.config.checks import check_corners
from touchd.config.section import Expects, FilePath, Section, field
from touchd.table.scenario_names import DEFAULT_SCENARIO

_Px = Annotated[float, Field(ge=-1000, le=5000)]
_Corner = tuple[_Px, _Px]
_Mm = Annotated[float, Field(ge=10, le=10_000)]


class Source(Section):
    """Where depth pictures come from."""

    kind: Literal["kinect", "recording", "synthetic", "realsense"] = field("kinect", "Which kind of source", "source")
    path: FilePath | None = field(None, "The recording to play: a folder", "source", example="recordings/table")
    serial: str | None = field(
        None,
        "Which camera, where several are connected: a serial number or USB place that touchd list shows; without it the"
        " one that the stored surface was made with, else the first",
        "source",
        example="A00364A04287049A",
    )
    ir_brightness: Annotated[int, Field(ge=1, le=50)] | None = field(
        None, "Brightness of a Kinect's infrared projector; without it as the Kinect has it", "source", "steps", 25
    )
    near_mode: bool | None = field(
        None,
        "Near mode of a Kinect for Windows, from 0.4 m on; without it as the Kinect has it",
        "source",
        example=True,
    )
    scenario: Literal["mixed", "taps", "drag", "pinch", "ten", "two-hands", "hover", "circles"] = field(
        DEFAULT_SCENARIO, "What the hands over the synthetic table do", "source"
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = field(
        1, "Which synthetic table: another number draws another one, with other hands", "source"
    )


class Camera(Section):
    """The depth camera's constants; what is left out comes from the sensor."""

    fx: Annotated[float, Field(ge=50, le=5000)] | None = field(
        None, "Focal length along the picture's rows", "source", "pixels", 575.8
    )
    fy: Annotated[float, Field(ge=50, le=5000)] | None = field(
        None, "Focal length along the picture's columns", "source", "pixels", 575.8
    )
    cx: Annotated[float, Field(ge=0, le=5000)] | None = field(
        None, "Column of the optical axis, from the left", "source", "pixels", 319.5
    )
    cy: Annotated[float, Field(ge=0, le=5000)] | None = field(
        None, "Row of the optical axis, from the top", "source", "pixels", 239.5
    )
    k1: Annotated[float, Field(ge=-2, le=2)] | None = field(
        None, "Radial distortion, the factor of r²", "source", "", 0.05
    )
    k2: Annotated[float, Field(ge=-2, le=2)] | None = field(
        None, "Radial distortion, the factor of r⁴", "source", "", -0.1
    )


class Area(Section):
    """The active area on the surface."""

    corners_px: Annotated[
        tuple[_Corner, _Corner, _Corner, _Corner],
        Expects("four corners [u, v] in pixels from -1000 to 5000"),
        AfterValidator(check_corners),
    ] = Field(
        description="Top-left, top-right, bottom-right, bottom-left corner as depth pixels: column, row",
        examples=[((60, 40), (580, 44), (570, 430), (66, 424))],
        json_schema_extra={"unit": "pixels", "reload": "live"},
    )
    size_mm: (
        Annotated[
            tuple[_Mm, _Mm],
            Expects("[width, height] in millimetres from 10 to 10000"),
        ]
        | None
    ) = field(
        None,
        "Its width and height on the surface; left out: derived from the surface",
        unit="millimetres",
        example=(800, 600),
    )
