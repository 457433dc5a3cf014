"""The alignment's file in the state folder: JSON that people can read, with version, camera and checksum."""

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from touchd.align.alignment import Alignment, Corners, KeptAlignment
from touchd.contacts.aim import EyeOffsets
from touchd.errors import StateError
from touchd.model import Sensor
from touchd.state import camera_identity, other_camera, write_whole

ALIGNMENT_FILE = "alignment.json"
_KIND = "touchd alignment"
_VERSION = 1
_REMEDY = "run touchd align"


def save_alignment(path: Path, kept: KeptAlignment, sensor: Sensor) -> None:
    """Store an alignment. Raises StateNotKept if it cannot be written."""
    content = {
        **asdict(kept.alignment),
        "made": kept.made_s,
        "config_corners": kept.config_corners,
        "camera": camera_identity(sensor),
    }
    whole = {"kind": _KIND, "version": _VERSION, "sha256": _checksum(content), **content}
    write_whole(path, json.dumps(whole, indent=1, allow_nan=False).encode("ascii") + b"\n")


def load_alignment(path: Path, sensor: Sensor) -> KeptAlignment | None:
    """Return the stored alignment, None if none was stored.

    Raises StateError, saying what is wrong, if the file cannot be read or is damaged, or is of another version or
    camera.
    """
    try:
        whole = json.loads(path.read_bytes())
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StateError(f"{path}: the alignment cannot be read: {error.strerror}; {_REMEDY}") from error
    except (ValueError, RecursionError):
        whole = None
    if not isinstance(whole, dict) or whole.pop("kind", None) != _KIND:
        raise StateError(f"{path}: this is no alignment of touchd; {_REMEDY}")
    version, checksum = whole.pop("version", None), whole.pop("sha256", None)
    if version != _VERSION:
        raise StateError(
            f"{path}: the alignment has version {version}, this touchd reads version {_VERSION}; {_REMEDY}"
        )
    if checksum != _checksum(whole):
        raise StateError(f"{path}: the alignment is damaged (its checksum does not fit); {_REMEDY}")
    difference = other_camera(whole.get("camera"), sensor)
    if difference is not None:
        raise StateError(f"{path}: the alignment was made with another camera ({difference}); {_REMEDY}")
    try:
        return _kept(whole)
    except (KeyError, TypeError, ValueError) as error:
        raise StateError(f"{path}: the alignment is misshapen ({error}); {_REMEDY}") from error


def _checksum(content: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode("ascii")).hexdigest()


def _kept(content: dict[str, Any]) -> KeptAlignment:
    width, height = map(_number, content["size_mm"])
    given = content["config_corners"]
    return KeptAlignment(
        alignment=Alignment(
            corners_px=_corners(content["corners_px"]),
            size_mm=(width, height),
            residual_mm=_number(content["residual_mm"]),
            points=round(_number(content["points"])),
            eye=_eye(content.get("eye")),
        ),
        made_s=_number(content["made"]),
        config_corners=None if given is None else _corners(given),
    )


def _eye(value: dict[str, float] | None) -> EyeOffsets | None:
    """Return the offsets; files of before they were measured have none."""
    if value is None:
        return None
    return EyeOffsets(*(_number(value[side]) for side in ("bottom", "top", "left", "right")))


def _corners(value: list[list[float]]) -> Corners:
    (a, b), (c, d), (e, f), (g, h) = ([_number(axis) for axis in corner] for corner in value)
    return (a, b), (c, d), (e, f), (g, h)


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"found {value!r} in place of a number")
    return float(value)
