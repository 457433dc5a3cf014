import os
from pathlib import Path

import pytest
from touchd.config.load import parse_config
from touchd.config.reload import changes
from touchd.config.watch import ConfigWatch


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        ("", "", "nothing changed"),
        ("", "tracking: {stall_ms: 150}", "nothing changed"),
        ("", "tracking: {min_cutoff_hz: 2}", "in force now: tracking.min_cutoff_hz"),
        ("", "touch: {far_mm: 14, shell: {boxcar_px: 7}}", "in force now: touch.far_mm, touch.shell.boxcar_px"),
        ("", "outputs: []", "in force now: outputs"),
        ("", "camera: {fx: 580}\ntouch: {far_mm: 14}", "in force now: camera.fx, touch.far_mm"),
        ("area: {corners_px: [[1,1],[9,1],[9,9],[1,9]]}", "", "in force now: area"),
        (
            "area: {corners_px: [[1,1],[9,1],[9,9],[1,9]]}",
            "area: {corners_px: [[1,1],[9,1],[9,9],[1,9]], size_mm: [90, 90]}",
            "in force now: area",
        ),
    ],
)
def test_what_a_new_config_changes_is_told_by_key(before: str, after: str, sentence: str) -> None:
    assert changes(parse_config(before, "old"), parse_config(after, "new")).sentence() == sentence


def test_a_change_of_the_camera_or_the_source_needs_the_source_opened_anew() -> None:
    found = changes(parse_config("", "old"), parse_config("source: {path: x}\ncamera: {cx: 300}", "new"))
    assert found.source == ("source.path", "camera.cx")
    assert found.live == ()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "touchd.yaml"
    path.write_text("a")
    return path


def test_an_edit_is_told_once_and_only_when_two_looks_agree(path: Path) -> None:
    watch = ConfigWatch(path)
    assert not watch.changed()
    path.write_text("ab")
    assert [watch.changed() for _ in range(3)] == [False, True, False]


def test_a_file_that_is_still_being_written_is_waited_for(path: Path) -> None:
    watch = ConfigWatch(path)
    for length in (2, 3, 4):
        path.write_text("a" * length)
        assert not watch.changed()
    assert watch.changed()


def test_a_file_that_is_replaced_by_one_of_the_same_size_and_time_is_an_edit(path: Path) -> None:
    watch = ConfigWatch(path)
    before = path.stat()
    new = path.with_name("new")
    new.write_text("b")
    os.utime(new, ns=(before.st_atime_ns, before.st_mtime_ns))
    new.replace(path)
    assert [watch.changed() for _ in range(2)] == [False, True]


def test_a_file_that_vanishes_is_an_edit_and_so_is_its_return(path: Path) -> None:
    watch = ConfigWatch(path)
    path.unlink()
    assert [watch.changed() for _ in range(3)] == [False, True, False]
    path.write_text("a")
    assert [watch.changed() for _ in range(3)] == [False, True, False]


def test_a_file_that_comes_back_before_anyone_looked_twice_is_no_edit(path: Path) -> None:
    watch = ConfigWatch(path)
    content = path.read_text()
    kept = path.with_name("kept")
    path.rename(kept)
    assert not watch.changed()
    kept.rename(path)
    assert path.read_text() == content
    assert [watch.changed() for _ in range(3)] == [False, False, False]
