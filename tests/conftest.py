"""Fixtures that tests of every kind share."""

import os
import signal
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

# The recordings are too big for the repository and lie beside it.
_RECORDINGS = Path(__file__).parents[1] / ".." / "shared" / "recordings"

# A shell's background jobs ignore this signal, and so would the programs that tests start and interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def desk_recording() -> Iterator[Path]:
    """A real Kinect v1's recording of a desk: 80 depth frames."""
    with tempfile.TemporaryDirectory() as folder:
        yield _unpack("kinect-v1-desk", Path(folder))


@pytest.fixture(scope="session")
def table_recording() -> Iterator[Path]:
    """A rendered recording of a table and a hand, with its truth: 207 depth frames."""
    with tempfile.TemporaryDirectory() as folder:
        yield _unpack("example-table", Path(folder))


def _unpack(name: str, folder: Path) -> Path:
    archive = _RECORDINGS / f"{name}.tar.xz"
    if not archive.exists():
        message = f"the recording {archive} is absent: put it there to run the tests that need it"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)
    with tarfile.open(archive) as tar:
        if hasattr(tarfile, "data_filter"):
            tar.extractall(folder, filter="data")
        else:  # Debian 12's Python knows no filters yet, and newer ones warn without.
            tar.extractall(folder)
    return folder / name
