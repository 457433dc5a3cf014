"""One sender, by its source name and address: its frame numbers, its cursors, its pace and its silences."""

from collections.abc import Iterator
from dataclasses import dataclass
from ipaddress import ip_address
from typing import TypeAlias

from touchd.listen.cursors import Change, CursorEvent, Cursors
from touchd.listen.messages import Part
from touchd.listen.numbering import FrameNumbers, Judged, Standing
from touchd.listen.pace import Apart, Pace
from touchd.listen.rules import FRAGMENTED, SILENT, STALLED, STUCK, TOO_LARGE, Breach

Address: TypeAlias = tuple[str, int]

_SILENCE_NS = 1_000_000_000
_CPP_CLIENT_BYTES = 4098
_ETHERNET_BYTES = 1472  # an Ethernet frame's 1500 bytes without the headers of IPv4 and UDP
_MOST_SHOWN = 80  # letters of a source name


@dataclass(frozen=True, slots=True)
class Totals:
    """What one sender sent in all. ``lost`` counts missing frame numbers, ``late`` frames that others overtook."""

    name: str
    address: str
    profiles: tuple[str, ...]
    datagrams: int
    frames: int
    adds: int
    removes: int
    alive: int
    most_alive: int
    lost: int
    late: int
    most_bytes: int
    apart: Apart | None


class Sender:
    """Follows one sender. ``address`` may change to another port of the same host, as at a restart."""

    def __init__(self, source: str | None, address: Address) -> None:
        self.source = source
        self.address = address
        self.former: list[Address] = []
        self.last_ns: int | None = None
        self.turn = 0  # the number of its last datagram at this port, from 1
        self.pace = Pace()
        self.most_bytes = 0
        self._most_alive = 0
        self._changes = dict.fromkeys(Change, 0)
        self._new_run = False
        self._fresh_start()

    def _fresh_start(self) -> None:
        self._numbers = FrameNumbers()
        self._cursors: dict[str, Cursors] = {}

    @property
    def name(self) -> str:
        """The source name, safe to print."""
        return _printable(self.source)

    @property
    def label(self) -> str:
        """The name and the address, safe to print."""
        return f"{self.name} ({shown(self.address)})"

    @property
    def alive(self) -> int:
        """How many cursors a client holds of it now."""
        return sum(len(cursors.alive) for cursors in self._cursors.values())

    def move_to(self, address: Address) -> None:
        """Go on at another port: the process was started anew, or opens a socket for each datagram."""
        self.former = [*self.former[-15:], self.address]
        self.address = address
        self._new_run = True

    def part_from(self, address: Address) -> None:
        """Learn that a former address is another sender's after all: what was seen may be of either."""
        self.former.remove(address)
        self._fresh_start()

    def note_datagram(self, size: int) -> Iterator[Breach]:
        """Count a datagram of ``size`` bytes."""
        self.pace.datagrams += 1
        self.most_bytes = max(self.most_bytes, size)
        if size > _CPP_CLIENT_BYTES:
            yield Breach(TOO_LARGE, f"a datagram has {size} bytes")
        elif size > _ETHERNET_BYTES and not _is_loopback(self.address[0]):
            yield Breach(FRAGMENTED, f"a datagram over the network has {size} bytes")

    def take(self, part: Part, t_ns: int) -> Iterator[Breach | CursorEvent]:
        """Take what a datagram at ``t_ns`` says of one profile."""
        judged = self._numbers.judge(part.profile.name, part.fseq)
        yield from judged.breaches
        yield from self._check_silence(part, judged, t_ns)
        self._new_run = False
        cursors = self._cursors.setdefault(part.profile.name, Cursors(part.profile))
        if judged.standing is not Standing.BEHIND:
            for each in cursors.take(part, judged, t_ns):
                if isinstance(each, CursorEvent):
                    self._changes[each.change] += 1
                yield each
            self._most_alive = max(self._most_alive, self.alive)
        if judged.standing in (Standing.NEXT, Standing.RESTARTED):
            self.pace.note_frame(t_ns, live=self.alive > 0)

    def finish(self, t_ns: int) -> Iterator[Breach]:
        """End the listening at ``t_ns``."""
        for cursors in self._cursors.values():
            yield from cursors.close()
        quiet_ns = 0 if self.last_ns is None else t_ns - self.last_ns
        if self.alive and quiet_ns > _SILENCE_NS:
            yield Breach(STUCK, f"nothing came in the last {quiet_ns / 1e9:.1f} s, with {_count(self.alive)} alive")

    def totals(self) -> Totals:
        """Return the figures of a summary."""
        return Totals(
            name=self.name,
            address=shown(self.address),
            profiles=tuple(self._cursors),
            datagrams=self.pace.datagrams,
            frames=self.pace.frames,
            adds=self._changes[Change.ADD],
            removes=self._changes[Change.REMOVE],
            alive=self.alive,
            most_alive=self._most_alive,
            lost=self._numbers.lost,
            late=self._numbers.late,
            most_bytes=self.most_bytes,
            apart=self.pace.apart(),
        )

    def _check_silence(self, part: Part, judged: Judged, t_ns: int) -> Iterator[Breach]:
        """Yield a breach for a pause with living cursors that neither loss nor a new run explains."""
        quiet_ns = 0 if self.last_ns is None else t_ns - self.last_ns
        cleared = judged.standing is Standing.REDUNDANT and not part.alive
        if quiet_ns <= _SILENCE_NS or not self.alive or judged.excused or self._new_run or cleared:
            return
        steady = any(cursors.repeats_still_ones for cursors in self._cursors.values())
        found = f"nothing came for {quiet_ns / 1e9:.1f} s, with {_count(self.alive)} alive"
        yield Breach(STALLED if steady else SILENT, found, part.fseq)


def shown(address: Address) -> str:
    """Return an address as people write it."""
    host, port = address
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _printable(source: str | None) -> str:
    if source is None:
        return "nameless"
    safe = "".join(letter if letter.isprintable() else "?" for letter in source)
    return safe if len(safe) <= _MOST_SHOWN else safe[: _MOST_SHOWN - 1] + "…"


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host.partition("%")[0]).is_loopback
    except ValueError:
        return False


def _count(cursors: int) -> str:
    return "1 cursor" if cursors == 1 else f"{cursors} cursors"
