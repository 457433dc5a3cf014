import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from touchd.config import load
from touchd.config.describe import all_keys
from touchd.config.document import default_yaml, json_schema, write_documents
from touchd.config.load import DEFAULTS, find_config_path, load_config, load_with_origin, parse_config
from touchd.config.output_sections import Tuio
from touchd.config.schema import Config
from touchd.config.show import effective_yaml
from touchd.contacts.settings import BlobSettings
from touchd.errors import ConfigError
from touchd.surface.settings import CalibrationSettings
from touchd.tracking.settings import TrackingSettings

REPOSITORY = Path(__file__).parents[2]

LISTS_AND_QUOTES = """\
source: {path: recordings/table one, serial: "0123"}
camera: {fx: 590, k2: -1e-7}
area: {corners_px: [[60, 40], [580.5, 44], [570, 430], [66, 424]]}
touch: {near_mm: 4, shell: {delta_raw: 4}}
outputs:
  - tuio: {to: ["[::1]:3334", "wall.local:3333"], source: "left: wall"}
  - tuio:
  - events: {path: ../out/täble.jsonl}
"""


def uncommented(text: str) -> str:
    """Do what the default file's head says, to every key: their '#' has not one space after it."""
    key = re.compile(r"^( *)#(?! \S)(?=.)", re.MULTILINE)
    while key.search(text):
        text = key.sub(r"\1", text)
    return text


class TestFindingTheFile:
    @pytest.fixture
    def system(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        path = tmp_path / "etc.yaml"
        monkeypatch.setattr(load, "SYSTEM_CONFIG", path)
        return path

    def users(self, folder: Path) -> Path:
        path = folder / "touchd" / "touchd.yaml"
        path.parent.mkdir(parents=True)
        path.touch()
        return path

    def test_an_explicit_path_wins(self, tmp_path: Path, system: Path) -> None:
        system.touch()
        mine = tmp_path / "mine.yaml"
        mine.touch()
        assert find_config_path(mine, {}, 0) == mine

    def test_an_explicit_path_that_is_not_there_is_an_error(self, tmp_path: Path, system: Path) -> None:
        system.touch()
        with pytest.raises(ConfigError) as caught:
            find_config_path(tmp_path / "no.yaml", {}, 1000)
        assert str(caught.value) == (
            f"There is no config file {tmp_path / 'no.yaml'}; check the path given with --config."
        )

    def test_a_users_own_file_comes_before_the_systems(self, tmp_path: Path, system: Path) -> None:
        system.touch()
        mine = self.users(tmp_path / "xdg")
        assert find_config_path(None, {"XDG_CONFIG_HOME": str(tmp_path / "xdg")}, 1000) == mine

    @pytest.mark.parametrize("xdg", [{}, {"XDG_CONFIG_HOME": ""}, {"XDG_CONFIG_HOME": "not/absolute"}])
    def test_without_an_xdg_folder_it_is_dot_config(self, tmp_path: Path, system: Path, xdg: dict[str, str]) -> None:
        system.touch()
        mine = self.users(tmp_path / ".config")
        assert find_config_path(None, {"HOME": str(tmp_path), **xdg}, 1000) == mine

    def test_root_reads_the_systems_file_alone(self, tmp_path: Path, system: Path) -> None:
        system.touch()
        self.users(tmp_path / ".config")
        assert find_config_path(None, {"HOME": str(tmp_path)}, 0) == system

    def test_a_user_without_a_file_gets_the_systems(self, tmp_path: Path, system: Path) -> None:
        system.touch()
        assert find_config_path(None, {"HOME": str(tmp_path)}, 1000) == system
        assert find_config_path(None, {}, 1000) == system

    def test_without_any_file_the_defaults_apply(self, tmp_path: Path, system: Path) -> None:
        assert not system.exists()
        assert find_config_path(None, {"HOME": str(tmp_path)}, 1000) is None
        assert load_config(None) == Config()


class TestTheConfigShown:
    @pytest.mark.parametrize("text", ["", LISTS_AND_QUOTES, "outputs: []", "source: {serial: '0x1F'}"])
    def test_it_reads_back_as_the_same_config(self, tmp_path: Path, text: str) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_text(text, "utf-8")
        config, origin = load_with_origin(path)

        assert parse_config(effective_yaml(config, origin), "/elsewhere/shown.yaml") == config

    def test_each_line_tells_its_meaning_and_where_it_came_from(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_text("# mine\ntracking:\n  stall_ms: 200\noutputs:\n  - events: {path: /x y}\n", "utf-8")
        lines = effective_yaml(*load_with_origin(path)).splitlines()

        assert lines[0] == f'# The config in force, from "{path}" and the defaults.'
        assert (
            "  stall_ms: 200  # line 3: Without a frame for this long all touches end (milliseconds from 34 to 5000)"
        ) in lines
        assert (
            "  coast_ms: 50  # default: How long a touch outlives its contact (milliseconds from 0 to 1000)"
        ) in lines
        assert "  # path: not set  # default: The recording to play: a folder (a path)" in lines
        assert "  - events:  # line 5: Every frame as a line of JSON in a file" in lines
        assert '      path: "/x y"  # line 5: The file to write (a path)' in lines
        assert all("# default: " in line or "# line " in line for line in lines[1:])

    def test_without_a_file_all_of_it_is_default(self) -> None:
        lines = effective_yaml(Config(), DEFAULTS).splitlines()

        assert lines[0] == "# The config in force, from the defaults alone."
        assert all("  # default: " in line for line in lines[1:])


class TestTheFilesForPeopleAndEditors:
    def test_the_default_file_in_the_repository_is_the_generated_one(self) -> None:
        assert (REPOSITORY / "config" / "touchd.yaml").read_text("utf-8") == default_yaml()

    def test_the_schema_in_the_repository_is_the_generated_one(self) -> None:
        stored = json.loads((REPOSITORY / "config" / "touchd.schema.json").read_text("utf-8"))
        assert stored == json.loads(json.dumps(json_schema()))

    def test_the_default_file_is_the_default_config_and_sets_nothing(self) -> None:
        config = load_config(REPOSITORY / "config" / "touchd.yaml")

        assert config == Config()
        assert not config.was_set("calibration.frames")

    def test_the_default_file_with_every_key_uncommented_has_the_defaults_and_the_examples(self) -> None:
        # The example of outputs.tuio.interface is for multicast alone.
        text = uncommented(default_yaml()).replace('["127.0.0.1:3333"]\n', '["239.0.0.1:3333"]\n')
        config = parse_config(text, "touchd.yaml")

        assert config.was_set("touch.shell.delta_raw")
        assert config.was_set("area.size_mm")
        assert config.calibration_settings() == CalibrationSettings()
        assert config.blob_settings() == BlobSettings()
        assert config.tracking_settings() == TrackingSettings()
        assert config.outputs[0].tuio == Tuio(to=("239.0.0.1:3333",), interface="192.168.0.2")
        assert config.outputs[1].events is not None

    def test_the_module_writes_both_files_and_says_nothing(self, tmp_path: Path) -> None:
        command = [sys.executable, "-m", "touchd.config.document", str(tmp_path)]
        run = subprocess.run(
            command, capture_output=True, check=True, cwd=REPOSITORY, env={**os.environ, "PYTHONUTF8": "0"}
        )

        assert run.stdout == run.stderr == b""
        for name in ("touchd.yaml", "touchd.schema.json"):
            assert (tmp_path / name).read_bytes() == (REPOSITORY / "config" / name).read_bytes()

    def test_writing_both_files_again_changes_nothing(self, tmp_path: Path) -> None:
        write_documents(tmp_path)
        first = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
        write_documents(tmp_path)

        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == first

    def test_the_schema_knows_every_key(self) -> None:
        for path in all_keys():
            place = json_schema()
            for name in path:
                place = place.get("items", place)["properties"][name]
            assert place["description"]

    def test_the_schema_carries_ranges_choices_and_no_room_for_unknown_keys(self) -> None:
        top = json_schema()
        tracking = top["properties"]["tracking"]

        assert top["additionalProperties"] is False
        assert tracking["additionalProperties"] is False
        assert tracking["type"] == ["object", "null"]
        assert tracking["properties"]["stall_ms"]["minimum"] == 34
        assert tracking["properties"]["stall_ms"]["maximum"] == 5000
        assert top["properties"]["area"]["required"] == ["corners_px"]
        assert top["properties"]["touch"]["properties"]["near_mm"]["anyOf"] == [
            {"enum": ["auto"]},
            {"type": "number", "minimum": 0, "maximum": 100},
        ]


class TestFilesThatCannotBeRead:
    def message_of(self, path: Path) -> str:
        with pytest.raises(ConfigError) as caught:
            load_config(path)
        return str(caught.value)

    def test_a_file_that_is_not_there(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        assert self.message_of(path) == (
            f"Cannot read the config file {path}: No such file or directory; check the path and its rights."
        )

    def test_a_folder(self, tmp_path: Path) -> None:
        assert self.message_of(tmp_path) == (
            f"Cannot read the config file {tmp_path}: Is a directory; check the path and its rights."
        )

    def test_a_file_that_is_far_too_large(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_bytes(b"#" * ((1 << 20) + 1))
        assert self.message_of(path) == (f"The config file {path} is larger than 1 MiB; this is no config of touchd's.")

    def test_a_large_file_of_comments_is_fine(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_bytes(b"#" * ((1 << 20) - 8) + b"\ntouch:\n")
        assert not load_config(path).was_set("touch.method")

    def test_a_file_that_is_not_utf_8(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_bytes("touch:\n  # wärmer\n  near_mm: 3\n".encode("latin-1"))
        assert self.message_of(path) == (
            f"{path}:2:6: the byte 0xe4 is not UTF-8; save the file as UTF-8 text\n"
            "     2 |   # w\ufffdrmer\n"
            "       |      ^\n"
            "1 error; the config was not used."
        )

    def test_a_file_in_utf_16(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_bytes(b"\xff\xfe" + "touch:\n".encode("utf-16-le"))
        assert f"{path}:1:1: the byte 0xff is not UTF-8; save the file as UTF-8 text" in self.message_of(path)

    def test_a_file_of_too_many_values(self, tmp_path: Path) -> None:
        path = tmp_path / "touchd.yaml"
        path.write_text("".join(f"wibble{number}: 1\n" for number in range(3000)), "utf-8")
        assert "2500:13: the file holds more than 5000 keys and values; this is no config" in self.message_of(path)
