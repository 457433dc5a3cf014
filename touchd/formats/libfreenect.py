"""Recordings of a Kinect v1 as libfreenect's recorder writes them and its "fakenect" plays them.

A folder with INDEX.txt, a file name a line: ``<type>-<host time in s>-<device ticks>.<ext>``. Depth is
``d-*.pgm``, raw 11-bit shift; device.json holds the camera's factory constants.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from touchd.errors import OutputError, RecordingError
from touchd.formats.device_json import read_device_json, write_device_json
from touchd.formats.folder import NS_PER_S, exact_ns, make_empty, reading, since_first, writing
from touchd.formats.pgm import GREATEST_SHIFT, PgmFile, inspect_pgm, read_shift, write_shift
from touchd.geometry import KINECT_SIZE, ZeroPlane, kinect_v1_sensor
from touchd.model import Frame, Sensor

INDEX_NAME = "INDEX.txt"
DEVICE_NAME = "device.json"
_FILE_NAME = re.compile(r"([a-z])-([0-9]{1,12})\.([0-9]{1,9})-([0-9]{1,10})\.([a-z0-9]{1,8})")
_TICKS_HZ = 60_000_000
_TICKS_WRAP = 2**32
_TICKS_PER_FRAME = 2_002_155  # 33.37 ms, as every pair of depth frames of a real recording lies apart


@dataclass(frozen=True, slots=True)
class _Entry:
    """A depth picture as a line of the index names it."""

    name: str
    line: int
    host_ns: int
    ticks: int


@dataclass(frozen=True, slots=True)
class LibfreenectRecording:
    """An opened recording; see :class:`touchd.formats.recording.Recording`."""

    path: Path
    sensor: Sensor
    notes: tuple[str, ...]
    times_ns: tuple[int, ...]
    pictures: tuple[PgmFile, ...]

    def __len__(self) -> int:
        return len(self.pictures)

    def read(self, index: int) -> Frame:
        """Return depth frame ``index``; IndexError beyond the last, RecordingError if its file is damaged."""
        if not 0 <= index < len(self):
            raise IndexError(index)
        return Frame(index, self.times_ns[index], read_shift(self.pictures[index]))


def open_libfreenect(folder: Path) -> LibfreenectRecording:
    """Open a recording and check all but the values of its pixels; RecordingError says what is wrong."""
    entries = _read_index(folder / INDEX_NAME)
    with reading(folder):
        present = {path.name for path in folder.iterdir()}
    files = [folder / entry.name for entry in entries]
    times_ns = since_first(files, [entry.host_ns for entry in entries])
    pictures = tuple(_inspect(folder, entry, present) for entry in entries)
    _check_sizes(pictures)
    notes = [*_notes_on_gaps(entries), *_notes_on_strays(present, entries)]
    if DEVICE_NAME in present:
        zero_plane = read_device_json(folder / DEVICE_NAME)
    else:
        zero_plane = ZeroPlane()
        notes.append(f"{DEVICE_NAME} is missing: the usual constants of a Kinect v1 are used")
    return LibfreenectRecording(folder, kinect_v1_sensor(zero_plane), tuple(notes), times_ns, pictures)


def _read_index(path: Path) -> list[_Entry]:
    with reading(path):
        data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise RecordingError(
            f"{path}, line {line}, holds the byte 0x{data[error.start]:02x}, which is no UTF-8: restore the line"
        ) from error
    lines = [line.removesuffix("\r") for line in text.split("\n")]
    parsed = [_read_line(path, i + 1, line) for i, line in enumerate(lines) if line]
    entries = [entry for entry in parsed if entry]
    if not entries:
        raise RecordingError(
            f"{path} names no depth frames (d-*.pgm) in its {len(parsed)} lines: record again with depth switched on"
        )
    return entries


def _read_line(path: Path, number: int, line: str) -> _Entry | None:
    """Return the depth picture that a line names; None for colour, acceleration and sound."""
    found = _FILE_NAME.fullmatch(line)
    if found is None:
        raise RecordingError(
            f"{path}, line {number}, reads {line[:60]!r} where a name such as "
            "d-1513096840.225792-2620551265.pgm is expected: correct the line or delete it"
        )
    kind, whole, fraction, ticks, extension = found.groups()
    if kind != "d":
        return None
    if extension != "pgm" or int(ticks) >= _TICKS_WRAP:
        why = "is no .pgm" if extension != "pgm" else f"has {ticks} device ticks, more than 32 bits hold"
        raise RecordingError(
            f"{path}, line {number}, names the depth frame {line}, which {why}: correct the line or delete it"
        )
    return _Entry(line, number, exact_ns(whole, fraction), int(ticks))


def _inspect(folder: Path, entry: _Entry, present: set[str]) -> PgmFile:
    if entry.name not in present:
        raise RecordingError(
            f"{folder / INDEX_NAME}, line {entry.line}, names {entry.name}, which is not in the folder: "
            "copy it there or delete the line"
        )
    return inspect_pgm(folder / entry.name)


def _check_sizes(pictures: Sequence[PgmFile]) -> None:
    first = pictures[0]
    for other in pictures:
        if other.size != first.size:
            raise RecordingError(
                f"{other.path} has {other.size[0]}x{other.size[1]} pixels but {first.path.name} has "
                f"{first.size[0]}x{first.size[1]}: all depth pictures of a recording must have one size"
            )
    if first.size != KINECT_SIZE:
        raise RecordingError(
            f"{first.path} has {first.size[0]}x{first.size[1]} pixels where a Kinect v1 has 640x480: record at 640x480"
        )


def _notes_on_gaps(entries: Sequence[_Entry]) -> list[str]:
    """Count lost frames by the device's clock, since the host's jitters by half a frame and more."""
    steps = [_frames_between(a, b) for a, b in pairwise(entries)]
    gaps = [step for step in steps if step > 1]
    stuck = sum(step < 1 for step in steps)
    notes = []
    if gaps:
        lost = sum(gaps) - len(gaps)
        notes.append(
            f"{_counted(len(gaps), 'gap')} in the camera's own clock: about {_counted(lost, 'frame')} "
            f"{'was' if lost == 1 else 'were'} lost while recording"
        )
    if stuck:
        notes.append(
            f"the camera's own clock stands still or runs backwards at {_counted(stuck, 'frame')}: "
            "what was lost there is not counted"
        )
    return notes


def _frames_between(a: _Entry, b: _Entry) -> int:
    """Return the frames from a to b by the device's clock; the host's tells its whole turns (71.6 s)."""
    host_ticks = (b.host_ns - a.host_ns) * _TICKS_HZ // NS_PER_S
    ticks = b.ticks - a.ticks
    turns = (2 * (host_ticks - ticks) + _TICKS_WRAP) // (2 * _TICKS_WRAP)
    elapsed = ticks + turns * _TICKS_WRAP
    return (2 * elapsed + _TICKS_PER_FRAME) // (2 * _TICKS_PER_FRAME)


def _notes_on_strays(present: set[str], entries: Sequence[_Entry]) -> list[str]:
    named = {entry.name for entry in entries}
    strays = sum(name.startswith("d-") and name.endswith(".pgm") for name in present - named)
    if not strays:
        return []
    return [f"{_counted(strays, 'depth picture')} in the folder but not in {INDEX_NAME} and so left out"]


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def write_libfreenect(
    folder: Path, frames: Iterable[Frame], zero_plane: ZeroPlane, start_s: int = 1_500_000_000
) -> int:
    """Write raw shift frames as a libfreenect recording into a new or empty folder and return how many.

    The first frame gets the host time ``start_s`` and 0 device ticks; the others follow by their own
    times, to a microsecond. INDEX.txt comes last, so that a broken-off writing is no recording.
    OutputError where the folder holds anything or cannot be written, and for frames that the format cannot
    hold: another size than 640x480, values above 2047, or times that do not rise by a microsecond.
    """
    make_empty(folder)
    with writing(folder / DEVICE_NAME):
        write_device_json(folder / DEVICE_NAME, zero_plane)
    names: list[str] = []
    first_ns, last_us = 0, -1
    for frame in frames:
        first_ns = first_ns if names else frame.t_ns
        since_us = (frame.t_ns - first_ns + 500) // 1000
        _check_writable(frame, since_us - last_us)
        seconds, micros = divmod(since_us, 1_000_000)
        ticks = since_us * (_TICKS_HZ // 1_000_000) % _TICKS_WRAP
        names.append(f"d-{start_s + seconds}.{micros:06d}-{ticks}.pgm")
        with writing(folder / names[-1]):
            write_shift(folder / names[-1], frame.raw)
        last_us = since_us
    with writing(folder / INDEX_NAME):
        (folder / INDEX_NAME).write_text("".join(f"{name}\n" for name in names), encoding="utf-8")
    return len(names)


def _check_writable(frame: Frame, rise_us: int) -> None:
    height, width = frame.raw.shape
    greatest = int(frame.raw.max(initial=0))
    if (width, height) != KINECT_SIZE:
        problem = f"has {width}x{height} pixels"
    elif greatest > GREATEST_SHIFT:
        problem = f"holds the value {greatest}"
    elif rise_us <= 0:
        problem = f"comes {rise_us} us after the one before it"
    else:
        return
    raise OutputError(
        f"Frame {frame.index} {problem}, but a libfreenect recording holds rising times and 640x480 raw "
        "values up to 2047: write PNG pictures instead"
    )
