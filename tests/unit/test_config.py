import dataclasses
import re
from pathlib import Path

import pytest
from touchd.config.describe import all_keys, choices, expectation, extra, field_at, section_in, takes
from touchd.config.load import load_config, parse_config
from touchd.config.schema import Config
from touchd.config.yaml_marks import plain_value
from touchd.contacts.settings import BlobSettings
from touchd.model import AreaCorners, Intrinsics
from touchd.surface.settings import CalibrationSettings, ShellSettings
from touchd.table.scenario_names import SCENARIOS
from touchd.tracking.settings import TrackingSettings

REPOSITORY = Path(__file__).parents[2]

CONTRACT = """\
source: {kind: kinect}
camera: {}
calibration: {frames: 300, on_start: if-missing}
touch: {method: fingertip, near_mm: auto, far_mm: auto}
tracking: {stall_ms: 150}
outputs: [{tuio: {to: ["127.0.0.1:3333"], transport: udp, profile: 2Dcur, source: auto}}]
"""

EVERYTHING = """\
version: 1
source:
  kind: recording
  path: recordings/table one
  serial: "0123"
camera: {fx: 590, fy: 591.5, cx: 320, cy: 240, k1: 0.05, k2: -1e-3}
calibration: {frames: 1e3, on_start: always, min_share: 0.023, give_up_s: 45}
area:
  corners_px: [[60, 40], [580.5, 44], [570, 430], [66, 424]]
  size_mm: [800, 600]
touch:
  near_mm: 4
  min_area_mm2: 31
  max_area_mm2: 907
  shell: {delta_raw: 4, boxcar_px: 13, threshold: 0.61, keep_threshold: 0.31}
tracking:
  stall_ms: 201
  coast_ms: 61
  gate_mm: 41
  stray_mm: 6.5
  min_cutoff_hz: 2.3
  beta_hz_s_mm: 0.23
  rest_mm_s: 4.5
  hover_mm: 30
outputs:
  - tuio: {to: ["[::1]:3334", "wall.local:3333"], source: "left: wall"}
  - tuio:
  - events: {path: ../out/täble.jsonl}
"""


def test_the_defaults_of_the_stages_are_the_defaults_of_the_config() -> None:
    config = Config()

    assert config.calibration_settings() == CalibrationSettings()
    assert config.shell_settings() == ShellSettings()
    assert config.blob_settings() == BlobSettings()
    assert config.tracking_settings() == TrackingSettings()
    assert config.area_corners() is None
    assert config.intrinsics(Intrinsics(1, 2, 3, 4, 5, 6)) == Intrinsics(1, 2, 3, 4, 5, 6)


def test_the_config_written_in_the_contract_is_valid_and_the_default() -> None:
    assert parse_config(CONTRACT, "touchd.yaml") == Config()


def test_every_key_reaches_the_stage_it_is_for() -> None:
    config = parse_config(EVERYTHING, "touchd.yaml")

    assert config.source.kind == "recording"
    assert config.source.serial == "0123"
    assert config.calibration.on_start == "always"
    assert config.intrinsics(Intrinsics(1, 2, 3, 4)) == Intrinsics(590, 591.5, 320, 240, 0.05, -0.001)
    assert config.calibration_settings() == CalibrationSettings(frames=1000, min_share=0.023, give_up_s=45.0)
    assert config.shell_settings() == ShellSettings(near_mm=4, far_mm=None, delta_raw=4)
    assert config.blob_settings() == BlobSettings(
        boxcar_px=13, threshold=0.61, keep_threshold=0.31, min_area_mm2=31, max_area_mm2=907
    )
    assert config.tracking_settings() == TrackingSettings(
        stall_ms=201,
        coast_ms=61,
        gate_mm=41,
        stray_mm=6.5,
        min_cutoff_hz=2.3,
        beta_hz_s_mm=0.23,
        rest_mm_s=4.5,
        hover_mm=30.0,
    )
    assert config.area_corners() == AreaCorners(((60, 40), (580.5, 44), (570, 430), (66, 424)), size_mm=(800, 600))
    first, second, third = config.outputs
    assert first.tuio is not None
    assert first.tuio.to == ("[::1]:3334", "wall.local:3333")
    assert first.tuio.source == "left: wall"
    assert second == Config().outputs[0]
    assert third.events is not None
    assert third.tuio is None


def test_no_setting_of_a_stage_is_out_of_the_configs_reach() -> None:
    default, config = Config(), parse_config(EVERYTHING.replace("delta_raw: 4, ", ""), "touchd.yaml")
    with_far = parse_config("touch: {far_mm: 14, shell: {delta_raw: null}}", "touchd.yaml")
    with_delta = parse_config("touch: {shell: {delta_raw: 5}}", "touchd.yaml")

    for changed, settings in (
        (config.calibration_settings(), default.calibration_settings()),
        (config.blob_settings(), default.blob_settings()),
        (config.tracking_settings(), default.tracking_settings()),
    ):
        for field in dataclasses.fields(settings):
            assert getattr(changed, field.name) != getattr(settings, field.name), field.name
    assert with_far.shell_settings() == ShellSettings(far_mm=14)
    assert with_delta.shell_settings() == ShellSettings(delta_raw=5)
    assert {field.name for field in dataclasses.fields(ShellSettings)} == {"near_mm", "far_mm", "delta_raw"}


@pytest.mark.parametrize("text", ["", "\n", "# nothing\n", "---\n", "null\n", "{}", "\ufefftouch:\n", "touch: ~\n"])
def test_an_empty_file_or_section_means_the_defaults(text: str) -> None:
    assert parse_config(text, "touchd.yaml") == Config()


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "touchd.yaml"
    path.write_bytes(b"\xef\xbb\xbftouch:\r\n  near_mm: 5\r\ntracking:\r\n  coast_ms: 40\r\n")

    assert load_config(path).touch.near_mm == 5
    assert load_config(path).tracking.coast_ms == 40


def test_an_empty_list_of_outputs_sends_nothing() -> None:
    assert parse_config("outputs: []", "touchd.yaml").outputs == ()


def test_it_is_known_which_keys_the_file_gives() -> None:
    config = parse_config("calibration: {frames: 300}\ntouch:\narea:\n", "touchd.yaml")

    assert config.was_set("calibration.frames")
    assert config.was_set("calibration")
    assert config.was_set("touch")
    assert not config.was_set("calibration.on_start")
    assert not config.was_set("touch.shell.threshold")
    assert not config.was_set("area.corners_px")
    assert not config.was_set("outputs")
    assert not Config().was_set("calibration.frames")
    with pytest.raises(ValueError, match=re.escape('"calibration.frame" is no key of the config')):
        config.was_set("calibration.frame")
    with pytest.raises(ValueError, match=re.escape('"touch.method.name" is no key of the config')):
        parse_config("touch: {method: shell}", "").was_set("touch.method.name")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000),
        ("1.5e-2", 0.015),
        ("010", 10),
        ("0x10", 16),
        ("300.0", 300),
        ("+7", 7),
        ("no", "no"),
        ("on", "on"),
        ("12:30", "12:30"),
        ("2024-05-01", "2024-05-01"),
        ("1_000", "1_000"),
        ("True", True),
        ("~", None),
        ("-.inf", float("-inf")),
        ("9" * 5000, float("inf")),
    ],
)
def test_plain_scalars_mean_what_yaml_1_2_says(text: str, value: object) -> None:
    assert plain_value(text) == value
    assert type(plain_value(text)) is type(value)


def test_relative_paths_begin_at_the_config_files_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", "/home/ann")
    path = tmp_path / "touchd.yaml"
    path.write_text("source: {path: rec/a}\noutputs: [{events: {path: /x/b}}, {events: {path: ~/c}}]", "utf-8")

    config = load_config(path)

    assert config.source.path == tmp_path / "rec" / "a"
    assert [item.events.path for item in config.outputs if item.events] == [Path("/x/b"), Path("/home/ann/c")]


def test_paths_in_a_file_named_relatively_become_absolute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("touchd.yaml").write_text("source: {path: a}", "utf-8")

    assert load_config(Path("touchd.yaml")).source.path == tmp_path / "a"


@pytest.mark.parametrize("path", list(all_keys()), ids=".".join)
def test_every_key_has_a_meaning_a_reload_tag_a_default_and_numbers_a_range(path: tuple[str, ...]) -> None:
    field = field_at(path)
    assert field is not None
    assert field.description
    assert "\n" not in field.description
    assert extra(field, "reload") in {"live", "source", "restart"}
    assert not field.is_required() or path in {("area", "corners_px"), ("outputs", "events", "path")}
    if path != ("version",) and (takes(field, float) or takes(field, int)):
        assert extra(field, "unit") or path[0] == "camera" or path == ("source", "seed")
        assert re.search(r" from -?[0-9.]+ to [0-9.]+$", expectation(field))
    if section_in(field.annotation) is None and field.default is None:
        assert field.examples


def test_the_config_knows_the_scenarios_that_there_are() -> None:
    field = field_at(("source", "scenario"))
    assert field is not None
    assert set(choices(field)) == set(SCENARIOS)
