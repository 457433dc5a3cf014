"""What the formats share: exact times from file names, and file errors turned into sentences."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from touchd.errors import OutputError, RecordingError

NS_PER_S = 1_000_000_000


def exact_ns(whole: str, fraction: str) -> int:
    """Return the nanoseconds of a decimal number of seconds, given as its digits before and after the point.

    Exact for up to nine decimals; what lies below a nanosecond is cut off.
    """
    return int(whole) * NS_PER_S + int(fraction[:9].ljust(9, "0"))


def since_first(files: Sequence[Path], clock_ns: Sequence[int]) -> tuple[int, ...]:
    """Return the times in ns since the first file's; RecordingError where they do not rise strictly."""
    for i in range(1, len(files)):
        back_ns = clock_ns[i - 1] - clock_ns[i]
        if back_ns >= 0:
            how = f"{back_ns / 1e6:g} ms before" if back_ns else "at the same time as"
            raise RecordingError(
                f"{files[i]} lies {how} {files[i - 1].name}, the picture that precedes it, but times must "
                "rise: take one of the two out or correct its name"
            )
    return tuple(t - clock_ns[0] for t in clock_ns)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn an OSError met while reading ``path`` into a RecordingError."""
    try:
        yield
    except OSError as error:
        raise RecordingError(
            f"{path} cannot be read: {error.strerror or error}; check its permissions and its disk"
        ) from error


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an OSError met while writing ``path`` into an OutputError."""
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"{path} cannot be written: {error.strerror or error}; name a folder on a disk with room that "
            "you may write to"
        ) from error


def make_empty(folder: Path) -> None:
    """Make ``folder`` unless it is there; OutputError where it cannot be made or holds anything."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        found = next(folder.iterdir(), None)
    if found is not None:
        raise OutputError(f"{folder} is not empty, it holds {found.name}: name a new or an empty folder")
