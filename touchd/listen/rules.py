"""The rules that a TUIO 1.1 sender is held to: which client each of them protects, and what a sender is to do.

Sources: the TUIO 1.1 specification (tuio.org), and trials with Qt 6's TuioTouch plugin, Kivy, python-tuio, the npm
package tuio-client, liblo's oscdump and the reference clients in C++, Java and C#.
"""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """A fault breaks a real client; advice is about what is legal but fragile."""

    FAULT = "fault"
    ADVICE = "advice"


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule: its name for programs, what happens in clients when it is broken, and the remedy, as sentences."""

    name: str
    severity: Severity
    effect: str
    remedy: str


@dataclass(frozen=True, slots=True)
class Breach:
    """One breach of a rule: what was found, as a sentence without its full stop, and in which frame."""

    rule: Rule
    found: str
    fseq: int | None = None


@dataclass(frozen=True, slots=True)
class Finding:
    """A breach, and the sender (its name, and its address with the port) and the time of it."""

    rule: Rule
    name: str
    address: str
    found: str
    fseq: int | None
    t_ns: int

    def sentence(self) -> str:
        """Return where and what was found, what it does to clients, and what to do."""
        sender = f"{self.name} ({self.address})"
        place = sender if self.fseq is None else f"{sender}, fseq {self.fseq}"
        return f"{place}: {self.found}. {self.rule.effect} {self.rule.remedy}"


def _fault(name: str, effect: str, remedy: str) -> Rule:
    return Rule(name, Severity.FAULT, effect, remedy)


def _advice(name: str, effect: str, remedy: str) -> Rule:
    return Rule(name, Severity.ADVICE, effect, remedy)


_NO_TOUCH = "Touches are lost, pressed at (0, 0), or end the listening thread of Java and Kivy."

# The datagram
MALFORMED = _fault(
    "malformed",
    "Clients drop the whole datagram, or their listening thread ends.",
    "Build datagrams with an OSC library, and send each with one call.",
)
NO_BUNDLE = _fault(
    "no-bundle",
    "Qt drops messages that are in no bundle.",
    "Send source, alive, every set and fseq of a frame in one bundle.",
)
TOO_LARGE = _fault(
    "too-large",
    "The C++ client aborts above 4098.",
    "Send at most 4096 bytes, and split larger frames with a growing alive.",
)
FRAGMENTED = _advice(
    "fragmented",
    "Above 1472 the network cuts datagrams up and loses all of one with any piece.",
    "Split frames at 1472 bytes with a growing alive.",
)
TIME_TAG = _advice(
    "time-tag", "OSC libraries may hold the bundle back until then.", "Give bundles the time tag 1, immediately."
)
EMPTY_BUNDLE = _advice("empty-bundle", "It tells clients nothing.", "Send alive and fseq as a sign of life.")

# Messages
NO_SOURCE = _advice("no-source", "Clients cannot tell senders apart.", 'Begin each bundle with source "name@address".')
NO_ALIVE = _fault(
    "no-alive", "Clients end no cursor, and Qt and python-tuio begin none.", "Send alive in every bundle, also empty."
)
NO_FSEQ = _fault("no-fseq", "Clients wait for it and show nothing.", "End every bundle with fseq.")
ORDER = _fault(
    "order",
    "Touches are lost, or pressed at (0, 0).",
    "Send source, alive, every set, then fseq.",
)
TYPES = _fault("types", _NO_TOUCH, "Give every argument the type of the specification explicitly.")
ARGUMENTS = _fault("arguments", _NO_TOUCH, "Send all arguments of the specification, with zeros for the unknown.")
UNKNOWN_WORD = _fault(
    "unknown-word",
    "python-tuio raises an exception at it, and Qt logs a warning each time.",
    "Send none but source, alive, set and fseq.",
)
UNKNOWN_ADDRESS = _advice(
    "unknown-address", "Clients ignore it, and Qt logs a warning each time.", "Send it to a port of its own."
)
TUIO_2 = _fault(
    "tuio-2", "TUIO 1.1 clients do not know it; Kivy's thread can end at it.", "Send TUIO 2.0 to a port of its own."
)
MIXED_PROFILES = _fault(
    "mixed-profiles",
    "Kivy doubles touches or its thread ends, and Qt logs a warning for each message.",
    "Send each profile to a port of its own.",
)
NOT_FINITE = _fault(
    "not-finite", "It stays in the C++ client for the cursor's whole life.", "Leave out a cursor without a position."
)
OUT_OF_RANGE = _fault(
    "out-of-range", "Clients place the touch outside their window.", "Clamp positions to 0..1, or end the cursor."
)
LOW_ID = _advice("low-id", "Some clients take 0 or -1 for no cursor at all.", "Count session ids from 1.")

# Frame numbers
FSEQ_BACK = _fault(
    "fseq-back",
    "C++, Java and .NET clients drop everything until it catches up, and JS adds touches twice.",
    "Begin each run above the last fseq, for example with the time in hundredths of a second.",
)
FSEQ_FAR_BACK = _advice(
    "fseq-far-back",
    "Clients accept a step of more than 100, but after a shorter run they drop everything.",
    "Begin each run above the last fseq, for example with the time in hundredths of a second.",
)
FSEQ_STANDS = _advice(
    "fseq-stands", "Clients cannot tell a late datagram from a new one.", "Raise fseq by 1 with each frame."
)
FSEQ_APART = _fault(
    "fseq-apart", "Clients keep one counter and drop one of the profiles.", "Use one counter for all profiles."
)
FSEQ_NEGATIVE = _advice(
    "fseq-negative", "Clients take it for a repetition, as they do -1.", "Number frames from 1 and wrap back to 1."
)
FSEQ_NEWS = _advice(
    "fseq-redundant-news",
    "fseq -1 marks a bundle that only repeats, so a late one is not told from a new one.",
    "Give frames that bring news an fseq that rises.",
)

# Cursors
PHANTOM = _fault("phantom", "Qt and python-tuio press at (0, 0).", "Set a cursor in the bundle that first lists it.")
LATE_JOINER = _advice(
    "late-joiner",
    "Qt and python-tuio press it at (0, 0) when they start late.",
    "Set every living cursor in every frame.",
)
CHANGES_ONLY = _advice(
    "changes-only",
    "A client that starts late, or loses a datagram, does not learn where a still finger is.",
    "Set every living cursor in every frame.",
)
NOT_ALIVE = _fault("not-alive", "Qt and python-tuio ignore the set.", "List every cursor that is set in alive.")
TWICE_ALIVE = _fault("twice-alive", "Qt presses it anew at (0, 0).", "List each cursor once.")
SPLIT_COMPLETE = _fault(
    "split-complete",
    "Qt and python-tuio press those at (0, 0).",
    "List in each datagram only the old cursors and those set so far.",
)
SPLIT_OWN = _fault(
    "split-own",
    "Every client deletes those cursors.",
    "List in each datagram the old cursors and all those set so far.",
)
REUSED_ID = _advice(
    "reused-id", "When the removal is lost, clients draw a line to the new place.", "Give each touch a new session id."
)
FLICKER = _advice(
    "flicker", "Clients see a drag end and a new touch begin.", "Let a cursor coast for a few frames before it ends."
)
STALE_VELOCITY = _advice(
    "stale-velocity", "Clients that coast or predict move it on.", "Send zeros once a finger rests."
)

# Time and neighbours
STALLED = _fault(
    "stalled",
    "Clients keep stuck touches meanwhile.",
    "When frames stall, send an empty bundle with fseq -1.",
)
SILENT = _advice(
    "silent", "Clients cannot tell a still finger from a dead sender.", "Repeat the living cursors in every frame."
)
STUCK = _fault(
    "stuck",
    "Clients keep stuck touches.",
    "At the end send an empty bundle with fseq -1, or repeat living cursors at least each second.",
)
SAME_NAME = _fault(
    "same-name", "The C++ client merges them, and cursors flap.", "Give each sender a name of its own before the @."
)
TWO_SENDERS = _fault(
    "two-senders",
    "All but the C++ client end one's cursors at the other's alive.",
    "Send to a port for each, or stop one.",
)
SHARED_PORT = _advice(
    "shared-port", "With touches, all but the C++ client mix them up.", "Send to a port for each, or stop one."
)
