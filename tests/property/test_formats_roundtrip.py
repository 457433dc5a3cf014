import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from touchd.errors import RecordingError
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.png import read_millimetres
from touchd.formats.png_folder import write_png_folder
from touchd.formats.recording import open_recording
from touchd.geometry import ZeroPlane
from touchd.model import Frame, Image16

times_us = st.lists(st.integers(0, 10**10), min_size=1, max_size=4, unique=True).map(sorted)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
KEYS = ("dcmos_emitter_distance", "reference_distance", "reference_pixel_size", "const_shift")


@dataclass(frozen=True)
class Harm:
    """One piece of damage; ``file`` and ``place`` are shares of the files and of the file's length."""

    kind: str
    file: float
    place: float
    bits: int

    def to(self, folder: Path) -> None:
        files = sorted(folder.iterdir())
        if not files:
            return
        path = files[int(self.file * len(files))]
        data = path.read_bytes()
        at = int(self.place * len(data))
        if self.kind == "delete file":
            path.unlink()
        elif self.kind == "truncate":
            path.write_bytes(data[:at])
        elif self.kind == "flip" and data:
            path.write_bytes(data[:at] + bytes([data[at] ^ self.bits]) + data[at + 1 :])
        elif self.kind == "delete line":
            lines = data.split(b"\n")
            del lines[int(self.place * len(lines))]
            path.write_bytes(b"\n".join(lines))


shares = st.floats(0, 1, exclude_max=True)
harms = st.lists(
    st.builds(
        Harm,
        st.sampled_from(["delete file", "truncate", "flip", "delete line"]),
        shares,
        shares,
        st.integers(1, 255),
    ),
    min_size=1,
    max_size=3,
)


@pytest.fixture(scope="module")
def intact() -> Iterator[Path]:
    """Two small recordings, in folders named shift and mm."""
    rng = np.random.default_rng(2)
    with tempfile.TemporaryDirectory() as folder:
        shifts = (Frame(i, i * 33_369_250, rng.integers(0, 2048, (480, 640), np.uint16)) for i in range(2))
        depths = (Frame(i, i * 33_369_250, rng.integers(0, 5000, (6, 8), np.uint16)) for i in range(4))
        write_libfreenect(Path(folder, "shift"), shifts, ZeroPlane())
        write_png_folder(Path(folder, "mm"), depths)
        yield Path(folder)


def pictures_by_time(folder: Path) -> dict[int, Image16]:
    recording = open_recording(folder)
    assert list(recording.times_ns) == sorted(set(recording.times_ns))
    return {recording.times_ns[i]: recording.read(i).raw for i in range(len(recording))}


def pictures_or_message(folder: Path) -> tuple[dict[int, Image16], str]:
    try:
        return pictures_by_time(folder), ""
    except RecordingError as error:
        return {}, str(error)


@given(times_us=times_us, seed=st.integers(0, 2**32 - 1), greatest=st.integers(0, 2047))
@settings(deadline=None, max_examples=25)
def test_any_shift_at_any_rising_times_comes_back_to_the_bit(times_us: list[int], seed: int, greatest: int) -> None:
    rng = np.random.default_rng(seed)
    frames = [
        Frame(i, us * 1000, rng.integers(0, greatest, (480, 640), np.uint16, endpoint=True))
        for i, us in enumerate(times_us)
    ]
    with tempfile.TemporaryDirectory() as folder:
        assert write_libfreenect(Path(folder), frames, ZeroPlane()) == len(frames)
        assert_same(frames, Path(folder))


@given(times_us=times_us, size=st.tuples(st.integers(1, 20), st.integers(1, 20)), data=st.data())
@settings(deadline=None, max_examples=100)
def test_any_millimetres_at_any_rising_times_come_back_to_the_bit(
    times_us: list[int], size: tuple[int, int], data: st.DataObject
) -> None:
    frames = [Frame(i, us * 1000, data.draw(arrays(np.uint16, size))) for i, us in enumerate(times_us)]
    with tempfile.TemporaryDirectory() as folder:
        assert write_png_folder(Path(folder), frames) == len(frames)
        assert_same(frames, Path(folder))


def assert_same(frames: list[Frame], folder: Path) -> None:
    recording = open_recording(folder)
    assert len(recording) == len(frames)
    for i, frame in enumerate(frames):
        copy = recording.read(i)
        assert (copy.index, copy.t_ns) == (i, frame.t_ns - frames[0].t_ns)
        assert np.array_equal(copy.raw, frame.raw)


@given(
    zero_plane=st.builds(ZeroPlane, st.floats(1, 70), st.floats(13, 1100), st.floats(0.011, 1.0), st.integers(21, 1900))
)
@settings(deadline=None, max_examples=25)
def test_any_plausible_camera_constants_come_back_and_make_a_sensor_whose_depth_rises(
    zero_plane: ZeroPlane,
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        write_libfreenect(Path(folder), [Frame(0, 0, np.zeros((480, 640), np.uint16))], zero_plane)
        to_mm = open_recording(Path(folder)).sensor.to_mm
    known = to_mm[np.isfinite(to_mm)]
    assert known.size
    assert (known > 0).all()
    assert (np.diff(known) >= 0).all()


@pytest.mark.parametrize("name", ["shift", "mm"])
@given(harms=harms)
@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_recording_is_a_recording_or_a_recording_error(intact: Path, name: str, harms: list[Harm]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        copy = copytree(intact / name, Path(folder, "copy"))
        for harm in harms:
            harm.to(copy)
        pictures, message = pictures_or_message(copy)
        assert len({picture.shape for picture in pictures.values()}) == 1 or str(copy) in message


@given(file=shares, place=shares, bits=st.integers(1, 255))
@settings(deadline=None, max_examples=300)
def test_a_flipped_byte_in_a_png_never_passes_for_other_depth(
    intact: Path, file: float, place: float, bits: int
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        copy = copytree(intact / "mm", Path(folder, "copy"))
        originals = sorted((intact / "mm").iterdir())
        Harm("flip", file, place, bits).to(copy)
        pictures, message = pictures_or_message(copy)
    if not message:
        for i, (_, picture) in enumerate(sorted(pictures.items())):
            assert np.array_equal(read_millimetres(originals[i], (8, 6)), picture)


@given(index=st.binary(max_size=200))
@example(index=b"\r\n\r\n")
@example(index="d-1.0-٣.pgm".encode())
@settings(deadline=None)
def test_an_index_of_any_bytes_is_a_recording_error(index: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "INDEX.txt").write_bytes(index)
        with pytest.raises(RecordingError):
            open_recording(Path(folder))


@given(values=st.fixed_dictionaries({}, optional=dict.fromkeys(KEYS, json_values)), whole=json_values)
@settings(deadline=None, max_examples=100)
def test_a_device_json_of_any_json_is_either_plausible_or_a_recording_error(
    intact: Path, values: dict[str, object], whole: object
) -> None:
    grouped = {"reg_info": {"zero_plane_info": values}, "const_shift": values.get("const_shift")}
    with tempfile.TemporaryDirectory() as folder:
        copy = copytree(intact / "shift", Path(folder, "copy"))
        for content in (whole, grouped):
            (copy / "device.json").write_text(json.dumps(content))
            pictures, message = pictures_or_message(copy)
            assert len(pictures) == 2 or message.startswith(str(copy / "device.json"))
