import pytest
from touchd.cli import run_command_line


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "touchd: the following arguments are required: COMMAND; see touchd --help"),
        (["replay"], "touchd: the following arguments are required: PATH; see touchd replay --help"),
        (
            ["replay", "x", "--speed", "0"],
            "touchd: argument --speed: expected a number above 0 or 'max', found '0'; see touchd replay --help",
        ),
        (
            ["bench", "--seconds", "soon"],
            "touchd: argument --seconds: expected 0.5 to 600 seconds, found 'soon'; see touchd bench --help",
        ),
        (
            ["listen", "70000"],
            "touchd: argument PORT: expected a port from 1 to 65535, found '70000'; see touchd listen --help",
        ),
        (
            ["listen", "--for", "-1"],
            "touchd: argument --for: expected a number of seconds above 0, found '-1'; see touchd listen --help",
        ),
        (
            ["listen", "--frames", "none"],
            "touchd: argument --frames: expected a whole number from 1, found 'none'; see touchd listen --help",
        ),
    ],
)
def test_a_wrong_command_line_is_one_sentence_and_exit_code_64(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(arguments) == 64
    assert capsys.readouterr().err == sentence + "\n"


def test_an_unknown_command_is_exit_code_64(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["dance"]) == 64
    assert "invalid choice: 'dance'" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], ["replay", "--help"]])
def test_help_and_version_are_exit_code_0(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run_command_line(arguments)
    assert ended.value.code == 0


def test_a_config_that_is_wrong_is_exit_code_78(
    tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path_factory.mktemp("config") / "touchd.yaml"
    path.write_text("tracking: {stall_ms: soon}\n")
    assert run_command_line(["check-config", "--config", str(path)]) == 78
    assert f"{path}:1:22: tracking.stall_ms" in capsys.readouterr().err


def test_a_config_that_is_right_is_said_to_be(
    tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path_factory.mktemp("config") / "touchd.yaml"
    path.write_text("tracking: {stall_ms: 200}\n")
    assert run_command_line(["check-config", "--config", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}: right\n"


def test_show_config_prints_values_in_force(
    tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path_factory.mktemp("config") / "touchd.yaml"
    path.write_text("tracking: {stall_ms: 200}\n")
    assert run_command_line(["show-config", "--config", str(path)]) == 0
    out = capsys.readouterr().out
    assert any("stall_ms: 200" in line for line in out.splitlines())
    assert any("coast_ms: 50" in line and "default" in line for line in out.splitlines())
