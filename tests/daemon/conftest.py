from dataclasses import replace
from pathlib import Path

import pytest
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.recording import open_recording
from touchd.geometry import ZeroPlane

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
