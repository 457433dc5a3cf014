"""What the monitor says: a line for each thing as it happens, and the summary for people and for programs."""

import json
import textwrap
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from touchd.errors import ExitCode
from touchd.listen.checker import Appeared, Note, Seen
from touchd.listen.cursors import Change
from touchd.listen.pace import Apart, Window
from touchd.listen.rules import Finding, Severity
from touchd.listen.sender import Sender, Totals

_MOST_ENTRIES = 1000


@dataclass(slots=True)
class Entry:
    """A rule that one sender broke: how often, and how it did first."""

    first: Finding
    count: int


class Ledger:
    """Counts findings by rule and by sender's name."""

    def __init__(self) -> None:
        self._entries: dict[tuple[str, str], Entry] = {}

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What was found, faults before advice, in the order of first occurrence."""
        return tuple(sorted(self._entries.values(), key=lambda each: each.first.rule.severity is Severity.ADVICE))

    def note(self, finding: Finding) -> bool:
        """Count a finding, and return whether it is the first of its kind."""
        entry = self._entries.get((finding.rule.name, finding.name))
        if entry is not None:
            entry.count += 1
            return False
        if len(self._entries) < _MOST_ENTRIES:
            self._entries[finding.rule.name, finding.name] = Entry(finding, 1)
            return True
        return False


class LiveLines:
    """Words for what happens, with the seconds since ``start_ns`` before them."""

    def __init__(self, start_ns: int, moves: bool, columns: int) -> None:
        self._start_ns = start_ns
        self._moves = moves
        self._columns = columns
        self._senders = 0

    def of_note(self, note: Note, t_ns: int) -> list[str]:
        """Return the lines for a note; a move is told only where moves are wanted."""
        if isinstance(note, Finding):
            return self._lines(t_ns, _severity_word(note.rule.severity), note.sentence())
        if isinstance(note, Appeared):
            self._senders += 1
            return self._lines(t_ns, "sender", note.sender)
        if note.event.change is Change.MOVE and not self._moves:
            return []
        return self._lines(t_ns, note.event.change.value, self._cursor(note))

    def of_window(self, sender: Sender, window: Window, elapsed_ns: int, t_ns: int) -> list[str]:
        """Return the lines for what a sender sent in the last ``elapsed_ns``."""
        per_second = 1e9 / elapsed_ns
        said = [f"{window.datagrams * per_second:.0f} bundles/s", f"{window.frames * per_second:.0f} frames/s"]
        if window.apart is not None:
            apart = window.apart
            said.append(f"{apart.median_ms:.1f} ms apart (p99 {apart.p99_ms:.1f}, worst {apart.worst_ms:.1f})")
        said += [f"{sender.alive} alive", f"≤ {sender.most_bytes} bytes"]
        return self._lines(t_ns, "rate", self._whose(sender.label) + ", ".join(said))

    def _cursor(self, seen: Seen) -> str:
        event = seen.event
        place = "without a position" if event.x is None else f"at {event.x:.3f}, {event.y:.3f}"
        place += "" if event.z is None else f", {event.z:.3f}"
        return f"{self._whose(seen.sender)}{event.noun} {event.session_id} {place}"

    def _whose(self, label: str) -> str:
        return f"{label}: " if self._senders > 1 else ""

    def _lines(self, t_ns: int, word: str, text: str) -> list[str]:
        head = f"{(t_ns - self._start_ns) / 1e9:7.2f} {word:<6} "
        return textwrap.wrap(
            text, self._columns, initial_indent=head, subsequent_indent=" " * len(head), break_on_hyphens=False
        )


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a whole listening found. ``kernel_drops`` counts datagrams that arrived faster than they were read."""

    port: int
    start_ns: int
    end_ns: int
    datagrams: int
    kernel_drops: int
    senders: tuple[Totals, ...]
    broken: tuple[Entry, ...]
    columns: int

    @property
    def faults(self) -> int:
        """How many rules of severity fault were broken, by sender."""
        return sum(entry.first.rule.severity is Severity.FAULT for entry in self.broken)

    @property
    def exit_code(self) -> ExitCode:
        """0 where no client would break, 65 where one would, 69 where nothing arrived."""
        if self.datagrams == 0:
            return ExitCode.UNAVAILABLE
        return ExitCode.BAD_DATA if self.faults else ExitCode.OK

    def lines(self) -> Iterator[str]:
        """Yield the summary for people."""
        for text in self._texts():
            indent = text[: len(text) - len(text.lstrip())]
            yield from textwrap.wrap(text, self.columns, subsequent_indent=indent, break_on_hyphens=False)

    def as_json(self) -> str:
        """Return the summary for programs; keys may be added, never renamed."""
        summary = {
            "port": self.port,
            "seconds": round(self._seconds(self.end_ns), 3),
            "exit_code": int(self.exit_code),
            "faults": self.faults,
            "advice": len(self.broken) - self.faults,
            "datagrams": self.datagrams,
            "kernel_drops": self.kernel_drops,
            "senders": [asdict(sender) for sender in self.senders],
            "broken": [self._entry_object(entry) for entry in self.broken],
        }
        return json.dumps(summary, indent=2)

    def _texts(self) -> Iterator[str]:
        yield f"listened for {self._seconds(self.end_ns):.1f} s on UDP port {self.port}"
        for sender in self.senders:
            yield from _sender_lines(sender)
        if self.kernel_drops:
            yield (
                f"the kernel dropped {self.kernel_drops} datagrams here: this computer was too slow to check them "
                "all, which is not the sender's fault"
            )
        for entry in self.broken:
            rule = entry.first.rule
            times = "once" if entry.count == 1 else f"{entry.count} times"
            yield f"{_severity_word(rule.severity)} {rule.name}, {times}, at {self._seconds(entry.first.t_ns):.2f} s:"
            yield f"    {entry.first.sentence()}"
        yield self._conclusion()

    def _entry_object(self, entry: Entry) -> dict[str, object]:
        first = entry.first
        return {
            "rule": first.rule.name,
            "severity": first.rule.severity.value,
            "sender": first.name,
            "count": entry.count,
            "first_s": round(self._seconds(first.t_ns), 3),
            "first": first.sentence(),
        }

    def _conclusion(self) -> str:
        if self.datagrams == 0:
            return (
                "nothing arrived: check that the sender's destination is this computer and this port, "
                "and that no firewall is in between"
            )
        advice = len(self.broken) - self.faults
        if self.faults:
            return f"{_counted(self.faults, 'fault')} and {advice} advice: real clients break with this sender"
        return f"no fault and {advice} advice: no client breaks" if advice else "no rule is broken"

    def _seconds(self, t_ns: int) -> float:
        return (t_ns - self.start_ns) / 1e9


def _sender_lines(sender: Totals) -> Iterator[str]:
    yield f"{sender.name} ({sender.address}), {', '.join(sender.profiles) or 'no TUIO frame'}"
    apart = "" if sender.apart is None else f", {_apart_words(sender.apart)}"
    yield f"    {sender.frames} frames{apart}"
    yield f"    {_counted(sender.datagrams, 'datagram')}, the largest of {sender.most_bytes} bytes"
    yield (
        f"    touches: {sender.adds} added, {sender.removes} removed, {sender.alive} alive at the end, "
        f"at most {sender.most_alive} at a time"
    )
    if sender.lost or sender.late:
        yield f"    lost on the way: {sender.lost} frames (numbers that are missing), late: {sender.late}"


def _apart_words(apart: Apart) -> str:
    return f"{apart.median_ms:.1f} ms apart in the median (p99 {apart.p99_ms:.1f}, worst {apart.worst_ms:.1f})"


def _severity_word(severity: Severity) -> str:
    return "FAULT" if severity is Severity.FAULT else "advice"


def _counted(number: int, noun: str) -> str:
    return f"1 {noun}" if number == 1 else f"{number} {noun}s"
