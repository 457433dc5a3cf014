"""Small recordings and ways to damage them, for the tests of what goes wrong."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from touchd.errors import RecordingError
from touchd.formats.recording import open_recording
from touchd.model import Frame

Damage = Callable[[Path], object]


def frames(width: int, height: int) -> list[Frame]:
    return [Frame(i, i * 33_369_250, np.full((height, width), 700 + i, np.uint16)) for i in range(2)]


def error_on_opening(folder: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        open_recording(folder)
    assert caught.value.exit_code == 65
    assert "\n" not in str(caught.value)
    return str(caught.value)


def write(name: str, data: bytes) -> Damage:
    return lambda folder: (folder / name).write_bytes(data)


def cut(name: str, length: int) -> Damage:
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:length])


def append(name: str, data: bytes) -> Damage:
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes() + data)


def remove(name: str) -> Damage:
    return lambda folder: (folder / name).unlink()


def link_to_itself(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink()
        (folder / name).symlink_to(name)

    return damage


def make_folder(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink()
        (folder / name).mkdir()

    return damage
