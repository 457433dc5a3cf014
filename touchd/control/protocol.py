"""What is said over the control socket.

A client sends one line of JSON, ``{"command": "status"}``, and reads lines of JSON until one has ``"done": true``.
A line has "progress" (an object) while a command is at work, "result" (an object) when it is done, or "error" (a
sentence) and "exit_code". ``align`` takes "points" and "sides". Keys may be added, never renamed.
"""

import json
import logging
import threading
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol, TypeAlias

from touchd.align.session import AlignProgress
from touchd.errors import ExitCode, TouchdError
from touchd.model import State
from touchd.status.data import Status

log = logging.getLogger(__name__)

Reply: TypeAlias = dict[str, Any]
Arguments: TypeAlias = Mapping[str, object]

COMMANDS = ("status", "calibrate", "reload", "align")
_LONGEST_ECHO = 40


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a calibration is; the last one is ``done``, and says whether it is ``ok`` or ended with ``exit_code``."""

    state: State
    why: str | None
    done: bool = False
    ok: bool = False
    exit_code: int = ExitCode.OK


class Controls(Protocol):
    """What a daemon lets itself be asked for. Called from threads of the server, several at a time.

    The generators yield at least twice a second, also when nothing has changed, until they yield what is ``done``:
    only so is it noticed that whoever asked has gone, or that the daemon stops. They are closed then, before their
    end. Only one of them is at work at a time. All may raise TouchdError, which goes to whoever asked.
    """

    def status(self) -> Status:
        """Return how the daemon fares."""

    def calibrate(self) -> Generator[Progress]:
        """Learn the surface anew. When the generator is closed early the calibration goes on."""

    def reload(self) -> str:
        """Read the config file again and say what was changed. Raises ConfigError if it cannot be used."""

    def align(self, points: int, sides: int) -> Generator[AlignProgress]:
        """Find the active area by that many touches from each of so many sides.

        When the generator is closed early the old area stays.
        """


class Refusal(TouchdError):
    """The request makes no sense."""

    exit_code = ExitCode.USAGE


class Busy(TouchdError):
    """The daemon is at work on another request."""

    exit_code = ExitCode.TRY_AGAIN


class Answerer:
    """Turns requests into replies. Use it from any number of threads."""

    def __init__(self, controls: Controls) -> None:
        self._controls = controls
        self._at_work = threading.Lock()

    def replies(self, line: bytes) -> Generator[Reply]:
        """Yield the replies to one request, whatever it is; the last is done. Raises nothing."""
        try:
            command, arguments = parse_request(line)
            yield from self._carry_out(command, arguments)
        except TouchdError as error:
            yield error_reply(str(error), error.exit_code)
        except Exception:
            log.exception("a request on the control socket failed")
            yield error_reply("touchd failed at this; its log says more: this is a bug, please report it", ExitCode.BUG)

    def _carry_out(self, command: str, arguments: Arguments) -> Iterator[Reply]:
        jobs: dict[str, Callable[[], Iterator[Reply]]] = {
            "status": lambda: _result(self._controls.status().as_json()),
            "reload": lambda: _result({"applied": self._controls.reload()}),
            "calibrate": lambda: self._alone(self._controls.calibrate),
            "align": lambda: self._align(arguments),
        }
        return jobs[command]()

    def _align(self, arguments: Arguments) -> Iterator[Reply]:
        points = arguments.get("points", 4)
        if not isinstance(points, int) or points not in (4, 9):
            raise Refusal(f'"points" is 4 or 9, found {_echo(points)}')
        sides = arguments.get("sides", 1)
        if not isinstance(sides, int) or isinstance(sides, bool) or sides not in (1, 2):
            raise Refusal(f'"sides" is 1 or 2, found {_echo(sides)}')
        yield from self._alone(lambda: self._controls.align(points, sides))

    def _alone(self, begin: Callable[[], Generator[Progress] | Generator[AlignProgress]]) -> Iterator[Reply]:
        if not self._at_work.acquire(blocking=False):
            raise Busy("touchd is calibrating or being aligned for somebody else; try again when that has ended")
        try:
            work = begin()
            try:
                for progress in work:
                    yield {"progress": asdict(progress), "done": progress.done}
                    if progress.done:
                        return
            finally:
                _close(work)
        finally:
            self._at_work.release()
        raise Refusal("touchd ended this without a result; try again")


def parse_request(line: bytes) -> tuple[str, Arguments]:
    """Return the command and the arguments of a request. Raises Refusal, saying what is wrong with it."""
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise Refusal('a request is one line of JSON such as {"command": "status"}')
    command = content.pop("command", None)
    if command not in COMMANDS:
        raise Refusal(f"unknown command {_echo(command)}; the commands are {', '.join(COMMANDS)}")
    return command, content


def error_reply(message: str, exit_code: int) -> Reply:
    """Return the reply that says that something is wrong."""
    return {"error": message, "exit_code": int(exit_code), "done": True}


def encoded(reply: Reply) -> bytes:
    """Return a reply as a line."""
    return json.dumps(reply, separators=(",", ":"), allow_nan=False).encode("ascii") + b"\n"


def _close(work: Generator[Progress] | Generator[AlignProgress]) -> None:
    """Close a generator; whoever asked may have gone, so that what goes wrong at that is only logged."""
    try:
        work.close()
    except Exception:
        log.exception("a request on the control socket did not end well")


def _result(content: Reply) -> Iterator[Reply]:
    yield {"result": content, "done": True}


def _echo(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_ECHO else text[:_LONGEST_ECHO] + "..."
