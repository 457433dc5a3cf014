"""The depth pictures of a libfreenect recording: PGM, but with little-endian values."""

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchd.errors import RecordingError
from touchd.formats.folder import reading
from touchd.model import Image16, frozen_array

GREATEST_SHIFT = 2047  # 11 bits
_LONGEST_HEADER = 4096
# Netpbm's pgm(5): fields apart by whitespace or comments to the end of a line, then one whitespace character.
_APART = rb"(?:[ \t\n\v\f\r]|#[^\r\n]*[\r\n])+"
_FIELD = rb"([0-9]{1,9})"
_HEADER = re.compile(rb"P5" + _APART + _FIELD + _APART + _FIELD + _APART + _FIELD + rb"[ \t\n\v\f\r]")
_REMEDY = "copy the file again, or take its line out of INDEX.txt"


@dataclass(frozen=True, slots=True)
class PgmFile:
    """A PGM file whose header was read and fits its length; ``size`` is width, height in px."""

    path: Path
    size: tuple[int, int]
    offset: int  # of the first value, bytes


def inspect_pgm(path: Path) -> PgmFile:
    """Read the header of a 16-bit PGM file and hold the file's length against it.

    Raises RecordingError where the file cannot be read, is no such PGM, or is too short or too long.
    """
    with reading(path), path.open("rb") as file:
        start = file.read(_LONGEST_HEADER)
        length = os.fstat(file.fileno()).st_size
    if not start:
        raise RecordingError(f"{path} is empty where a depth picture is expected: {_REMEDY}")
    found = _HEADER.match(start)
    if found is None:
        raise RecordingError(
            f"{path} begins with {start[:16]!r} where a PGM header such as 'P5 640 480 65535' is expected: {_REMEDY}"
        )
    width, height, greatest = (int(field) for field in found.groups())
    if not GREATEST_SHIFT <= greatest <= 65535:
        raise RecordingError(
            f"{path} gives {greatest} as its greatest value where raw 11-bit depth has 2047 to 65535: "
            "record raw 11-bit depth"
        )
    expected = found.end() + 2 * width * height
    if length != expected:
        what = "cut short" if length < expected else "too long"
        raise RecordingError(
            f"{path} is {what}, with {length} bytes where its header {width}x{height} makes {expected}: {_REMEDY}"
        )
    return PgmFile(path, (width, height), found.end())


def read_shift(pgm: PgmFile) -> Image16:
    """Return a picture's raw shift, (H, W) uint16, read-only; RecordingError for any above 2047."""
    width, height = pgm.size
    with reading(pgm.path):
        values = np.fromfile(pgm.path, np.dtype("<u2"), width * height, offset=pgm.offset)
    if values.size != width * height:
        raise RecordingError(f"{pgm.path} was cut short after the recording was opened: {_REMEDY}")
    worst = int(values.max(initial=0))
    if worst > GREATEST_SHIFT:
        at = int(values.argmax())
        raise RecordingError(
            f"{pgm.path} holds {worst} in row {at // width}, column {at % width}, beyond the 2047 of raw "
            f"11-bit depth, so it is damaged or big-endian: {_REMEDY}"
        )
    return frozen_array(values.astype(np.uint16, copy=False).reshape(height, width))


def write_shift(path: Path, raw: Image16) -> None:
    """Write raw shift (H, W) as libfreenect's recorder does; OSError where that fails."""
    height, width = raw.shape
    path.write_bytes(f"P5 {width} {height} 65535\n".encode() + raw.astype("<u2").tobytes())
