"""A depth recording on disk, whatever its format."""

from pathlib import Path
from typing import Protocol

from touchd.errors import RecordingError
from touchd.formats.folder import reading
from touchd.formats.libfreenect import INDEX_NAME, open_libfreenect
from touchd.formats.png_folder import is_picture, open_png_folder
from touchd.model import Frame, Sensor

_READ = f"touchd reads folders with {INDEX_NAME} and d-*.pgm (libfreenect), and folders of 16-bit *.png in mm"


class Recording(Protocol):
    """A recording whose files were checked when it was opened; frames are read one by one when asked for."""

    @property
    def path(self) -> Path:
        """Its folder."""

    @property
    def sensor(self) -> Sensor:
        """The camera that it was made with, as far as the recording tells."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences for the user about what was assumed or found odd."""

    @property
    def times_ns(self) -> tuple[int, ...]:
        """The time of every depth frame in ns, strictly rising from 0."""

    def __len__(self) -> int:
        """Return how many depth frames there are, at least one."""

    def read(self, index: int) -> Frame:
        """Return depth frame ``index`` from 0 on, its picture read-only; RecordingError if damaged."""


def open_recording(path: Path) -> Recording:
    """Open the recording in the folder ``path``, in the format that its content shows.

    Raises RecordingError for a path that is no recording and for any damage that shows without reading all
    pixels.
    """
    names = _names_in(path)
    if INDEX_NAME in names:
        return open_libfreenect(path)
    if any(is_picture(name) for name in names):
        return open_png_folder(path)
    found = "nothing" if not names else ", ".join(names[:3]) + (f" and {len(names) - 3} more" if names[3:] else "")
    raise RecordingError(f"{path} holds neither {INDEX_NAME} nor *.png but {found}: {_READ}")


def _names_in(path: Path) -> list[str]:
    with reading(path):
        try:
            return sorted(entry.name for entry in path.iterdir())
        except FileNotFoundError as error:
            raise RecordingError(f"{path} does not exist: check the path of the recording") from error
        except NotADirectoryError as error:
            raise RecordingError(
                f"{path} is a file, but a recording is a folder: unpack it first if it is an archive, or "
                f"name the folder it lies in; {_READ}"
            ) from error
