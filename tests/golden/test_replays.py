from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from touchd.config.schema import Config
from touchd.formats.libfreenect import write_libfreenect
from touchd.geometry import ZeroPlane

from golden import make
from golden.replays import FOLDER, Golden, differences, load, load_frames, names, replay

# Named one by one, so that one that is lost is a failure.
GOLDENS = ["drag-1000", "pinch-750", "sweep-1500", "taps-750", "writing-750"]

TOUCH = {"frames": [10, 20], "places": [[10, 0.5, 0.5], [20, 0.6, 0.5]]}
SIZE_MM = (600.0, 400.0)


@pytest.mark.parametrize("name", GOLDENS)
def test_a_golden_replay_goes_as_it_went_with_every_method(name: str, tmp_path: Path) -> None:
    golden, frames = load(name), load_frames(name)
    assert golden.touches, f"{name} tells of no method: make golden-update"
    for method, expected in golden.touches.items():
        folder = tmp_path / method
        folder.mkdir()
        found = replay(golden, frames, method, folder)
        assert differences(expected, found, golden.size_mm) == [], f"{method}; if that is right: make golden-update"


@pytest.mark.parametrize("name", GOLDENS)
def test_the_default_method_makes_of_a_golden_replay_what_must_happen(name: str) -> None:
    golden = load(name)
    assert len(golden.touches[Config().touch.method]) == golden.must_touches, golden.must


def test_no_golden_replay_is_without_its_pictures_or_its_test() -> None:
    assert names() == GOLDENS
    assert sorted(path.stem for path in FOLDER.glob("*.xz")) == GOLDENS


@pytest.mark.parametrize("name", GOLDENS)
def test_a_golden_replay_is_headed_with_camera_place_and_what_must_happen(name: str) -> None:
    golden = load(name)
    assert golden.camera
    assert golden.place
    assert golden.must


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"frames": [12, 20]}, "touch 1: frames [12, 20] where [10, 20] were"),
        ({"places": [[10, 0.51, 0.5]]}, "touch 1, frame 10: 6.0 mm from where it was"),
    ],
)
def test_a_difference_is_told_in_one_sentence(change: dict[str, Any], sentence: str) -> None:
    assert differences([TOUCH], [TOUCH | change], SIZE_MM) == [sentence]


def test_a_missing_touch_is_told_in_one_sentence() -> None:
    assert differences([TOUCH], [], SIZE_MM) == ["0 touches where 1 were: none in place of 10–20"]


def test_what_lies_within_a_frame_and_a_millimetre_is_no_difference() -> None:
    near = {"frames": [11, 19], "places": [[10, 0.501, 0.5], [19, 0.9, 0.9]]}
    assert differences([TOUCH], [near], SIZE_MM) == []


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's recording, with what `make golden` needs beside it."""
    golden = load("taps-750")
    folder = tmp_path_factory.mktemp("user") / "recording"
    write_libfreenect(folder, load_frames("taps-750"), ZeroPlane())
    (folder / "touchd.yaml").write_text(yaml.safe_dump(golden.config))
    return folder


def header(**changes: object) -> str:
    content = {"name": "mine", "camera": "mine", "place": "desk", "must": "six taps", "touches": 6}
    return yaml.safe_dump(content | changes)


def test_a_recording_becomes_a_golden_replay_with_its_header(recorded: Path) -> None:
    (recorded / "golden.yaml").write_text(header(frames=[10, 30]))
    golden, frames = make.from_recording(recorded)
    assert (golden.name, golden.place, golden.must_touches) == ("mine", "desk", 6)
    assert len(frames) == make.CALIBRATING + 21
    times_ns = [frame.t_ns for frame in frames]
    assert times_ns == sorted(set(times_ns))


def test_a_recording_without_a_header_is_refused_with_what_it_must_say(recorded: Path) -> None:
    (recorded / "golden.yaml").unlink(missing_ok=True)
    with pytest.raises(make.GoldenError, match=r"needs a file golden\.yaml with: name, camera, place, must"):
        make.from_recording(recorded)


def test_a_golden_replay_that_does_not_what_it_must_is_not_stored(
    recorded: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (recorded / "golden.yaml").write_text(header(touches=9))
    monkeypatch.setattr(make, "OWN_METHODS", (Config().touch.method,))
    before = sorted(FOLDER.iterdir())
    with pytest.raises(make.GoldenError, match="6 touches were found where 9 must be"):
        make.add(*make.from_recording(recorded), print)
    assert sorted(FOLDER.iterdir()) == before


def test_an_update_says_what_is_different() -> None:
    golden = Golden("g", "c", "p", "one tap", 1, {"area": {"size_mm": [600, 400]}}, None, {"shell": [TOUCH]})
    moved = {**TOUCH, "frames": [14, 20]}
    method = Config().touch.method
    lines = list(make.changes(replace(golden, touches={method: [TOUCH]}), {method: [moved]}))
    assert lines == [f"{method}: touch 1: frames [14, 20] where [10, 20] were"]
    lines = list(make.changes(replace(golden, touches={method: [TOUCH]}), {method: []}))
    assert lines[-1] == f"{method}: 1 touches must be found (one tap)"


def test_only_noise_is_taken_out_of_a_golden_replay_s_pictures() -> None:
    frames = load_frames("taps-750")
    still = np.median(np.stack([f.raw for f in frames[: make.CALIBRATING]]), axis=0).astype(np.uint16)
    noisy = [replace(frame, raw=frame.raw.copy()) for frame in frames[:12]]
    noisy[11].raw[100, 100] += 1
    noisy[11].raw[300:320, 300:320] -= np.uint16(9)
    quiet = make.quietened(noisy, load("taps-750").config["area"]["corners_px"])
    assert quiet[11].raw[100, 100] == still[100, 100]
    np.testing.assert_array_equal(quiet[11].raw[295:325, 295:325], noisy[11].raw[295:325, 295:325])
