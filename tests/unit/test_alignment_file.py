import hashlib
import json
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.align.alignment import Alignment, AreaOrigin, Corners, KeptAlignment, area_in_force, eye_in_force
from touchd.align.file import load_alignment, save_alignment
from touchd.contacts.aim import EyeOffsets
from touchd.errors import StateError, StateNotKept
from touchd.model import AreaCorners

from aligned_table import SENSOR

CORNERS: Corners = ((60.25, 40.1), (580.0, 44.0), (570.0, 430.0), (66.0, 424.0))
EDITED: Corners = ((61.0, 40.0), (580.0, 44.0), (570.0, 430.0), (66.0, 424.0))
FOUND: Corners = ((100.5, 80.0), (540.0, 84.0), (530.0, 390.0), (106.0, 384.0 + 1.0 / 3.0))
EYE = EyeOffsets(3.0, 2.5, 1.0 / 3.0, -1.0)
ALIGNMENT = Alignment(FOUND, (700.2, 500.1), 1.25, 4)


def kept(config_corners: Corners | None) -> KeptAlignment:
    return KeptAlignment(ALIGNMENT, 1_700_000_000.5, config_corners)


@pytest.mark.parametrize(
    ("config", "alignment", "expected", "origin"),
    [
        (None, None, None, AreaOrigin.GUESSED),
        (AreaCorners(CORNERS), None, AreaCorners(CORNERS), AreaOrigin.CONFIG),
        (None, kept(None), AreaCorners(FOUND), AreaOrigin.ALIGNMENT),
        (AreaCorners(CORNERS), kept(CORNERS), AreaCorners(FOUND), AreaOrigin.ALIGNMENT),
        (AreaCorners(CORNERS, (70.0, 50.0)), kept(CORNERS), AreaCorners(FOUND, (70.0, 50.0)), AreaOrigin.ALIGNMENT),
        (AreaCorners(EDITED), kept(CORNERS), AreaCorners(EDITED), AreaOrigin.CONFIG),
        (AreaCorners(EDITED), kept(None), AreaCorners(EDITED), AreaOrigin.CONFIG),
        (None, kept(CORNERS), None, AreaOrigin.GUESSED),
    ],
)
def test_the_newer_one_of_alignment_and_edited_corners_is_in_force(
    config: AreaCorners | None, alignment: KeptAlignment | None, expected: AreaCorners | None, origin: AreaOrigin
) -> None:
    assert area_in_force(config, alignment) == (expected, origin)


@pytest.mark.parametrize("config_corners", [None, CORNERS])
def test_an_alignment_comes_back_as_it_was_stored(tmp_path: Path, config_corners: Corners | None) -> None:
    save_alignment(tmp_path / "alignment.json", kept(config_corners), SENSOR)
    assert load_alignment(tmp_path / "alignment.json", SENSOR) == kept(config_corners)
    assert [path.name for path in tmp_path.iterdir()] == ["alignment.json"]


def test_the_eye_s_offsets_come_back_too_and_a_file_from_before_they_were_measured_has_none(tmp_path: Path) -> None:
    path = tmp_path / "alignment.json"
    measured = replace(kept(None), alignment=replace(ALIGNMENT, eye=EYE))
    save_alignment(path, measured, SENSOR)
    assert load_alignment(path, SENSOR) == measured
    old = json.loads(path.read_text())
    del old["eye"]
    content = {key: value for key, value in old.items() if key not in {"kind", "version", "sha256"}}
    old["sha256"] = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    path.write_text(json.dumps(old))
    assert load_alignment(path, SENSOR) == kept(None)


@pytest.mark.parametrize(
    ("config", "measured", "origin", "expected"),
    [
        (None, None, AreaOrigin.ALIGNMENT, None),
        (None, EYE, AreaOrigin.ALIGNMENT, EYE),
        (None, EYE, AreaOrigin.CONFIG, None),
        (EyeOffsets(), EYE, AreaOrigin.ALIGNMENT, EyeOffsets()),
        (EyeOffsets(1.0), EYE, AreaOrigin.CONFIG, EyeOffsets(1.0)),
    ],
)
def test_the_config_s_offsets_go_before_those_of_the_alignment_in_force(
    config: EyeOffsets | None, measured: EyeOffsets | None, origin: AreaOrigin, expected: EyeOffsets | None
) -> None:
    found = replace(kept(None), alignment=replace(ALIGNMENT, eye=measured))
    assert eye_in_force(config, found, origin) == expected
    assert eye_in_force(config, None, origin) == config


def test_no_stored_alignment_is_none(tmp_path: Path) -> None:
    assert load_alignment(tmp_path / "alignment.json", SENSOR) is None


def test_a_changed_byte_is_noticed_wherever_it_is(tmp_path: Path) -> None:
    path = tmp_path / "alignment.json"
    save_alignment(path, kept(CORNERS), SENSOR)
    whole = path.read_bytes()
    for place in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[place] = ord("7") if damaged[place] != ord("7") else ord("8")
        path.write_bytes(damaged)
        with pytest.raises(StateError, match=r"run touchd align$") as caught:
            load_alignment(path, SENSOR)
        assert caught.value.exit_code == 65


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b"[" * 100_000, b'{"kind": "touchd surface"}'])
def test_what_is_no_alignment_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "alignment.json"
    path.write_bytes(content)
    with pytest.raises(StateError) as caught:
        load_alignment(path, SENSOR)
    assert str(caught.value) == f"{path}: this is no alignment of touchd; run touchd align"


def test_an_alignment_of_another_camera_or_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "alignment.json"
    save_alignment(path, kept(None), SENSOR)
    with pytest.raises(StateError, match=r"made with another camera \(serial  there, B77 here\); run touchd align"):
        load_alignment(path, replace(SENSOR, serial="B77"))
    path.write_text(json.dumps({**json.loads(path.read_text()), "version": 2}))
    with pytest.raises(StateError, match="the alignment has version 2, this touchd reads version 1; run touchd align"):
        load_alignment(path, SENSOR)


def test_a_folder_in_place_of_the_alignment_is_named(tmp_path: Path) -> None:
    with pytest.raises(StateError, match="the alignment cannot be read: Is a directory; run touchd align"):
        load_alignment(tmp_path, SENSOR)


def test_an_alignment_that_cannot_be_stored_is_exit_code_73(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StateNotKept) as caught:
        save_alignment(tmp_path / "file" / "alignment.json", kept(None), SENSOR)
    assert caught.value.exit_code == 73
