"""The command line: the only module that prints."""

import argparse
import logging
import os
import shutil
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, TypeAlias

from touchd.arguments import count, paced_seconds, positive_seconds, speed, udp_port
from touchd.errors import ExitCode, TouchdError, UsageError
from touchd.table.scenario_names import DEFAULT_SCENARIO, SCENARIOS

if TYPE_CHECKING:
    from types import FrameType

    from touchd.control.commands import Terminal

    Commands: TypeAlias = "argparse._SubParsersAction[_Parser]"  # noqa: SLF001  it has no public name

# The commands import what they need when they run, so that --version or a wrong word need not wait for numpy.


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command and return the process's exit code. Errors go to stderr as one sentence."""
    try:
        options = _parser().parse_args(arguments)
        command: Callable[[argparse.Namespace], int | None] = options.command
        code = command(options) or ExitCode.OK
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
    return code


class _Parser(argparse.ArgumentParser):
    """Reports a wrong command line as an error of the family, so that it gets its exit code."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; see {self.prog} --help")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="touchd", description="Turns any surface under a depth camera into a multi-touch screen.")
    parser.add_argument("--version", action="version", version=f"touchd {version('touchd')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    _add_players(commands)
    _add_daemons(commands)
    _add_cameras(commands)
    _add_tools(commands)
    return parser


def _add_players(commands: "Commands") -> None:
    """Add the commands that turn frames into touches."""
    run = commands.add_parser("run", help="run the daemon until Ctrl-C or SIGTERM")
    run.set_defaults(command=_run)

    demo = commands.add_parser("demo", help="see touches of hands over a synthetic table, without a camera")
    demo.add_argument(
        "--to", default="127.0.0.1:3333", metavar="HOST:PORT", help="where TUIO is sent (default 127.0.0.1:3333)"
    )
    demo.add_argument(
        "--scenario",
        choices=tuple(SCENARIOS),
        default=DEFAULT_SCENARIO,
        help="; ".join(f"{name}: {meaning}" for name, meaning in SCENARIOS.items()),
    )
    demo.add_argument("--seed", type=int, default=1, metavar="N", help="another number, another table (default 1)")
    demo.set_defaults(command=_demo)

    replay = commands.add_parser("replay", help="find the touches in a recording, frame by frame")
    replay.add_argument("path", type=Path, metavar="PATH", help="the recording's folder")
    replay.add_argument("--events", type=Path, metavar="OUT.jsonl", help="write one JSON line a frame")
    replay.add_argument("--surface", type=Path, metavar="FILE", help="use this stored surface, do not calibrate")
    replay.add_argument(
        "--speed",
        type=speed,
        default=argparse.SUPPRESS,
        metavar="N|max",
        help="N times the recording's clock (default: 1, max with --events)",
    )
    replay.add_argument("--send", action="store_true", help="also send to the configured outputs")
    replay.set_defaults(command=_replay)
    _takes_config(run, replay)


def _add_daemons(commands: "Commands") -> None:
    """Add the commands that talk to a running daemon, or clean up after one."""
    status = commands.add_parser("status", help="say how the running daemon fares")
    form = status.add_mutually_exclusive_group()
    form.add_argument("--json", dest="form", action="store_const", const="json", help="as JSON")
    form.add_argument(
        "--prometheus", dest="form", action="store_const", const="prometheus", help="as metrics for Prometheus"
    )
    form.add_argument("--check", action="store_true", help="one sentence; exit 0 fine, 1 warning, 2 critical")
    status.set_defaults(command=_status, form="people")

    calibrate = commands.add_parser("calibrate", help="have the running daemon learn the empty surface anew")
    calibrate.set_defaults(command=_calibrate)

    align = commands.add_parser("align", help="find the active area by touching its corners")
    align.add_argument(
        "--points", type=int, choices=(4, 9), default=4, help="the corners alone, or a grid of 3 by 3 (default 4)"
    )
    align.set_defaults(command=_align)
    for command in (status, calibrate, align):
        command.add_argument("--socket", type=Path, metavar="PATH", help="the daemon's control socket")

    lift = commands.add_parser("lift", help="end the touches that a killed daemon left at its clients")
    lift.add_argument(
        "--to", action="append", default=[], metavar="HOST:PORT", help="a client (default: those of the config)"
    )
    lift.set_defaults(command=_lift)
    _takes_config(lift)


def _add_cameras(commands: "Commands") -> None:
    """Add the commands that look for cameras and for what is in their way."""
    listing = commands.add_parser("list", help="list the depth cameras that are plugged in")
    listing.set_defaults(command=_list)
    doctor = commands.add_parser("doctor", help="find what keeps touch from working, and what to do about it")
    doctor.set_defaults(command=_doctor)
    for command in (listing, doctor):
        command.add_argument("--json", action="store_true", help="as JSON")
        command.add_argument("--socket", type=Path, metavar="PATH", help="the daemon's control socket")
    _takes_config(listing, doctor)


def _add_tools(commands: "Commands") -> None:
    """Add the commands about the config and this machine."""
    check = commands.add_parser("check-config", help="say whether the config file is right, and what is wrong")
    check.set_defaults(command=_check_config)
    show = commands.add_parser("show-config", help="print all settings in force and where each comes from")
    show.set_defaults(command=_show_config)
    _takes_config(check, show)

    listen = commands.add_parser("listen", help="watch a UDP port, and check any TUIO sender for what breaks clients")
    listen.add_argument("port", type=udp_port, nargs="?", default=3333, metavar="PORT", help="(default 3333)")
    listen.add_argument("--host", metavar="ADDRESS", help="listen at this address of the computer alone (default: all)")
    listen.add_argument("--join", metavar="GROUP", help="also join an IPv4 multicast group, such as 239.1.2.3")
    listen.add_argument("--for", dest="seconds", type=positive_seconds, metavar="SECONDS", help="end after this time")
    listen.add_argument("--frames", type=count, metavar="N", help="end after N frames")
    listen.add_argument("--moves", action="store_true", help="also print every move")
    listen.add_argument("--json", action="store_true", help="the summary as JSON on stdout, all else on stderr")
    listen.set_defaults(command=_listen)

    bench = commands.add_parser("bench", help="measure this machine against touchd's time budgets")
    bench.add_argument(
        "--seconds", type=paced_seconds, default=10.0, metavar="S", help="length of each paced run (default 10)"
    )
    bench.set_defaults(command=_bench)


def _takes_config(*commands: argparse.ArgumentParser) -> None:
    for command in commands:
        command.add_argument("--config", type=Path, metavar="FILE", help="the config file (default: see README)")


def _run(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path
    from touchd.run import run

    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    path = find_config_path(options.config, os.environ, os.getuid())
    logging.getLogger(__name__).info("touchd %s, config: %s", version("touchd"), path or "defaults")
    run(path)


def _demo(options: argparse.Namespace) -> None:
    from touchd.demo.run import DemoOptions, demo

    demo(DemoOptions(options.to, options.scenario, options.seed), sys.stdout, os.environ)


def _replay(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path, load_config
    from touchd.replay import ReplayOptions, replay_recording

    def stop(_signal: int, _frame: "FrameType | None") -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    config = load_config(find_config_path(options.config, os.environ, os.getuid()))
    speed = options.speed if "speed" in options else (None if options.events else 1.0)
    wanted = ReplayOptions(options.path, options.events, options.surface, speed, options.send)
    try:
        replay_recording(config, wanted, on_touch=_nowhere if options.events else _at_once, on_note=_to_stderr)
    finally:
        signal.signal(signal.SIGTERM, before)


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


def _status(options: argparse.Namespace) -> int:
    from touchd.control.commands import check_daemon, status_page
    from touchd.control.paths import find_control_socket

    def find() -> Path:
        return find_control_socket(os.environ, options.socket)

    if options.check:
        code, sentence = check_daemon(find)
        print(sentence)
        return code
    print(status_page(find(), options.form), end="")
    return ExitCode.OK


def _calibrate(options: argparse.Namespace) -> None:
    from touchd.control.commands import calibrate
    from touchd.control.paths import find_control_socket

    _terminal().show(calibrate(find_control_socket(os.environ, options.socket)))


def _align(options: argparse.Namespace) -> None:
    from touchd.control.commands import align
    from touchd.control.paths import find_control_socket

    align(find_control_socket(os.environ, options.socket), options.points, _terminal())


def _terminal() -> "Terminal":
    from touchd.control.commands import Terminal

    def write(text: str) -> None:
        print(text, end="", flush=True)

    return Terminal(write, sys.stdout.isatty(), shutil.get_terminal_size().columns, time.monotonic)


def _lift(options: argparse.Namespace) -> None:
    from touchd.config.load import find_config_path, load_config
    from touchd.lift import lift

    config = load_config(find_config_path(options.config, os.environ, os.getuid()))
    for line in lift(config, options.to, os.environ):
        print(line, flush=True)


def _list(options: argparse.Namespace) -> int:
    from touchd.doctor.computer import Computer
    from touchd.doctor.listing import list_cameras, listing_json, listing_lines

    listing = list_cameras(Computer(os.environ), options.config, options.socket)
    print(listing_json(listing) if options.json else "\n".join(listing_lines(listing)))
    return listing.exit_code


def _doctor(options: argparse.Namespace) -> int:
    from touchd.doctor.computer import Computer
    from touchd.doctor.examine import examine
    from touchd.doctor.finding import exit_code_of, report_json, report_lines

    findings = examine(Computer(os.environ), options.config, options.socket)
    print(report_json(findings) if options.json else "\n".join(report_lines(findings)))
    return exit_code_of(findings)


def _listen(options: argparse.Namespace) -> int:
    from touchd.listen.monitor import ListenOptions, monitor

    stop = threading.Event()

    def end(_signal: int, _frame: "FrameType | None") -> None:
        stop.set()

    before = {each: signal.signal(each, end) for each in (signal.SIGINT, signal.SIGTERM)}
    columns = max(80, min(100, shutil.get_terminal_size().columns))
    wanted = ListenOptions(
        options.port, options.host, options.join, options.seconds, options.frames, options.moves, columns
    )
    try:
        verdict = monitor(wanted, _to_stderr if options.json else _at_once, stop)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
    for line in [verdict.as_json()] if options.json else verdict.lines():
        print(line)
    return verdict.exit_code


def _bench(options: argparse.Namespace) -> None:
    from touchd.lab.bench import bench

    for line in bench(options.seconds):
        print(line, flush=True)
