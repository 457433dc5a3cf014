import re
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from touchd.errors import RecordingError
from touchd.formats.png_folder import write_png_folder
from touchd.formats.recording import open_recording
from touchd.model import Frame

from recording_damage import Damage, append, cut, error_on_opening, frames, link_to_itself, make_folder, write

PNG_FIRST = "000000.000000000.png"
PNG_SECOND = "000000.033369250.png"


@pytest.fixture
def png_folder(tmp_path: Path) -> Path:
    write_png_folder(tmp_path / "rec", frames(8, 6))
    return tmp_path / "rec"


def picture(name: str, values: object, dtype: type[np.generic]) -> Damage:
    data = cv2.imencode(".png", np.asarray(values, dtype))[1].tobytes()
    return lambda folder: (folder / name).write_bytes(data)


@pytest.mark.parametrize(
    ("damage", "where", "problem"),
    [
        (
            picture(PNG_SECOND, np.zeros((6, 8)), np.uint8),
            PNG_SECOND,
            "is a PNG with 8 bits of grey where 16 bits of grey are expected: save depth in mm as a 16-bit",
        ),
        (
            picture(PNG_SECOND, np.zeros((6, 8, 3)), np.uint8),
            PNG_SECOND,
            "is a PNG with 8 bits of RGB where 16 bits of grey are expected: save depth in mm as a 16-bit",
        ),
        (
            picture(PNG_SECOND, np.zeros((6, 8, 3)), np.uint16),
            PNG_SECOND,
            "is a PNG with 16 bits of RGB where 16 bits of grey are expected",
        ),
        (
            picture(PNG_SECOND, np.zeros((6, 9)), np.uint16),
            PNG_SECOND,
            f"has 9x6 pixels but {PNG_FIRST} has 8x6: all pictures of a recording must have one size",
        ),
        (cut(PNG_SECOND, 0), PNG_SECOND, "is empty where a depth picture is expected: copy it again or take"),
        (
            cut(PNG_SECOND, 20),
            PNG_SECOND,
            "begins with b'\\x89PNG\\r\\n\\x1a\\n' and no whole PNG header: copy",
        ),
        (
            cut(PNG_SECOND, 60),
            PNG_SECOND,
            "its IEND chunk, so it is cut short or something was appended: copy it again or take it out",
        ),
        (
            append(PNG_SECOND, b"more"),
            PNG_SECOND,
            "ends with b'IEND\\xaeB`\\x82more' where a PNG ends with its IEND chunk, so it is cut short",
        ),
        (write(PNG_SECOND, b"GIF89a" * 10), PNG_SECOND, "begins with b'GIF89aGI' and no whole PNG header"),
        (
            make_folder(PNG_SECOND),
            PNG_SECOND,
            "cannot be read: Is a directory; check its permissions and its",
        ),
        (link_to_itself(PNG_SECOND), PNG_SECOND, "cannot be read: Too many levels of symbolic links; check"),
        (
            picture("depth3.png", np.zeros((6, 8)), np.uint16),
            "depth3.png",
            f"is named by no time but {PNG_FIRST} is: name all pictures by their time in seconds, or none",
        ),
        (
            picture("0.00.png", np.zeros((6, 8)), np.uint16),
            PNG_FIRST,
            "lies at the same time as 0.00.png, the picture that precedes it, but times must rise",
        ),
    ],
)
def test_a_damaged_png_recording_is_refused_before_its_first_frame(
    png_folder: Path, damage: Damage, where: str, problem: str
) -> None:
    damage(png_folder)
    message = error_on_opening(png_folder)
    assert message.startswith(str(png_folder / where))
    assert problem in message


def test_a_png_whose_pixels_do_not_decode_is_an_error_when_it_is_read(tmp_path: Path) -> None:
    late = [Frame(i, i * 33_369_250, np.full((6, 8), 700, np.uint16)) for i in range(6)]
    write_png_folder(tmp_path / "rec", late)
    path = sorted((tmp_path / "rec").iterdir())[5]
    data = bytearray(path.read_bytes())
    data[-20] ^= 0xFF
    path.write_bytes(data)
    recording = open_recording(tmp_path / "rec")
    assert recording.read(4).raw[0, 0] == 700
    expected = f"{path} does not decode to 8x6 pixels of 16 bits, so it is damaged: copy it again or take it out"
    with pytest.raises(RecordingError, match=f"^{re.escape(expected)}$"):
        recording.read(5)


def test_the_decoder_never_sees_a_chunk_of_damaged_length_nor_prints_about_it(
    png_folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    data = bytearray((png_folder / PNG_SECOND).read_bytes())
    assert data[37:41] == b"IDAT"
    data[33] ^= 0x80
    (png_folder / PNG_SECOND).write_bytes(data)
    assert "does not decode to 8x6 pixels of 16 bits, so it is damaged" in error_on_opening(png_folder)
    assert capfd.readouterr() == ("", "")


def test_a_png_header_that_asks_for_more_pixels_than_any_camera_has_is_damage(png_folder: Path) -> None:
    for name in (PNG_FIRST, PNG_SECOND):
        write(name, huge_png((png_folder / name).read_bytes()))(png_folder)
    assert "does not decode to 70000x70000 pixels of 16 bits" in error_on_opening(png_folder)


def huge_png(data: bytes) -> bytes:
    header = b"IHDR" + (70_000).to_bytes(4, "big") * 2 + data[24:29]
    return data[:12] + header + zlib.crc32(header).to_bytes(4, "big") + data[33:]
