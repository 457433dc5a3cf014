"""The depth pictures of a PNG folder: 16-bit grey, in millimetres."""

import os
import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.errors import RecordingError
from touchd.formats.folder import reading
from touchd.model import Image16, frozen_array

# PNG (ISO/IEC 15948): the signature and the IHDR chunk come first, an empty IEND chunk last.
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_BEGIN = _SIGNATURE + b"\x00\x00\x00\x0dIHDR"
_END = b"\x00\x00\x00\x00IEND\xae\x42\x60\x82"
_HEADER_LENGTH = 33
_COLOUR_TYPES = {0: "grey", 2: "RGB", 3: "palette", 4: "grey and alpha", 6: "RGB and alpha"}
_REMEDY = "copy it again or take it out"


def inspect_png(path: Path) -> tuple[int, int]:
    """Return a picture's width and height in px, from its header.

    Raises RecordingError where the file cannot be read, does not begin and end as a PNG, or is not 16-bit
    grey.
    """
    with reading(path), path.open("rb") as file:
        start = file.read(_HEADER_LENGTH)
        file.seek(max(0, os.fstat(file.fileno()).st_size - len(_END)))
        end = file.read()
    if not start:
        raise RecordingError(f"{path} is empty where a depth picture is expected: {_REMEDY}")
    damaged = len(start) < _HEADER_LENGTH or struct.unpack(">I", start[29:33])[0] != zlib.crc32(start[12:29])
    if not start.startswith(_BEGIN) or damaged:
        raise RecordingError(f"{path} begins with {start[:8]!r} and no whole PNG header: {_REMEDY}")
    width, height, depth, colour = struct.unpack(">IIBB", start[16:26])
    if (depth, colour) != (16, 0):
        kind = _COLOUR_TYPES.get(colour, f"colour type {colour}")
        raise RecordingError(
            f"{path} is a PNG with {depth} bits of {kind} where 16 bits of grey are expected: save depth "
            "in mm as a 16-bit single-channel PNG"
        )
    if end != _END:
        raise RecordingError(
            f"{path} ends with {end[-12:]!r} where a PNG ends with its IEND chunk, so it is cut short or "
            f"something was appended: {_REMEDY}"
        )
    return width, height


def read_millimetres(path: Path, size: tuple[int, int]) -> Image16:
    """Return a picture's depth in mm, (H, W) uint16, read-only; ``size`` is the expected width, height in px.

    Raises RecordingError where the file cannot be read or does not decode to that.
    """
    with reading(path):
        data = path.read_bytes()
    # The decoder sets gigabytes aside for a damaged chunk's length, so it is given whole chunks alone.
    picture = _decode(data) if _has_whole_chunks(data) else None
    if picture is None or picture.dtype != np.uint16 or picture.shape != size[::-1]:
        raise RecordingError(
            f"{path} does not decode to {size[0]}x{size[1]} pixels of 16 bits, so it is damaged: {_REMEDY}"
        )
    return frozen_array(np.asarray(picture, np.uint16))


def _has_whole_chunks(data: bytes) -> bool:
    """Tell whether every chunk lies within the data and has the checksum that it carries."""
    at = len(_SIGNATURE)
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        end = at + 12 + length
        if end > len(data) or zlib.crc32(data[at + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
            return False
        at = end
    return at == len(data)


def _decode(data: bytes) -> NDArray[Any] | None:
    try:
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        return None


def write_millimetres(path: Path, raw: Image16) -> None:
    """Write depth in mm (H, W) as a 16-bit grey PNG; OSError where that fails."""
    path.write_bytes(cv2.imencode(".png", raw)[1].tobytes())
