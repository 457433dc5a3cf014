"""The command line: the only module that prints."""

import argparse
import logging
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from touchd.errors import ExitCode, TouchdError, UsageError

if TYPE_CHECKING:
    from types import FrameType

# The commands import what they need when they run, so that --version or a wrong word need not wait for numpy.


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command and return the process's exit code. Errors go to stderr as one sentence."""
    try:
        options = _parser().parse_args(arguments)
        command: Callable[[argparse.Namespace], None] = options.command
        command(options)
        sys.stdout.flush()
    except TouchdError as error:
        print(f"touchd: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        return ExitCode.OK
    except BrokenPipeError:
        # Whoever read our output has gone; Python would complain once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.OK
    except Exception:  # noqa: BLE001  anything unexpected is a bug, and says so
        traceback.print_exc()
        print("touchd: this is a bug; please report it with the lines above", file=sys.stderr)
        return ExitCode.BUG
    return ExitCode.OK


class _Parser(argparse.ArgumentParser):
    """Reports a wrong command line as an error of the family, so that it gets its exit code."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; see {self.prog} --help")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="touchd", description="Turns any surface under a depth camera into a multi-touch screen.")
    parser.add_argument("--version", action="version", version=f"touchd {version('touchd')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    run = commands.add_parser("run", help="run the daemon until Ctrl-C or SIGTERM")
    run.set_defaults(command=_run)

    replay = commands.add_parser("replay", help="find the touches in a recording, frame by frame")
    replay.add_argument("path", type=Path, metavar="PATH", help="the recording's folder")
    replay.add_argument("--events", type=Path, metavar="OUT.jsonl", help="write one JSON line a frame")
    replay.add_argument("--surface", type=Path, metavar="FILE", help="use this stored surface, do not calibrate")
    replay.add_argument(
        "--speed",
        type=_speed,
        default=argparse.SUPPRESS,
        metavar="N|max",
        help="N times the recording's clock (default: 1, max with --events)",
    )
    replay.add_argument("--send", action="store_true", help="also send to the configured outputs")
    replay.set_defaults(command=_replay)

    check = commands.add_parser("check-config", help="say whether the config file is right, and what is wrong")
    check.set_defaults(command=_check_config)
    show = commands.add_parser("show-config", help="print all settings in force and where each comes from")
    show.set_defaults(command=_show_config)
    for command in (run, replay, check, show):
        command.add_argument("--config", type=Path, metavar="FILE", help="the config file (default: see README)")

    bench = commands.add_parser("bench", help="measure this machine against touchd's time budgets")
    bench.add_argument(
        "--seconds", type=_seconds, default=10.0, metavar="S", help="length of each paced run (default 10)"
    )
    bench.set_defaults(command=_bench)
    return parser


def _speed(text: str) -> float | None:
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.0 < speed < 1e6:
        raise argparse.ArgumentTypeError(f"expected a number above 0 or 'max', found {text!r}")
    return speed


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.5 <= seconds <= 600.0:
        raise argparse.ArgumentTypeError(f"expected 0.5 to 600 seconds, found {text!r}")
    return seconds


def _run(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path
    from touchd.service import run

    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    path = find_config_path(options.config, os.environ, os.getuid())
    logging.getLogger(__name__).info("touchd %s, config: %s", version("touchd"), path or "defaults")
    run(path)


def _replay(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path, load_config
    from touchd.replay import ReplayOptions, replay_recording

    def stop(_signal: int, _frame: "FrameType | None") -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    config = load_config(find_config_path(options.config, os.environ, os.getuid()))
    speed = options.speed if "speed" in options else (None if options.events else 1.0)
    wanted = ReplayOptions(options.path, options.events, options.surface, speed, options.send)
    replay_recording(config, wanted, on_touch=_nowhere if options.events else _at_once, on_note=_to_stderr)


def _at_once(line: str) -> None:
    print(line, flush=True)


def _nowhere(_line: str) -> None:
    """Say nothing: the events file tells all."""


def _to_stderr(line: str) -> None:
    print(line, file=sys.stderr)


def _check_config(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path, load_config

    path = find_config_path(options.config, os.environ, os.getuid())
    load_config(path)
    print(f"{path}: right" if path else "no config file was found: the defaults are in force")


def _show_config(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path, load_with_origin
    from touchd.config.show import effective_yaml

    config, origin = load_with_origin(find_config_path(options.config, os.environ, os.getuid()))
    print(effective_yaml(config, origin), end="")


def _bench(options: argparse.Namespace) -> None:
    from touchd.lab.bench import bench

    for line in bench(options.seconds):
        print(line, flush=True)
