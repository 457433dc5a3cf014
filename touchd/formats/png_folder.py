"""Recordings as a folder of 16-bit grey PNG pictures: depth in millimetres, 0 for no reading."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from touchd.errors import OutputError, RecordingError
from touchd.formats.folder import NS_PER_S, exact_ns, make_empty, reading, since_first, writing
from touchd.formats.png import inspect_png, read_millimetres, write_millimetres
from touchd.formats.resolution import UNKNOWN_NOISE_MM, measure_noise_mm, measure_step_mm
from touchd.geometry import millimetre_sensor
from touchd.model import Frame, Intrinsics, Sensor

_FRAMES_PER_S = 30
_MEASURED_FRAMES = 5
_TIME = re.compile(r"([0-9]{1,12})\.([0-9]+)")
_KINECT_FOCAL_PER_WIDTH = 575.8 / 640


@dataclass(frozen=True, slots=True)
class PngRecording:
    """An opened recording; see :class:`touchd.formats.recording.Recording`."""

    path: Path
    sensor: Sensor
    notes: tuple[str, ...]
    times_ns: tuple[int, ...]
    files: tuple[Path, ...]

    def __len__(self) -> int:
        return len(self.files)

    def read(self, index: int) -> Frame:
        """Return picture ``index``; IndexError beyond the last, RecordingError where its file is damaged."""
        if not 0 <= index < len(self):
            raise IndexError(index)
        return Frame(index, self.times_ns[index], read_millimetres(self.files[index], self.sensor.size))


def is_picture(name: str) -> bool:
    """Tell whether a file name is a PNG picture's and not a hidden file's, as other systems leave them."""
    return name.lower().endswith(".png") and not name.startswith(".")


def open_png_folder(folder: Path) -> PngRecording:
    """Open a recording, check all of it but the values of its pixels, and measure its step and noise.

    Names such as 1305031102.160407.png tell the time in seconds; other pictures count as 30 a second in the
    natural order of their names. RecordingError says what is wrong.
    """
    with reading(folder):
        files = sorted((p for p in folder.iterdir() if is_picture(p.name)), key=_natural)
    if not files:
        raise RecordingError(f"{folder} holds no *.png: name a folder of 16-bit PNG pictures")
    files, times_ns, notes = _with_times(files)
    size = _check_sizes(files)
    pictures = [read_millimetres(path, size) for path in files[:_MEASURED_FRAMES]]
    step_mm = measure_step_mm(pictures)
    noise_mm = measure_noise_mm(pictures, step_mm)
    if noise_mm is None:
        noise_mm = UNKNOWN_NOISE_MM
        notes.append(f"the first pictures do not tell the camera's noise: {noise_mm:g} mm is assumed")
    sensor = millimetre_sensor("depth-mm", size, _usual_intrinsics(size), noise_mm, step_mm)
    return PngRecording(folder, sensor, tuple(notes), times_ns, tuple(files))


def _natural(path: Path) -> tuple[list[tuple[int, str]], str]:
    parts = re.split(r"([0-9]+)", path.name.lower())
    return [(int(part), "") if i % 2 else (0, part) for i, part in enumerate(parts)], path.name


def _with_times(files: Sequence[Path]) -> tuple[list[Path], tuple[int, ...], list[str]]:
    """Return the files in the order of their times, the times in ns since the first, and notes about them."""
    found = {path: _TIME.fullmatch(path.stem) for path in files}
    clock_ns = {path: exact_ns(match[1], match[2]) for path, match in found.items() if match}
    if not clock_ns:
        times_ns = tuple((i * NS_PER_S + _FRAMES_PER_S // 2) // _FRAMES_PER_S for i in range(len(files)))
        note = f"the file names tell no times: {_FRAMES_PER_S} frames a second are assumed"
        return list(files), times_ns, [note]
    for path in files:
        if path not in clock_ns:
            raise RecordingError(
                f"{path} is named by no time but {next(iter(clock_ns)).name} is: name all pictures by "
                "their time in seconds, or none"
            )
    ordered = sorted(files, key=clock_ns.__getitem__)
    return ordered, since_first(ordered, [clock_ns[path] for path in ordered]), []


def _check_sizes(files: Sequence[Path]) -> tuple[int, int]:
    first = inspect_png(files[0])
    for path in files[1:]:
        size = inspect_png(path)
        if size != first:
            raise RecordingError(
                f"{path} has {size[0]}x{size[1]} pixels but {files[0].name} has {first[0]}x{first[1]}: all "
                "pictures of a recording must have one size"
            )
    return first


def _usual_intrinsics(size: tuple[int, int]) -> Intrinsics:
    """Return a Kinect v1's focal length scaled to the width, centred: what a picture does not tell itself."""
    width, height = size
    focal_px = _KINECT_FOCAL_PER_WIDTH * width
    return Intrinsics(focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0)


def write_png_folder(folder: Path, frames: Iterable[Frame]) -> int:
    """Write frames in mm (0: no reading) as PNG pictures into a new or empty folder and return how many.

    The names tell the times since the first frame to a nanosecond. OutputError where the folder holds
    anything or cannot be written, where the frames differ in size, and where their times do not rise.
    """
    make_empty(folder)
    first: Frame | None = None
    last_ns, count = -1, 0
    for frame in frames:
        first = first or frame
        since_ns = frame.t_ns - first.t_ns
        _check_writable(frame, first, since_ns - last_ns)
        seconds, below_ns = divmod(since_ns, NS_PER_S)
        path = folder / f"{seconds:06d}.{below_ns:09d}.png"
        with writing(path):
            write_millimetres(path, frame.raw)
        last_ns, count = since_ns, count + 1
    return count


def _check_writable(frame: Frame, first: Frame, rise_ns: int) -> None:
    (height, width), (first_height, first_width) = frame.raw.shape, first.raw.shape
    if frame.raw.shape != first.raw.shape:
        problem = f"has {width}x{height} pixels after {first_width}x{first_height} before"
    elif rise_ns <= 0:
        problem = f"comes {rise_ns} ns after the one before it"
    else:
        return
    raise OutputError(
        f"Frame {frame.index} {problem}, but a PNG recording holds rising times and one size: write such "
        "frames into another folder"
    )
