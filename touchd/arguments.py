"""The command line's words: which commands there are, what they take, and how that is read."""

import argparse
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, TypeAlias

from touchd.errors import UsageError
from touchd.table.scenario_names import DEFAULT_SCENARIO, SCENARIOS

if TYPE_CHECKING:
    Commands: TypeAlias = "argparse._SubParsersAction[Parser]"  # noqa: SLF001  it has no public name


class Parser(argparse.ArgumentParser):
    """Reports a wrong command line as an error of the family, so that it gets its exit code."""

    def error(self, message: str) -> NoReturn:
        """Raise UsageError with the way to help."""
        raise UsageError(f"{message}; see {self.prog} --help")


def command_line() -> argparse.ArgumentParser:
    """Return the parser of all commands; it leaves the name of the one to run in ``command``."""
    parser = Parser(prog="touchd", description="Turns any surface under a depth camera into a multi-touch screen.")
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
    run.set_defaults(command="run")

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
    demo.set_defaults(command="demo")

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
    replay.set_defaults(command="replay")
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
    status.set_defaults(command="status", form="people")

    calibrate = commands.add_parser("calibrate", help="have the running daemon learn the empty surface anew")
    calibrate.set_defaults(command="calibrate")

    align = commands.add_parser("align", help="find the active area by touching its corners")
    align.add_argument(
        "--points", type=int, choices=(4, 9), default=4, help="the corners alone, or a grid of 3 by 3 (default 4)"
    )
    align.add_argument(
        "--eye",
        action="store_const",
        const=2,
        default=1,
        dest="sides",
        help="touch the points from two sides, which tells how far ahead of their touch people aim",
    )
    align.set_defaults(command="align")
    for command in (status, calibrate, align):
        command.add_argument("--socket", type=Path, metavar="PATH", help="the daemon's control socket")

    lift = commands.add_parser("lift", help="end the touches that a killed daemon left at its clients")
    lift.add_argument(
        "--to", action="append", default=[], metavar="HOST:PORT", help="a client (default: those of the config)"
    )
    lift.set_defaults(command="lift")
    _takes_config(lift)


def _add_cameras(commands: "Commands") -> None:
    """Add the commands that look for cameras and for what is in their way."""
    listing = commands.add_parser("list", help="list the depth cameras that are plugged in")
    listing.set_defaults(command="list")
    doctor = commands.add_parser("doctor", help="find what keeps touch from working, and what to do about it")
    doctor.set_defaults(command="doctor")
    for command in (listing, doctor):
        command.add_argument("--json", action="store_true", help="as JSON")
        command.add_argument("--socket", type=Path, metavar="PATH", help="the daemon's control socket")
    _takes_config(listing, doctor)


def _add_tools(commands: "Commands") -> None:
    """Add the commands about the config and this machine."""
    check = commands.add_parser("check-config", help="say whether the config file is right, and what is wrong")
    check.set_defaults(command="check-config")
    show = commands.add_parser("show-config", help="print all settings in force and where each comes from")
    show.set_defaults(command="show-config")
    _takes_config(check, show)

    listen = commands.add_parser("listen", help="watch a UDP port, and check any TUIO sender for what breaks clients")
    listen.add_argument("port", type=udp_port, nargs="?", default=3333, metavar="PORT", help="(default 3333)")
    listen.add_argument("--host", metavar="ADDRESS", help="listen at this address of the computer alone (default: all)")
    listen.add_argument("--join", metavar="GROUP", help="also join an IPv4 multicast group, such as 239.1.2.3")
    listen.add_argument("--for", dest="seconds", type=positive_seconds, metavar="SECONDS", help="end after this time")
    listen.add_argument("--frames", type=count, metavar="N", help="end after N frames")
    listen.add_argument("--moves", action="store_true", help="also print every move")
    listen.add_argument("--json", action="store_true", help="the summary as JSON on stdout, all else on stderr")
    listen.set_defaults(command="listen")

    bench = commands.add_parser("bench", help="measure this machine against touchd's time budgets")
    bench.add_argument(
        "--seconds", type=paced_seconds, default=10.0, metavar="S", help="length of each paced run (default 10)"
    )
    bench.set_defaults(command="bench")
    kinds = bench.add_subparsers(metavar="KIND")
    kinect = kinds.add_parser("kinect", help="measure the Kinect that is plugged in")
    kinect.add_argument("--seconds", type=paced_seconds, default=60.0, metavar="S", help="how long (default 60)")
    kinect.add_argument("--serial", metavar="S", help="which Kinect, as source.serial in the config")
    kinect.set_defaults(command="bench kinect")
    _add_accuracy(kinds)
    _add_lab(commands)


def _add_accuracy(kinds: "Commands") -> None:
    accuracy = kinds.add_parser("accuracy", help="measure the touch methods on simulated scenes with exact truth")
    accuracy.add_argument(
        "--scenes", metavar="NAME,…", help="(default: all but stacks and long ones; touchd lab scenes)"
    )
    accuracy.add_argument("--heights", default="750,1000,1500", metavar="MM,…", help="(default 750,1000,1500)")
    accuracy.add_argument("--methods", metavar="NAME,…", help="methods and baselines (default: all)")
    accuracy.add_argument("--seeds", default="101-105", metavar="N-M", help="N-M or N,M,… (default 101-105)")
    accuracy.add_argument("--sweep", metavar="KEY=FIRST:LAST:STEP", help="run each with a config key at these values")
    accuracy.add_argument("--jobs", type=count, default=1, metavar="N", help="processes (default 1)")
    accuracy.add_argument("--keep", type=Path, metavar="FOLDER", help="keep outcomes there; a broken-off run goes on")
    accuracy.add_argument(
        "--frames", type=Path, metavar="FOLDER", help="keep frames there, 65 kB each, for the next method"
    )
    form = accuracy.add_mutually_exclusive_group()
    form.add_argument("--json", dest="form", action="store_const", const="json", help="as JSON")
    form.add_argument("--csv", dest="form", action="store_const", const="csv", help="as CSV, a line for each run")
    accuracy.set_defaults(command="bench accuracy", form="text")


def _add_lab(commands: "Commands") -> None:
    """Add the commands about simulated scenes and their truth."""
    lab = commands.add_parser("lab", help="simulated scenes with exact truth, for any program")
    kinds = lab.add_subparsers(metavar="KIND", required=True)
    scenes = kinds.add_parser("scenes", help="list the scenes")
    scenes.set_defaults(command="lab scenes")
    limits = kinds.add_parser("limits", help="show how much of each touching fingertip an ideal camera sees")
    limits.add_argument("--scenes", metavar="NAME,…", help="(default: all)")
    limits.add_argument("--heights", default="750,1500", metavar="MM,…", help="(default 750,1500)")
    limits.add_argument("--seeds", default="101-105", metavar="N-M", help="N-M or N,M,… (default 101-105)")
    limits.set_defaults(command="lab limits")
    render = kinds.add_parser("render", help="write a scene as a recording with its truth.json")
    render.add_argument("scene", metavar="SCENE")
    render.add_argument("folder", type=Path, metavar="FOLDER", help="a new or empty folder")
    render.add_argument("--height", type=float, default=750.0, metavar="MM", help="of the camera (default 750)")
    render.add_argument("--seed", type=int, default=1, metavar="N", help="another number, other people (default 1)")
    render.set_defaults(command="lab render")
    score = kinds.add_parser("score", help="score a program's events by a truth.json")
    score.add_argument("events", type=Path, metavar="EVENTS", help="JSON lines, as touchd replay --events writes")
    score.add_argument("truth", type=Path, metavar="TRUTH", help="a truth.json, as touchd lab render writes")
    score.add_argument("--size-mm", type=float, nargs=2, metavar=("WIDTH", "HEIGHT"), help="of the area")
    score.add_argument("--json", action="store_true", help="as JSON")
    score.set_defaults(command="lab score")


def _takes_config(*commands: argparse.ArgumentParser) -> None:
    for command in commands:
        command.add_argument("--config", type=Path, metavar="FILE", help="the config file (default: see README)")


def speed(text: str) -> float | None:
    """Read N or "max" (None): how many times a recording's clock to play at."""
    if text == "max":
        return None
    try:
        times = float(text)
    except ValueError:
        times = 0.0
    if not 0.0 < times < 1e6:
        raise argparse.ArgumentTypeError(f"expected a number above 0 or 'max', found {text!r}")
    return times


def paced_seconds(text: str) -> float:
    """Read the length of a paced run in seconds."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.5 <= seconds <= 600.0:
        raise argparse.ArgumentTypeError(f"expected 0.5 to 600 seconds, found {text!r}")
    return seconds


def udp_port(text: str) -> int:
    """Read a UDP port."""
    if not (text.isascii() and text.isdigit() and len(text) <= 5 and 1 <= int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"expected a port from 1 to 65535, found {text!r}")
    return int(text)


def count(text: str) -> int:
    """Read a number of things, at least one."""
    if not (text.isascii() and text.isdigit() and len(text) <= 9 and int(text) > 0):
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, found {text!r}")
    return int(text)


def positive_seconds(text: str) -> float:
    """Read a time in seconds above 0."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < 1e9:
        raise argparse.ArgumentTypeError(f"expected a number of seconds above 0, found {text!r}")
    return seconds
