"""What outlives the process: the learned surface, and the last TUIO frame number.

A surface file is one line of JSON (what it is, of which camera, checksum) and a compressed numpy archive. Everything
is written to a temporary file, synced and renamed, so that a reader finds the old file or the new one, whole.
"""

import fcntl
import hashlib
import io
import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from touchd.errors import AlreadyRunning, StateError, StateNotKept
from touchd.model import AreaCorners, FollowedArea, Sensor, Surface, frozen_array

SURFACE_FILE = "surface.touchd"
FSEQ_FILE = "tuio-fseq"
LOCK_FILE = "lock"
_KIND = "touchd surface"
_VERSION = 1
_ARRAYS = {
    "reference": np.dtype(np.float32),
    "dmax": np.dtype(np.uint16),
    "noise": np.dtype(np.float32),
    "valid": np.dtype(np.bool_),
    "moved": np.dtype(np.bool_),
}


def state_folder(env: Mapping[str, str]) -> Path:
    """Return ``$STATE_DIRECTORY`` (systemd's), else touchd's folder in the XDG state folder."""
    if env.get("STATE_DIRECTORY"):
        return Path(env["STATE_DIRECTORY"].split(":")[0])
    base = env.get("XDG_STATE_HOME") or str(Path(env.get("HOME", "/")) / ".local" / "state")
    return Path(base) / "touchd"


def instance_of(state_folder: Path) -> str:
    """Return a short name that tells this daemon from others on the same host: one daemon has one state folder."""
    return hashlib.sha256(os.fsencode(state_folder.absolute())).hexdigest()[:4]


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all. Raises StateNotKept naming the path and the reason."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise _cannot_write(path, error) from error
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise _cannot_write(path, error) from error


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _cannot_write(path: Path, error: OSError) -> StateNotKept:
    return StateNotKept(f"{path}: cannot be written: {error.strerror}; check the folder's owner and free space")


def save_surface(path: Path, surface: Surface) -> None:
    """Store a surface. Raises StateNotKept if it cannot be written."""
    archive = io.BytesIO()
    np.savez_compressed(archive, **{name: getattr(surface, name) for name in _ARRAYS})
    payload = archive.getvalue()
    header = {
        "kind": _KIND,
        "version": _VERSION,
        "sha256": hashlib.sha256(payload).hexdigest(),
        "camera": camera_identity(surface.sensor),
        "frames": surface.frames,
        "made_from": surface.made_from,
    }
    if surface.followed is not None:
        header["followed"] = asdict(surface.followed)
    write_whole(path, json.dumps(header).encode() + b"\n" + payload)


def load_surface(path: Path, sensor: Sensor, made_from: str | None = None) -> Surface:
    """Return a stored surface of this sensor and, unless None, made from this source.

    Raises StateError, saying what is wrong, if the file is missing or damaged, or of another version or camera.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StateError(f"{path}: the surface file cannot be read: {error.strerror}; recalibrate") from error
    head, _, payload = content.partition(b"\n")
    header = _header(path, head)
    if hashlib.sha256(payload).hexdigest() != header.get("sha256"):
        raise StateError(f"{path}: the surface file is damaged (its checksum does not fit); recalibrate")
    difference = other_camera(header.get("camera"), sensor)
    if difference is not None:
        raise StateError(f"{path}: the surface was made with another camera ({difference}); recalibrate")
    if made_from is not None and header.get("made_from") != made_from:
        raise StateError(
            f"{path}: the surface was made from {header.get('made_from')}, not from {made_from}; recalibrate"
        )
    with np.load(io.BytesIO(payload), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in _ARRAYS if name in archive}
    width, height = sensor.size
    for name, dtype in _ARRAYS.items():
        if name not in arrays or arrays[name].shape != (height, width) or arrays[name].dtype != dtype:
            raise StateError(f"{path}: the surface file's {name!r} is missing or misshapen; recalibrate")
    return Surface(
        sensor=sensor,
        reference=frozen_array(arrays["reference"]),
        dmax=frozen_array(arrays["dmax"]),
        noise=frozen_array(arrays["noise"]),
        valid=frozen_array(arrays["valid"]),
        moved=frozen_array(arrays["moved"]),
        frames=int(header["frames"]),
        made_from=str(header["made_from"]),
        followed=_followed(path, header.get("followed")),
    )


def _followed(path: Path, stored: Any) -> FollowedArea | None:
    if stored is None:
        return None
    try:
        area = None if stored["area"] is None else _corners(stored["area"])
        return FollowedArea(area, _corners(stored["corners"]))
    except (TypeError, KeyError, ValueError):
        raise StateError(f"{path}: the surface file's 'followed' is missing a part or misshapen; recalibrate") from None


def _corners(stored: Any) -> AreaCorners:
    a, b, c, d = ((float(u), float(v)) for u, v in stored["corners_px"])
    size_mm = stored["size_mm"]
    return AreaCorners((a, b, c, d), None if size_mm is None else (float(size_mm[0]), float(size_mm[1])))


def camera_of_surface(path: Path) -> str | None:
    """Return the serial of the camera that a stored surface was made with; None where no file tells one.

    What was made from a recording or a rendered table was made with none.
    """
    try:
        with path.open("rb") as file:
            header = _header(path, file.readline().rstrip(b"\n"))
    except (OSError, StateError):
        return None
    camera = header.get("camera")
    serial = camera.get("serial") if isinstance(camera, dict) else None
    named = isinstance(serial, str) and serial and str(header.get("made_from")).endswith(serial)
    return serial if named else None


def _header(path: Path, head: bytes) -> dict[str, Any]:
    try:
        header = json.loads(head)
    except ValueError:
        header = None
    if not isinstance(header, dict) or header.get("kind") != _KIND:
        raise StateError(f"{path}: this is no surface file of touchd; name another one or recalibrate")
    if header.get("version") != _VERSION:
        raise StateError(
            f"{path}: the surface file has version {header.get('version')}, this touchd reads version {_VERSION}; "
            "recalibrate"
        )
    return header


def camera_identity(sensor: Sensor) -> dict[str, Any]:
    """Return what must be the same, as JSON, for a surface or an alignment to fit a camera."""
    table = hashlib.sha256(sensor.to_mm.tobytes()).hexdigest()[:16]
    return {
        "kind": sensor.kind,
        "serial": sensor.serial,
        "size": list(sensor.size),
        "depth table": table,
        "lens": asdict(sensor.intrinsics),
    }


def other_camera(stored: object, sensor: Sensor) -> str | None:
    """Return in words how a stored :func:`camera_identity` differs from this sensor's, None if it is the same."""
    present = camera_identity(sensor)
    if stored == present:
        return None
    was = stored if isinstance(stored, dict) else {}
    return "; ".join(
        f"{key} {was.get(key)} there, {value} here" for key, value in present.items() if was.get(key) != value
    )


class Lock:
    """Keeps a state folder to one daemon. Held until the process ends, however it ends."""

    def __init__(self, folder: Path) -> None:
        """Take the lock. Raises AlreadyRunning if another process holds it, StateNotKept if it cannot be made."""
        path = folder / LOCK_FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = path.open("a")
        except OSError as error:
            raise _cannot_write(path, error) from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self._file.close()
            raise AlreadyRunning(
                f"{folder}: another touchd uses this state folder; stop it, or give this one its own with "
                "STATE_DIRECTORY"
            ) from error

    def release(self) -> None:
        """Let the folder go."""
        self._file.close()


class FseqStore:
    """Keeps TUIO's frame number from falling when the daemon restarts, even under a clock that was set back.

    A number well ahead of the last one used is kept, so that a killed daemon leaves a good one too.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> int:
        """Return the stored number, 0 if there is none that can be read."""
        try:
            return max(0, int(self._path.read_text("ascii")))
        except (OSError, ValueError):
            return 0

    def keep(self, fseq: int) -> None:
        """Store a number. Raises StateNotKept if it cannot be written."""
        write_whole(self._path, f"{fseq}\n".encode("ascii"))
