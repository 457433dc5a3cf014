"""Frames of a scene that are kept in a folder: the same to the bit, and never another renderer's."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from touchd.errors import OutputError, RecordingError
from touchd.lab.accuracy import frames
from touchd.lab.accuracy.frames import played
from touchd.lab.scenes import LabScene, lab_scene
from touchd.model import Frame


@pytest.fixture
def scene() -> LabScene:
    return replace(lab_scene("knock", 750.0, 1), calibration_frames=2, frames=3)


def rendered(scene: LabScene) -> list[Frame]:
    return [scene.frame(index) for index in range(scene.calibration_frames + scene.frames)]


def same(some: list[Frame], others: list[Frame]) -> bool:
    about = [
        [(frame.index, frame.t_ns, frame.missing_packets, frame.accel_g) for frame in each] for each in (some, others)
    ]
    return about[0] == about[1] and all(np.array_equal(a.raw, b.raw) for a, b in zip(some, others, strict=True))


def never(_scene: LabScene) -> Iterator[Frame]:
    raise AssertionError("rendered again")


def test_frames_come_back_as_they_were_rendered_and_are_not_rendered_again(
    scene: LabScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = list(played(scene, tmp_path / "frames"))
    monkeypatch.setattr(frames, "_rendered", never)
    again = list(played(scene, tmp_path / "frames"))
    assert same(first, rendered(scene))
    assert same(again, first)
    assert [path.name for path in (tmp_path / "frames").iterdir()] == ["knock-750-1.frames"]


@given(
    st.lists(arrays(np.uint16, (3, 5)), min_size=1, max_size=4),
    st.none() | st.tuples(*[st.floats(-2, 2)] * 3),
    st.integers(0, 300),
)
def test_any_readings_survive(
    tmp_path_factory: pytest.TempPathFactory,
    raws: list[np.ndarray],
    accel_g: tuple[float, float, float] | None,
    missing_packets: int,
) -> None:
    path = tmp_path_factory.mktemp("any") / "any.frames"
    shown = [Frame(index, index * 33_000_000, raw, missing_packets, accel_g) for index, raw in enumerate(raws)]
    assert same(list(frames._written(path, b"any\n", iter(shown))), shown)
    assert same(list(frames._read(path)), shown)


def test_what_was_not_watched_to_its_end_is_not_kept(scene: LabScene, tmp_path: Path) -> None:
    watched = played(scene, tmp_path)
    next(watched)
    assert [path.name for path in tmp_path.iterdir()] == [f"knock-750-1.frames.{os.getpid()}"]
    watched.close()  # type: ignore[attr-defined]
    assert list(tmp_path.iterdir()) == []


def test_what_other_code_rendered_is_rendered_anew(
    scene: LabScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as other:
        other.setattr(frames, "_digest", lambda: "another renderer")
        other.setattr(frames, "_rendered", lambda scene: iter(rendered(scene)[:1]))
        assert len(list(played(scene, tmp_path))) == 1
    assert same(list(played(scene, tmp_path)), rendered(scene))


def test_a_damaged_file_is_named(scene: LabScene, tmp_path: Path) -> None:
    list(played(scene, tmp_path))
    path = tmp_path / "knock-750-1.frames"
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(RecordingError) as caught:
        list(played(scene, tmp_path))
    assert str(caught.value).startswith(f"{path} is damaged (")
    assert str(caught.value).endswith("): delete it, and it is rendered anew")


def test_a_folder_that_cannot_be_written_to_is_named(scene: LabScene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError) as caught:
        list(played(scene, tmp_path / "file"))
    assert str(caught.value).startswith(f"{tmp_path}/file/knock-750-1.frames cannot be written: ")
