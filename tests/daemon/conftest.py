import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.recording import open_recording
from touchd.geometry import ZeroPlane

from clients.harness import PythonTuio
from daemon.fake_daemon import FakeControls, serving

EMPTY_FRAMES = 20
FRAME_NS = 33_333_000


@pytest.fixture(scope="session")
def short_recording(table_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rendered table cut down to 20 empty frames and its first three touches, with a config to run it."""
    recording = open_recording(table_recording)
    picked = [*range(EMPTY_FRAMES), *range(72, 126)]
    frames = (replace(recording.read(index), index=place, t_ns=place * FRAME_NS) for place, index in enumerate(picked))
    folder = tmp_path_factory.mktemp("short") / "recording"
    write_libfreenect(folder, frames, ZeroPlane())
    config = (table_recording / "touchd.yaml").read_text()
    config = config.replace("{kind: recording}", f"{{kind: recording, path: {folder}}}")
    config = config.replace("frames: 60, on_start: always", f"frames: {EMPTY_FRAMES}")
    (folder.parent / "touchd.yaml").write_text(config)
    return folder


@pytest.fixture
def client() -> Iterator[PythonTuio]:
    with PythonTuio() as client:
        yield client


@pytest.fixture
def config(short_recording: Path, client: PythonTuio, tmp_path: Path) -> Path:
    path = tmp_path / "touchd.yaml"
    text = (short_recording.parent / "touchd.yaml").read_text()
    path.write_text(f'{text}\noutputs:\n  - tuio: {{to: ["{client.destination}"]}}\n')
    return path


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder that is open to everybody, unlike pytest's own."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.fixture
def controls() -> FakeControls:
    return FakeControls()


@pytest.fixture
def path(folder: Path, controls: FakeControls) -> Iterator[Path]:
    with serving(folder / "control.sock", controls) as server:
        yield server.path
