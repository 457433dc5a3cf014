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
from typing import TYPE_CHECKING

from touchd.arguments import command_line
from touchd.errors import ExitCode, TouchdError

if TYPE_CHECKING:
    from types import FrameType

    from touchd.control.commands import Terminal

# The commands import what they need when they run, so that --version or a wrong word need not wait for numpy.


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command and return the process's exit code. Errors go to stderr as one sentence."""
    try:
        options = command_line().parse_args(arguments)
        code = _COMMANDS[options.command](options) or ExitCode.OK
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

    align(find_control_socket(os.environ, options.socket), options.points, options.sides, _terminal())


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


def _bench_accuracy(options: argparse.Namespace) -> None:
    from touchd.lab.accuracy.command import AccuracyOptions, accuracy

    wanted = AccuracyOptions(
        options.scenes,
        options.heights,
        options.methods,
        options.seeds,
        options.sweep,
        options.jobs,
        options.keep,
        options.frames,
        options.form,
    )
    for line in accuracy(wanted, _to_stderr):
        print(line)


def _lab_scenes(_options: argparse.Namespace) -> None:
    from touchd.lab.scenes import LAB_SCENES

    for name, meaning in LAB_SCENES.items():
        print(f"{name:22s}{meaning}")


def _lab_limits(options: argparse.Namespace) -> None:
    from touchd.lab.limits import limits

    for line in limits(options.scenes, options.heights, options.seeds):
        print(line, flush=True)


def _lab_render(options: argparse.Namespace) -> None:
    from touchd.lab.render import render

    render(options.scene, options.height, options.seed, options.folder, _to_stderr)


def _lab_score(options: argparse.Namespace) -> None:
    from touchd.lab.score import score_events

    size_mm = tuple(options.size_mm) if options.size_mm else None
    for line in score_events(options.events, options.truth, size_mm, options.json):
        print(line)


def _bench_kinect(options: argparse.Namespace) -> None:
    from touchd.lab.bench_kinect import bench_kinect

    for line in bench_kinect(options.seconds, options.serial):
        print(line, flush=True)


_COMMANDS: dict[str, Callable[[argparse.Namespace], int | None]] = {
    "run": _run,
    "demo": _demo,
    "replay": _replay,
    "status": _status,
    "calibrate": _calibrate,
    "align": _align,
    "lift": _lift,
    "list": _list,
    "doctor": _doctor,
    "check-config": _check_config,
    "show-config": _show_config,
    "listen": _listen,
    "bench": _bench,
    "bench kinect": _bench_kinect,
    "bench accuracy": _bench_accuracy,
    "lab scenes": _lab_scenes,
    "lab limits": _lab_limits,
    "lab render": _lab_render,
    "lab score": _lab_score,
}
