"""The checker: datagrams in, what they tell and what is wrong with them out. No socket and no clock."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from touchd.listen.cursors import CursorEvent
from touchd.listen.messages import Part, Reading, read
from touchd.listen.osc import IMMEDIATELY, Malformed, OscBundle, decode
from touchd.listen.rules import (
    EMPTY_BUNDLE,
    MALFORMED,
    MIXED_PROFILES,
    NO_BUNDLE,
    SAME_NAME,
    SHARED_PORT,
    TIME_TAG,
    TWO_SENDERS,
    Breach,
    Finding,
)
from touchd.listen.sender import Address, Sender, Totals, shown

_MOST_SENDERS = 100  # one that changes its name with each datagram must not fill the memory


@dataclass(frozen=True, slots=True)
class Appeared:
    """A sender's first datagram; ``sender`` is its name and address."""

    sender: str


@dataclass(frozen=True, slots=True)
class Seen:
    """A cursor's change, and whose it is."""

    sender: str
    event: CursorEvent


Note: TypeAlias = Appeared | Seen | Finding


class Checker:
    """Holds everything that arrives at one port against the rules of TUIO 1.1."""

    def __init__(self) -> None:
        self._senders: dict[tuple[str | None, Address], Sender] = {}
        self._last_from: dict[Address, Sender] = {}
        self._profiles: dict[str, None] = {}
        self.datagrams = 0

    @property
    def senders(self) -> tuple[Sender, ...]:
        """The senders in the order of their first datagrams."""
        return tuple(self._senders.values())

    @property
    def frames(self) -> int:
        """How many frames came from all senders together."""
        return sum(sender.pace.frames for sender in self._senders.values())

    def totals(self) -> tuple[Totals, ...]:
        """Return the figures of each sender."""
        return tuple(sender.totals() for sender in self._senders.values())

    def feed(self, datagram: bytes, address: Address, t_ns: int) -> tuple[Note, ...]:
        """Take a datagram that came from ``address`` (host, port) at ``t_ns``, and return what comes of it in order.

        A frame as a whole is judged when the next one begins. Never raises, whatever the bytes.
        """
        self.datagrams += 1
        notes: list[Note] = []
        decoded = decode(datagram)
        bundled = () if isinstance(decoded, Malformed) else decoded
        readings = [read(bundle.messages) for bundle in bundled if bundle.time_tag is not None]
        source = next((reading.source for reading in readings if reading.source is not None), None)
        known = len(self._senders)
        sender = self._sender(source, address)
        if len(self._senders) > known:
            notes.append(Appeared(sender.label))
        breaches = [*self._check_neighbours(sender), *sender.note_datagram(len(datagram))]
        if isinstance(decoded, Malformed):
            breaches.append(Breach(MALFORMED, f"byte {decoded.offset} of {len(datagram)}: {decoded.problem}"))
        else:
            if not any(bundle.messages for bundle in decoded):
                breaches.append(Breach(EMPTY_BUNDLE, "a bundle has no messages"))
            for bundle in decoded:
                breaches += _check_bundle(bundle)
        notes += [_finding(breach, sender, t_ns) for breach in breaches]
        for reading in readings:
            notes += self._take(reading, sender, t_ns)
        sender.last_ns = t_ns
        return tuple(notes)

    def finish(self, t_ns: int) -> tuple[Note, ...]:
        """End the listening at ``t_ns``, and return what is wrong with how it ends."""
        return tuple(
            _finding(breach, sender, t_ns) for sender in self._senders.values() for breach in sender.finish(t_ns)
        )

    def _take(self, reading: Reading, sender: Sender, t_ns: int) -> Iterator[Note]:
        for breach in reading.breaches:
            yield _finding(breach, sender, t_ns)
        for part in reading.parts:
            for breach in self._check_profile(part):
                yield _finding(breach, sender, t_ns)
            for each in sender.take(part, t_ns):
                yield Seen(sender.label, each) if isinstance(each, CursorEvent) else _finding(each, sender, t_ns)

    def _sender(self, source: str | None, address: Address) -> Sender:
        """Return whose datagram it is. One without a source is of whoever sent the last from that address."""
        if source is None and address in self._last_from:
            return self._last_from[address]
        sender = self._senders.get((source, address))
        if sender is None:
            sender = self._newcomer(source, address)
        self._last_from[address] = sender
        return sender

    def _newcomer(self, source: str | None, address: Address) -> Sender:
        """Return the sender for a name that was not heard from this address: a new one, or one that has moved."""
        sender = self._senders.pop((None, address), None)
        if sender is not None:
            sender.source = source
        else:
            sender = self._moved(source, address) or Sender(source, address)
        if len(self._senders) >= _MOST_SENDERS:
            oldest = self._senders.pop(next(iter(self._senders)))
            self._last_from.pop(oldest.address, None)
        self._senders[source, address] = sender
        return sender

    def _moved(self, source: str | None, address: Address) -> Sender | None:
        """Return the sender of that name and host that has been silent longest, if it may have moved here."""
        kin = [each for each in self._senders.values() if each.source == source and each.address[0] == address[0]]
        if not kin:
            return None
        sender = min(kin, key=lambda each: each.turn)
        if address in sender.former:  # it never moved: here are two
            sender.part_from(address)
            return None
        del self._senders[source, sender.address]
        self._last_from.pop(sender.address, None)
        sender.move_to(address)
        return sender

    def _check_neighbours(self, sender: Sender) -> Iterator[Breach]:
        """Yield a breach for a sender that speaks in turn with another; one that only follows it has replaced it."""
        turn = sender.turn
        sender.turn = self.datagrams
        if turn == 0:
            return
        for other in self._senders.values():
            if other is sender or other.turn < turn:
                continue
            if other.source == sender.source is not None:
                yield Breach(SAME_NAME, f"{shown(other.address)} sends under the same name")
            elif sender.alive or other.alive:
                yield Breach(TWO_SENDERS, f"{other.label} sends to the same port")
            else:
                yield Breach(SHARED_PORT, f"{other.label} sends to the same port")

    def _check_profile(self, part: Part) -> Iterator[Breach]:
        name = part.profile.name
        self._profiles[name] = None
        first = next(iter(self._profiles))
        if name != first:
            yield Breach(MIXED_PROFILES, f"{name} comes to a port that gets {first} as well", part.fseq)


def _check_bundle(bundle: OscBundle) -> Iterator[Breach]:
    if bundle.time_tag is None:
        yield Breach(NO_BUNDLE, f'a message to "{bundle.messages[0].address[:40]}" is in no bundle')
    elif bundle.time_tag != IMMEDIATELY:
        yield Breach(TIME_TAG, f"the bundle's time tag is {bundle.time_tag:#018x}")


def _finding(breach: Breach, sender: Sender, t_ns: int) -> Finding:
    return Finding(breach.rule, sender.name, shown(sender.address), breach.found, breach.fseq, t_ns)
