"""A checker to be fed by hand, with a clock that a test sets."""

from collections.abc import Iterable

from touchd.listen.checker import Checker, Seen
from touchd.listen.rules import Finding

from clients.bad_senders import frame

ADDRESS = ("127.0.0.1", 40_000)
ELSEWHERE = ("127.0.0.1", 40_001)
FRAME_NS = 16_666_667
SECOND_NS = 1_000_000_000
STILL = {1: (0.5, 0.5)}


class Listening:
    """A checker whose clock goes on by a frame with each datagram."""

    def __init__(self) -> None:
        self.checker = Checker()
        self.t_ns = 0
        self.findings: list[Finding] = []
        self.seen: list[str] = []

    def hear(self, *datagrams: bytes, address: tuple[str, int] = ADDRESS) -> None:
        for datagram in datagrams:
            self.t_ns += FRAME_NS
            self.take(self.checker.feed(datagram, address, self.t_ns))

    def take(self, notes: Iterable[object]) -> None:
        for note in notes:
            if isinstance(note, Finding):
                self.findings.append(note)
            elif isinstance(note, Seen):
                self.seen.append(f"{note.event.change} {note.event.session_id}")

    def wait(self, seconds: float) -> None:
        self.t_ns += round(seconds * SECOND_NS)

    def broken(self) -> list[str]:
        """End the listening, and return the rules that were broken, each once."""
        self.take(self.checker.finish(self.t_ns))
        return list(dict.fromkeys(finding.rule.name for finding in self.findings))

    def told(self, rule: str) -> str:
        """Return what was said first of a rule, without the effect and the remedy."""
        return next(each.found for each in self.findings if each.rule.name == rule)


def moving(first: int, last: int) -> list[bytes]:
    """Return the frames of a cursor that never rests."""
    return [frame(number, {1: (number / 1000, 0.5)}) for number in range(first, last + 1)]
