import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from touchd.errors import OutputError, RecordingError
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.png_folder import write_png_folder
from touchd.geometry import ZeroPlane
from touchd.model import Frame

from recording_damage import error_on_opening, frames

Writer = Callable[[Path], int]
WRITERS: list[Writer] = [
    lambda folder: write_libfreenect(folder, frames(640, 480), ZeroPlane()),
    lambda folder: write_png_folder(folder, frames(640, 480)),
]


@contextmanager
def files_limited_to(size: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def error_on_writing(writer: Writer, folder: Path) -> str:
    with pytest.raises(OutputError) as caught:
        writer(folder)
    assert caught.value.exit_code == 73
    return str(caught.value)


@pytest.mark.parametrize("writer", WRITERS)
def test_a_folder_that_holds_anything_is_not_written_to(tmp_path: Path, writer: Writer) -> None:
    (tmp_path / "letter.txt").write_text("mine")
    assert error_on_writing(writer, tmp_path) == (
        f"{tmp_path} is not empty, it holds letter.txt: name a new or an empty folder"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


@pytest.mark.parametrize("writer", WRITERS)
def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path, writer: Writer) -> None:
    (tmp_path / "file").touch()
    folder = tmp_path / "file" / "rec"
    assert error_on_writing(writer, folder).startswith(
        f"{folder} cannot be written: Not a directory; name a folder on a disk with room that you may write"
    )


@pytest.mark.parametrize("writer", WRITERS)
def test_a_disk_without_room_leaves_nothing_that_passes_for_a_recording(tmp_path: Path, writer: Writer) -> None:
    with files_limited_to(1000):
        message = error_on_writing(writer, tmp_path / "rec")
    assert "cannot be written: File too large; name a folder on a disk with room" in message
    error_on_opening(tmp_path / "rec")


def test_an_error_of_the_frames_themselves_passes_through_the_writers(tmp_path: Path) -> None:
    def breaking() -> Iterator[Frame]:
        yield frames(640, 480)[0]
        raise RecordingError("the source of the frames broke")

    with pytest.raises(RecordingError, match="the source of the frames broke"):
        write_libfreenect(tmp_path / "shift", breaking(), ZeroPlane())
    with pytest.raises(RecordingError, match="the source of the frames broke"):
        write_png_folder(tmp_path / "mm", breaking())
    assert not (tmp_path / "shift" / "INDEX.txt").exists()
