"""The constants that a Kinect was given in the factory: out of its replies, and checked before they are believed."""

from dataclasses import dataclass
from math import isfinite
from struct import Struct, unpack_from

from touchd.geometry import ZeroPlane

# Emitter distance in cm, colour camera distance in cm, reference distance in cm, reference pixel size in mm.
# (Source: the OpenKinect project.)
_FIXED = Struct("<ffff")
_FIXED_OFFSET = 94
_SHIFT_OFFSET = 2
_BELIEVED_FACTOR = 2.0  # from the usual value: real units lie within a few per cent


@dataclass(frozen=True, slots=True)
class DeviceConstants:
    """The constants to use, and in words what of the camera's own was not believed and replaced by the usual."""

    zero_plane: ZeroPlane
    doubts: tuple[str, ...] = ()


def device_constants(fixed_parameters: bytes, const_shift: bytes) -> DeviceConstants:
    """Return the constants in the payloads of the replies to FIXED_PARAMETERS and CONST_SHIFT.

    The three of the former are believed together or not at all: one that cannot be means that they lie elsewhere.
    """
    usual = ZeroPlane()
    doubts = []
    emitter, reference, pixel_size, doubt = _distances(fixed_parameters, usual)
    if doubt:
        doubts.append(doubt)
    shift, doubt = _shift(const_shift, usual)
    if doubt:
        doubts.append(doubt)
    return DeviceConstants(ZeroPlane(emitter, reference, pixel_size, shift), tuple(doubts))


def _distances(payload: bytes, usual: ZeroPlane) -> tuple[float, float, float, str | None]:
    as_usual = usual.emitter_distance_cm, usual.reference_distance_cm, usual.reference_pixel_size_mm
    least = _FIXED_OFFSET + _FIXED.size
    if len(payload) < least:
        why = f"its fixed parameters have {len(payload)} bytes where at least {least} are needed"
        return *as_usual, _doubt(why, "distances")
    emitter, _, reference, pixel_size = _FIXED.unpack_from(payload, _FIXED_OFFSET)
    names = "emitter distance in cm", "reference distance in cm", "reference pixel size in mm"
    for name, value, expected in zip(names, (emitter, reference, pixel_size), as_usual, strict=True):
        if not _believable(value, expected):
            return *as_usual, _doubt(f"it gives {value:g} as its {name}, usually {expected:g}", "distances")
    return emitter, reference, pixel_size, None


def _shift(payload: bytes, usual: ZeroPlane) -> tuple[float, str | None]:
    least = _SHIFT_OFFSET + 2
    if len(payload) < least:
        why = f"its algorithm parameters have {len(payload)} bytes where at least {least} are needed"
        return usual.const_shift, _doubt(why, "shift")
    (shift,) = unpack_from("<H", payload, _SHIFT_OFFSET)
    if not _believable(shift, usual.const_shift):
        return usual.const_shift, _doubt(
            f"it gives {shift} as its constant shift, usually {usual.const_shift:g}", "shift"
        )
    return float(shift), None


def _believable(value: float, usual: float) -> bool:
    return isfinite(value) and usual / _BELIEVED_FACTOR <= value <= usual * _BELIEVED_FACTOR


def _doubt(why: str, what: str) -> str:
    return (
        f"the Kinect's own {what} cannot be right: {why}; the usual ones are used, so check a known distance and set "
        "area.size_mm if it is off"
    )
