"""A scene's frames, kept in a folder: rendering takes most of a run, and the next method sees the same ones.

A file holds a line that says what it was rendered from, and then for each frame a head, and the zigzag of what each
pixel differs from the frame before, low bytes and high bytes apart, deflated: some 65 kB a frame.
"""

import hashlib
import json
import os
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import BinaryIO

import numpy as np

import touchd
from touchd.errors import RecordingError
from touchd.formats.folder import reading, writing
from touchd.lab.scenes import LabScene
from touchd.model import Frame, Image16

# index, t_ns, missing packets, acceleration (NaN: none), rows and columns, sizes of the two parts
_HEAD = struct.Struct("<qqI3dHHII")
_DRAWN_BY = ("table", "lab/scenes", "geometry.py")  # the code that a frame depends on
_DRAWN_WITH = ("numpy", "opencv-python-headless")


def played(scene: LabScene, folder: Path | None) -> Iterator[Frame]:
    """Yield all frames of a scene, calibration's first; with a folder from there, or rendered and put there.

    What another renderer left there is rendered anew. Raises OutputError, and RecordingError for a damaged file.
    """
    if folder is None:
        yield from _rendered(scene)
        return
    path = folder / f"{scene.name}-{scene.height_mm:g}-{scene.seed}.frames"
    made_from = _made_from(scene)
    if _is_of(path, made_from):
        yield from _read(path)
    else:
        yield from _written(path, made_from, _rendered(scene))


def _rendered(scene: LabScene) -> Iterator[Frame]:
    for index in range(scene.calibration_frames + scene.frames):
        yield scene.frame(index)


def _made_from(scene: LabScene) -> bytes:
    """Return a line that differs wherever the frames may."""
    about = {
        "scene": [scene.name, scene.height_mm, scene.seed, scene.calibration_frames, scene.frames],
        "code": _digest(),
        "with": [version(name) for name in _DRAWN_WITH],
    }
    return json.dumps(about).encode() + b"\n"


def _digest() -> str:
    package = Path(touchd.__file__).parent
    found = hashlib.sha256()
    for part in _DRAWN_BY:
        place = package / part
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            found.update(path.read_bytes())
    return found.hexdigest()


def _is_of(path: Path, made_from: bytes) -> bool:
    if not path.exists():
        return False
    with reading(path), path.open("rb") as file:
        return file.readline() == made_from


def _read(path: Path) -> Iterator[Frame]:
    with reading(path), path.open("rb") as file:
        file.readline()
        before: Image16 | None = None
        while head := file.read(_HEAD.size):
            try:
                frame = _unpacked(head, file, before)
            except (struct.error, zlib.error, ValueError) as error:
                raise RecordingError(f"{path} is damaged ({error}): delete it, and it is rendered anew") from error
            before = frame.raw
            yield frame


def _written(path: Path, made_from: bytes, frames: Iterator[Frame]) -> Iterator[Frame]:
    """Pass frames on and write them down; what was not written to its end is taken away."""
    unfinished = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            file = unfinished.open("wb")
        with file:
            with writing(path):
                file.write(made_from)
            before: Image16 | None = None
            for frame in frames:
                with writing(path):
                    file.write(_packed(frame, before))
                before = frame.raw
                yield frame
        with writing(path):
            unfinished.replace(path)
    finally:
        with suppress(OSError):
            unfinished.unlink()


def _packed(frame: Frame, before: Image16 | None) -> bytes:
    differs = frame.raw if before is None else frame.raw - before
    signed = differs.view(np.int16)
    zigzag = ((signed << 1) ^ (signed >> 15)).view(np.uint16)
    low, high = (_deflated(part.astype(np.uint8)) for part in (zigzag & 0xFF, zigzag >> 8))
    pull = (float("nan"),) * 3 if frame.accel_g is None else frame.accel_g
    head = _HEAD.pack(frame.index, frame.t_ns, frame.missing_packets, *pull, *frame.raw.shape, len(low), len(high))
    return head + low + high


def _unpacked(head: bytes, file: BinaryIO, before: Image16 | None) -> Frame:
    index, t_ns, missing_packets, *pull, rows, columns, low_size, high_size = _HEAD.unpack(head)
    low, high = (_inflated(file.read(size)).astype(np.uint16) for size in (low_size, high_size))
    zigzag = low | (high << 8)
    differs = np.asarray((zigzag >> 1) ^ -(zigzag & 1), np.uint16).reshape(rows, columns)
    accel_g = None if np.isnan(pull[0]) else (pull[0], pull[1], pull[2])
    return Frame(index, t_ns, differs if before is None else before + differs, missing_packets, accel_g)


def _deflated(pixels: np.ndarray) -> bytes:
    """Return bytes in as few bits each as their frequencies allow; noise has no repetitions to look for."""
    press = zlib.compressobj(1, zlib.DEFLATED, -zlib.MAX_WBITS, strategy=zlib.Z_HUFFMAN_ONLY)
    return press.compress(pixels.tobytes()) + press.flush()


def _inflated(packed: bytes) -> np.ndarray:
    return np.frombuffer(zlib.decompress(packed, -zlib.MAX_WBITS), np.uint8)
