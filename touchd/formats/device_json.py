"""device.json of a libfreenect recording: the constants that turn shift into millimetres."""

import json
from pathlib import Path
from typing import Any

from touchd.errors import RecordingError
from touchd.formats.folder import reading
from touchd.geometry import ZeroPlane

_PLACE = ("reg_info", "zero_plane_info")
_USUAL_COLOUR_DISTANCE_CM = 2.4  # between the two cameras; other programs expect it, we do not use it
_REMEDY = "correct it, or delete the file to use the usual constants"


def read_device_json(path: Path) -> ZeroPlane:
    """Return the zero-plane constants in ``path``.

    Raises RecordingError for a file that cannot be read or is no JSON, and for a constant that is missing
    or not within a tenth and ten times of the usual one, as no Kinect's is and as a wrong unit would make
    it.
    """
    with reading(path):
        text = path.read_bytes()
    try:
        stored: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path} is not valid JSON ({error}): {_REMEDY}") from error
    usual = ZeroPlane()
    return ZeroPlane(
        emitter_distance_cm=_constant(path, stored, (*_PLACE, "dcmos_emitter_distance"), usual.emitter_distance_cm),
        reference_distance_cm=_constant(path, stored, (*_PLACE, "reference_distance"), usual.reference_distance_cm),
        reference_pixel_size_mm=_constant(
            path, stored, (*_PLACE, "reference_pixel_size"), usual.reference_pixel_size_mm
        ),
        const_shift=_constant(path, stored, ("const_shift",), usual.const_shift),
    )


def _constant(path: Path, stored: Any, keys: tuple[str, ...], usual: float) -> float:
    name, value = ".".join(keys), stored
    for key in keys:
        if not isinstance(value, dict) or key not in value:
            raise RecordingError(f"{path} has no {name} (usually {usual:g}): {_REMEDY}")
        value = value[key]
    shown = "a group of values" if isinstance(value, dict | list) else json.dumps(value)[:40]
    if isinstance(value, bool) or not isinstance(value, int | float) or not usual / 10 < value < usual * 10:
        raise RecordingError(
            f"{path} has {shown} as {name}, which must be a positive number near the usual {usual:g}: {_REMEDY}"
        )
    return float(value)


def write_device_json(path: Path, zero_plane: ZeroPlane) -> None:
    """Write the constants in the layout of libfreenect's recorder; OSError where that fails."""
    content = {
        "reg_info": {
            "zero_plane_info": {
                "dcmos_emitter_distance": zero_plane.emitter_distance_cm,
                "dcmos_rcmos_distance": _USUAL_COLOUR_DISTANCE_CM,
                "reference_distance": zero_plane.reference_distance_cm,
                "reference_pixel_size": zero_plane.reference_pixel_size_mm,
            }
        },
        "const_shift": zero_plane.const_shift,
    }
    path.write_text(json.dumps(content, indent=4) + "\n", encoding="utf-8")
