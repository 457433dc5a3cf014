import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from touchd.errors import AlreadyRunning, ExitCode, StateError, StateNotKept
from touchd.geometry import ZeroPlane, kinect_v1_sensor
from touchd.model import AreaCorners, FollowedArea, Intrinsics, Surface
from touchd.state import FseqStore, Lock, load_surface, save_surface, state_folder

SENSOR = replace(kinect_v1_sensor(), size=(8, 6))


@pytest.fixture
def surface() -> Surface:
    rng = np.random.default_rng(1)
    return Surface(
        sensor=SENSOR,
        reference=rng.uniform(600, 700, (6, 8)).astype(np.float32),
        dmax=rng.integers(600, 700, (6, 8)).astype(np.uint16),
        noise=rng.uniform(0, 1, (6, 8)).astype(np.float32),
        valid=rng.uniform(size=(6, 8)) < 0.9,
        moved=rng.uniform(size=(6, 8)) < 0.1,
        frames=300,
        made_from="a camera",
    )


def test_a_surface_comes_back_as_it_was_stored(surface: Surface, tmp_path: Path) -> None:
    save_surface(tmp_path / "s", surface)
    loaded = load_surface(tmp_path / "s", SENSOR)
    for name in ("reference", "dmax", "noise", "valid", "moved"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(surface, name))
        assert getattr(loaded, name).dtype == getattr(surface, name).dtype
        assert not getattr(loaded, name).flags.writeable
    assert (loaded.frames, loaded.made_from) == (300, "a camera")


CORNERS = AreaCorners(((1.0, 1.0), (6.5, 1.0), (6.5, 4.0), (1.0, 4.0)), (300.0, 200.0))


@pytest.mark.parametrize("area", [None, CORNERS, replace(CORNERS, size_mm=None)])
def test_where_an_area_was_seen_after_a_knock_comes_back_with_the_surface(
    surface: Surface, tmp_path: Path, area: AreaCorners | None
) -> None:
    followed = FollowedArea(area, CORNERS)
    save_surface(tmp_path / "s", replace(surface, followed=followed))
    assert load_surface(tmp_path / "s", SENSOR).followed == followed


@pytest.mark.parametrize(
    "wrong", [7, {}, {"area": None, "corners": None}, {"area": None, "corners": {"corners_px": [[1, 2]]}}]
)
def test_a_followed_area_that_is_misshapen_is_told(surface: Surface, tmp_path: Path, wrong: object) -> None:
    path = tmp_path / "s"
    save_surface(path, surface)
    head, _, payload = path.read_bytes().partition(b"\n")
    path.write_bytes(json.dumps(json.loads(head) | {"followed": wrong}).encode() + b"\n" + payload)
    with pytest.raises(StateError) as caught:
        load_surface(path, SENSOR)
    expected = f"{path}: the surface file's 'followed' is missing a part or misshapen; recalibrate"
    assert str(caught.value) == expected


def test_storing_leaves_no_other_file_behind(surface: Surface, tmp_path: Path) -> None:
    save_surface(tmp_path / "s", surface)
    save_surface(tmp_path / "s", surface)
    assert [path.name for path in tmp_path.iterdir()] == ["s"]


@pytest.mark.parametrize("place", [0.0, 0.3, 0.9])
def test_a_damaged_byte_is_noticed_wherever_it_is(surface: Surface, tmp_path: Path, place: float) -> None:
    path = tmp_path / "s"
    save_surface(path, surface)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 0x40
    path.write_bytes(content)
    with pytest.raises(StateError, match=r"recalibrate$"):
        load_surface(path, SENSOR)


def test_a_cut_surface_file_is_damaged(surface: Surface, tmp_path: Path) -> None:
    path = tmp_path / "s"
    save_surface(path, surface)
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(StateError, match=r"the surface file is damaged \(its checksum does not fit\); recalibrate"):
        load_surface(path, SENSOR)


def test_a_surface_of_another_camera_is_refused_with_the_difference(surface: Surface, tmp_path: Path) -> None:
    path = tmp_path / "s"
    save_surface(path, surface)
    with pytest.raises(StateError, match=r"made with another camera \(serial  there, A123 here\); recalibrate"):
        load_surface(path, replace(SENSOR, serial="A123"))
    other_unit = replace(kinect_v1_sensor(ZeroPlane(const_shift=210)), size=SENSOR.size)
    with pytest.raises(StateError, match="depth table"):
        load_surface(path, other_unit)
    other_lens = replace(SENSOR, intrinsics=Intrinsics(580.0, 580.0, 319.5, 239.5))
    with pytest.raises(StateError, match="lens"):
        load_surface(path, other_lens)


def test_a_surface_made_from_another_source_is_refused(surface: Surface, tmp_path: Path) -> None:
    save_surface(tmp_path / "s", surface)
    with pytest.raises(StateError, match="made from a camera, not from /recording; recalibrate"):
        load_surface(tmp_path / "s", SENSOR, "/recording")


def test_a_surface_of_another_version_is_refused(surface: Surface, tmp_path: Path) -> None:
    path = tmp_path / "s"
    save_surface(path, surface)
    head, _, payload = path.read_bytes().partition(b"\n")
    path.write_bytes(json.dumps({**json.loads(head), "version": 99}).encode() + b"\n" + payload)
    with pytest.raises(StateError, match="has version 99, this touchd reads version 1"):
        load_surface(path, SENSOR)


def test_a_missing_surface_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(StateError, match="the surface file cannot be read") as caught:
        load_surface(tmp_path / "absent", SENSOR)
    assert caught.value.exit_code == ExitCode.BAD_DATA


def test_a_folder_that_cannot_be_made_is_exit_code_73(surface: Surface, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StateNotKept, match="cannot be written: File exists") as caught:
        save_surface(tmp_path / "file" / "s", surface)
    assert caught.value.exit_code == ExitCode.CANNOT_WRITE


def test_a_state_folder_serves_one_daemon_at_a_time(tmp_path: Path) -> None:
    first = Lock(tmp_path / "state")
    with pytest.raises(AlreadyRunning, match="another touchd uses this state folder") as caught:
        Lock(tmp_path / "state")
    assert caught.value.exit_code == ExitCode.TRY_AGAIN
    first.release()
    Lock(tmp_path / "state").release()


@pytest.mark.parametrize("content", [None, "", "no number\n", "-5\n", "1e3\n", "\xff"])
def test_a_frame_number_that_cannot_be_read_counts_as_none(tmp_path: Path, content: str | None) -> None:
    if content is not None:
        (tmp_path / "fseq").write_text(content, "latin-1")
    assert FseqStore(tmp_path / "fseq").load() == 0


def test_a_frame_number_is_kept(tmp_path: Path) -> None:
    FseqStore(tmp_path / "fseq").keep(123456)
    assert FseqStore(tmp_path / "fseq").load() == 123456


def test_systemd_s_state_folder_goes_before_the_user_s() -> None:
    assert state_folder({"STATE_DIRECTORY": "/var/lib/touchd", "HOME": "/home/a"}) == Path("/var/lib/touchd")
    assert state_folder({"XDG_STATE_HOME": "/x", "HOME": "/home/a"}) == Path("/x/touchd")
    assert state_folder({"HOME": "/home/a"}) == Path("/home/a/.local/state/touchd")
