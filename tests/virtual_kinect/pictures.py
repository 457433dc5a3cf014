"""What the virtual Kinect shows: a recording, the synthetic table or given arrays, as the model wants its pictures."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from touchd.formats.recording import open_recording
from touchd.model import Image16
from touchd.table.scene import Hand, TableCamera
from touchd.table.table import Table

from virtual_kinect.stream import HEIGHT, PICTURE_BYTES, WIDTH

_NEVER_READ_COLUMNS = 8
_NO_READING = 2047


def picture_of(raw: NDArray[np.integer]) -> bytes:
    """Return raw shift (480, 640) as little-endian uint16; ValueError for what no Kinect has."""
    if raw.shape != (HEIGHT, WIDTH) or int(raw.min()) < 0 or int(raw.max()) > _NO_READING:
        raise ValueError(
            f"A Kinect's depth picture has 480x640 values from 0 to 2047, this one is {raw.shape} with values from "
            f"{raw.min()} to {raw.max()}: play raw shift"
        )
    return raw.astype("<u2").tobytes()


def array_of(picture: bytes) -> Image16:
    """Return a picture of the model as raw shift (480, 640)."""
    return np.frombuffer(picture, "<u2").reshape(HEIGHT, WIDTH).astype(np.uint16)


def recorded_pictures(path: Path, frames: range | None = None) -> list[bytes]:
    """Return the frames of a recording of a Kinect, all or those of ``frames``."""
    recording = open_recording(path)
    return [picture_of(recording.read(index).raw) for index in frames or range(len(recording))]


def table_pictures(camera: TableCamera, seed: int, hands: Sequence[Sequence[Hand]]) -> list[bytes]:
    """Return a frame of the synthetic table, noise and all, for each set of hands over it."""
    table = Table(camera, seed)
    return [picture_of(table.render(over, index * 33_000_000, index).raw) for index, over in enumerate(hands)]


def gradient_pictures(count: int) -> list[bytes]:
    """Return ``count`` different pictures in which every value occurs and the last 8 columns have no reading."""
    ramp = np.arange(HEIGHT * WIDTH).reshape(HEIGHT, WIDTH)
    pictures = []
    for index in range(count):
        raw = (ramp * 7 + index * 131) % (_NO_READING + 1)
        raw[:, -_NEVER_READ_COLUMNS:] = _NO_READING
        pictures.append(picture_of(raw))
    return pictures


def write_pictures(path: Path, pictures: Iterable[bytes]) -> None:
    """Write pictures to a file, one after the other, for a process without numpy; see ``PictureFile``."""
    with path.open("wb") as file:
        for picture in pictures:
            assert len(picture) == PICTURE_BYTES
            file.write(picture)
