"""An alignment: the active area as the user's finger showed it, and when it goes before the config file's."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from touchd.contacts.aim import EyeOffsets
from touchd.errors import ExitCode, TouchdError
from touchd.model import AreaCorners

Corners: TypeAlias = tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]


class AlignmentError(TouchdError):
    """The touched points make no area."""

    exit_code = ExitCode.TRY_AGAIN


class AreaOrigin(StrEnum):
    """Where the active area in force comes from; the words are part of the status."""

    CONFIG = "config"
    ALIGNMENT = "alignment"
    SOURCE = "source"
    GUESSED = "guessed"
    WHOLE_PICTURE = "whole picture"


@dataclass(frozen=True, slots=True)
class Alignment:
    """The area's corners as depth pixels as seen, top-left first, clockwise; and how well the touched points agree.

    ``eye`` is how far ahead of their touch people aim, where that was asked for.
    """

    corners_px: Corners
    size_mm: tuple[float, float]  # width and height as they lie on the surface
    residual_mm: float  # rms; for four points: off a rectangle, for nine: off an even grid
    points: int  # how many were touched
    eye: EyeOffsets | None = None


@dataclass(frozen=True, slots=True)
class KeptAlignment:
    """An alignment as it is stored: with its time, and the corners that the config file gave when it was made."""

    alignment: Alignment
    made_s: float  # Unix time
    config_corners: Corners | None


def area_in_force(config: AreaCorners | None, kept: KeptAlignment | None) -> tuple[AreaCorners | None, AreaOrigin]:
    """Return the newer one of the alignment and the config's area, and which it is; None where it must be guessed.

    The alignment is in force while the config's corners are what they were when it was made. A size in the config is
    the user's measure, and holds in either case.
    """
    config_corners = None if config is None else config.corners_px
    if kept is not None and kept.config_corners == config_corners:
        return AreaCorners(kept.alignment.corners_px, None if config is None else config.size_mm), AreaOrigin.ALIGNMENT
    return config, AreaOrigin.GUESSED if config is None else AreaOrigin.CONFIG


def eye_in_force(config: EyeOffsets | None, kept: KeptAlignment | None, origin: AreaOrigin) -> EyeOffsets | None:
    """Return how far ahead of their touch people aim: as the config says, else as the alignment in force found."""
    if config is not None or kept is None or origin is not AreaOrigin.ALIGNMENT:
        return config
    return kept.alignment.eye
