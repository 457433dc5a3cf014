"""The commands that talk to a running daemon, in words for a terminal."""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from touchd.align.hold import Phase
from touchd.control.client import fetch_status, request
from touchd.control.errors import ControlError, Refused
from touchd.errors import TouchdError
from touchd.model import State
from touchd.status.data import Status
from touchd.status.prometheus import prometheus
from touchd.status.text import check, status_lines, unreachable

_REDRAW_S = 1.0  # between two lines of progress where no terminal can redraw one
_MUCH_MM = 5.0  # a finger is put down more exactly than this
_CLEAR = "\r\x1b[K"  # back to the line's begin, and erase to its end (ECMA-48, EL)


def _for_people(status: Status) -> str:
    return "".join(f"{line}\n" for line in status_lines(status))


def _as_json(status: Status) -> str:
    return json.dumps(status.as_json(), indent=2, allow_nan=False) + "\n"


STATUS_PAGES: dict[str, Callable[[Status], str]] = {
    "people": _for_people,
    "json": _as_json,
    "prometheus": prometheus,
}


def status_page(socket_path: Path, form: str) -> str:
    """Return the status in one of the forms of ``STATUS_PAGES``. Raises TouchdError if there is none to be had."""
    return STATUS_PAGES[form](fetch_status(socket_path))


def check_daemon(find_socket: Callable[[], Path]) -> tuple[int, str]:
    """Return the verdict for monitoring: 0, 1 or 2, and a sentence. A daemon that does not answer is critical."""
    try:
        return check(fetch_status(find_socket()))
    except TouchdError as error:
        return unreachable(str(error))


@dataclass(frozen=True, slots=True)
class Line:
    """Something to show: to stay, or until the next one."""

    text: str
    lasting: bool = False


@dataclass(frozen=True, slots=True)
class Terminal:
    """Shows progress: on one line that is redrawn, or where that cannot be, as a new line now and then.

    ``write`` must flush; ``now_s`` is a steady clock.
    """

    write: Callable[[str], object]
    redraws: bool
    columns: int
    now_s: Callable[[], float]

    def show(self, lines: Iterable[Line]) -> None:
        """Show lines as they come."""
        if self.redraws:
            self._redraw(lines)
        else:
            self._print(lines)

    def _redraw(self, lines: Iterable[Line]) -> None:
        try:
            for line in lines:
                text = line.text if line.lasting else line.text[: self.columns - 1]
                self.write(f"{_CLEAR}{text}" + ("\n" if line.lasting else ""))
        finally:
            self.write(_CLEAR)

    def _print(self, lines: Iterable[Line]) -> None:
        last_text, next_s = "", self.now_s()
        for line in lines:
            due = line.text != last_text and self.now_s() >= next_s
            if line.lasting or due:
                self.write(f"{line.text}\n")
                last_text, next_s = line.text, self.now_s() + _REDRAW_S


def calibrate(socket_path: Path) -> Iterator[Line]:
    """Have the daemon learn the surface anew; yield how far it is.

    Raises Refused with the daemon's reason and exit code if it gave up, and what :func:`request` raises.
    """
    for progress in request(socket_path, "calibrate"):
        why = f": {progress['why']}" if progress["why"] else ""
        if not progress["done"]:
            begun = progress["state"] == State.CALIBRATING
            yield Line(f"calibrating{why}" if begun else f"about to calibrate{why}")
        elif progress["ok"]:
            yield Line(f"calibrated{why}", lasting=True)
        else:
            raise Refused(progress["why"] or "touchd gave up calibrating, and does not say why", progress["exit_code"])


def align(socket_path: Path, points: int, sides: int, terminal: Terminal) -> None:
    """Lead the user through an alignment. Raises what :func:`request` does; on Ctrl-C the old area stays."""
    try:
        terminal.show(align_lines(socket_path, points, sides))
    except KeyboardInterrupt:
        terminal.write("alignment ended: the area stays as it was\n")
        raise


def align_lines(socket_path: Path, points: int, sides: int = 1) -> Iterator[Line]:
    """Align the running daemon; yield what the user is to do, and what came of it. Raises what :func:`request` does."""
    again = "" if sides == 1 else " Then go to another side of the table, best the opposite one, and touch them again."
    yield Line(
        f"You will be asked to touch {points} points of the area, as you see it from where its users stand. Touch each "
        f"with one finger and hold it still.{again} Ctrl-C ends this and changes nothing.",
        lasting=True,
    )
    told = 0
    with closing(request(socket_path, "align", {"points": points, "sides": sides})) as answers:
        for progress in answers:
            place = f"[{progress['point']}/{progress['points']}] {progress['target']}"
            held = progress["phase"] == Phase.LIFT and not progress["why"]
            if progress["done"]:
                yield from (Line(text, lasting=True) for text in _outcome(progress))
            elif held and progress["point"] > told:
                told = progress["point"]
                yield Line(f"{place}: got it, lift your finger", lasting=True)
            elif not held:
                yield Line(f"{place}: {_to_do(progress)}")


def _to_do(progress: dict[str, Any]) -> str:
    why = f" ({progress['why']})" if progress["why"] else ""
    if progress["phase"] == Phase.HOLD:
        return f"hold still, {progress['share']:.0%}"
    if progress["phase"] == Phase.LIFT:
        return f"lift your finger{why}"
    return f"touch it and hold{why}"


def _outcome(progress: dict[str, Any]) -> Iterator[str]:
    if progress["residual_mm"] is None or progress["size_mm"] is None:
        raise ControlError("touchd ended the alignment without a result; is it of another version? restart it")
    width_mm, height_mm = progress["size_mm"]
    kept = f"kept in {progress['kept_in']}" if progress["kept_in"] else "not kept, so gone at the next start"
    yield (
        f"aligned and in force: {width_mm:.0f} x {height_mm:.0f} mm, residual {progress['residual_mm']:.1f} mm; {kept}"
    )
    if progress.get("eye"):
        sides = ", ".join(f"{mm:.1f} mm from the {side}" for side, mm in progress["eye"].items())
        yield f"people aim ahead of their touch by {sides}; touches are told so much farther along the finger"
    if progress["why"]:
        yield progress["why"]
    if progress["residual_mm"] > _MUCH_MM:
        yield (
            f"A residual over {_MUCH_MM:.0f} mm is much: were the points touched exactly, and is the area a rectangle?"
            " Run touchd align again to be sure."
        )
