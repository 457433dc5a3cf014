"""TUIO 1.1 messages: from the messages of an OSC bundle to each profile's part of a frame, and what is wrong in it."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from touchd.listen.osc import Argument, OscMessage
from touchd.listen.rules import (
    ARGUMENTS,
    LOW_ID,
    NO_ALIVE,
    NO_FSEQ,
    NO_SOURCE,
    NOT_ALIVE,
    NOT_FINITE,
    ORDER,
    OUT_OF_RANGE,
    TUIO_2,
    TWICE_ALIVE,
    TYPES,
    UNKNOWN_ADDRESS,
    UNKNOWN_WORD,
    Breach,
    Rule,
)

# The arguments of "set" in the TUIO 1.1 specification: s and i are ints, all others floats.
_SET_ARGUMENTS = {
    "2Dobj": "s i x y a X Y A m r",
    "2Dcur": "s x y X Y m",
    "2Dblb": "s x y a w h f X Y A m r",
    "25Dobj": "s i x y z a X Y Z A m r",
    "25Dcur": "s x y z X Y Z m",
    "25Dblb": "s x y z a w h f X Y Z A m r",
    "3Dobj": "s i x y z a b c X Y Z A B C m r",
    "3Dcur": "s x y z X Y Z m",
    "3Dblb": "s x y z a b c w h d v X Y Z A B C m r",
}
_NOUNS = {"cur": "cursor", "obj": "object", "blb": "blob"}
_ORDER = {"source": 0, "alive": 1, "set": 2, "fseq": 3}
_TYPE_NAMES = {"i": "an int", "f": "a float", "s": "a string", "h": "a 64-bit int", "d": "a double"}
_ROUNDING = 1e-6  # of a sender that clamps in double precision


@dataclass(frozen=True, slots=True)
class Profile:
    """A TUIO profile: its name, what its things are called, and the names of a set's arguments."""

    name: str
    noun: str
    names: tuple[str, ...]
    tags: str


@dataclass(frozen=True, slots=True)
class Placed:
    """What a set says: a position (``z`` None in a flat profile), and the greatest component of its velocity."""

    x: float
    y: float
    speed: float
    z: float | None = None


@dataclass(frozen=True, slots=True)
class Part:
    """What one bundle says of one profile: a whole frame, or the part of it that fits the datagram."""

    profile: Profile
    alive: tuple[int, ...]
    sets: dict[int, Placed]
    fseq: int


@dataclass(frozen=True, slots=True)
class Reading:
    """What a bundle's messages say, and what is wrong in them."""

    source: str | None
    parts: tuple[Part, ...]
    breaches: tuple[Breach, ...]


def _profile(name: str, arguments: str) -> Profile:
    names = tuple(arguments.split())
    return Profile(name, _NOUNS[name[-3:]], names, "".join("i" if each in "si" else "f" for each in names))


PROFILES = {f"/tuio/{name}": _profile(name, arguments) for name, arguments in _SET_ARGUMENTS.items()}


def read(messages: Sequence[OscMessage]) -> Reading:
    """Read the messages of one bundle. What is wrong in type or order is read as it must be meant, as far as it can."""
    groups: dict[str, _Group] = {}
    breaches: list[Breach] = []
    for message in messages:
        profile = PROFILES.get(message.address)
        if profile is None:
            breaches.append(_stranger(message.address))
        else:
            groups.setdefault(message.address, _Group(profile)).take(message)
    parts = [part for group in groups.values() if (part := group.part()) is not None]
    for group in groups.values():
        breaches += group.breaches
    source = next((group.source for group in groups.values() if group.source is not None), None)
    return Reading(source, tuple(parts), tuple(dict.fromkeys(breaches)))


def _stranger(address: str) -> Breach:
    shown = address[:40]
    if address.startswith("/tuio2/"):
        return Breach(TUIO_2, f'"{shown}" is an address of TUIO 2.0')
    return Breach(UNKNOWN_ADDRESS, f'"{shown}" is the address of no TUIO 1.1 profile')


class _Group:
    """The messages of one profile in one bundle."""

    def __init__(self, profile: Profile) -> None:
        self.source: str | None = None
        self._profile = profile
        self._words: set[str] = set()
        self._last = "source"  # the latest word in their due order
        self._alive: tuple[int, ...] = ()
        self._sets: dict[int, Placed] = {}
        self._fseq: int | None = None
        self._breaches: list[Breach] = []

    @property
    def breaches(self) -> list[Breach]:
        return [Breach(each.rule, each.found, self._fseq) for each in self._breaches]

    def take(self, message: OscMessage) -> None:
        word = message.arguments[0] if message.arguments else None
        if not isinstance(word, str) or word not in _ORDER:
            self._say(UNKNOWN_WORD, f"a message of {self._profile.name} begins with {_shown(word)}")
            return
        self._check_order(word)
        self._words.add(word)
        tags, values = message.tags[1:], message.arguments[1:]
        if word == "set":
            self._take_set(tags, values)
        elif word == "alive":
            self._take_alive(tags, values)
        elif word == "fseq":
            self._check_single("fseq", "i", tags)
            self._fseq = next(_integers(values), None)
        else:
            self._check_single("source", "s", tags)
            self.source = next((each for each in values if isinstance(each, str)), None)

    def part(self) -> Part | None:
        """Return the part, or None where no client would show anything of it."""
        if not self._words:
            return None
        if "source" not in self._words:
            self._say(NO_SOURCE, f"the bundle of {self._profile.name} has no source")
        if "alive" not in self._words:
            self._say(NO_ALIVE, f"the bundle of {self._profile.name} has no alive")
        if "fseq" not in self._words:
            self._say(NO_FSEQ, f"the bundle of {self._profile.name} has no fseq")
        if "alive" not in self._words or self._fseq is None:
            return None
        alive = set(self._alive)
        for session_id in self._sets:
            if session_id not in alive:
                self._say(NOT_ALIVE, f"{self._profile.noun} {session_id} is set but not listed in alive")
        return Part(self._profile, self._alive, self._sets, self._fseq)

    def _check_order(self, word: str) -> None:
        if _ORDER[word] < _ORDER[self._last]:
            self._say(ORDER, f"{word} comes after {self._last}")
            return
        if word in self._words and word != "set":
            self._say(ORDER, f"{word} stands twice in the bundle")
        self._last = word

    def _check_single(self, word: str, due: str, tags: str) -> None:
        if len(tags) != 1:
            self._say(ARGUMENTS, f"{word} has {len(tags)} arguments in place of 1")
        elif tags != due:
            self._say(TYPES, f"the argument of {word} is {_type_name(tags)} in place of {_type_name(due)}")

    def _take_alive(self, tags: str, values: Sequence[Argument]) -> None:
        wrong = next((tag for tag in tags if tag != "i"), None)
        if wrong is not None:
            self._say(TYPES, f"a session id in alive is {_type_name(wrong)} in place of an int (i)")
        self._alive = tuple(_integers(values))
        if len(set(self._alive)) < len(self._alive):
            twice = Counter(self._alive).most_common(1)[0][0]
            self._say(TWICE_ALIVE, f"{self._profile.noun} {twice} is listed twice in alive")
        if self._alive and min(self._alive) < 1:
            self._say(LOW_ID, f"{self._profile.noun} {min(self._alive)} has a session id below 1")

    def _take_set(self, tags: str, values: Sequence[Argument]) -> None:
        self._check_set_types(tags)
        numbers = list(_numbers(values))
        names = self._profile.names
        named = dict(zip(names, numbers, strict=False))
        if len(numbers) != len(values) or "y" not in named or not math.isfinite(named["s"]):
            return
        session_id = round(named["s"])
        self._check_values(session_id, named)
        speed = max(abs(named.get(each, 0.0)) for each in ("X", "Y", "Z"))
        self._sets[session_id] = Placed(named["x"], named["y"], speed, named.get("z"))

    def _check_set_types(self, tags: str) -> None:
        profile = self._profile
        if tags == profile.tags:
            return
        due = f"{profile.name} has {len(profile.names)}: {' '.join(profile.names)}"
        if len(tags) < len(profile.names):
            self._say(ARGUMENTS, f"set lacks {' '.join(profile.names[len(tags) :])}; {due}")
        elif len(tags) > len(profile.names):
            self._say(ARGUMENTS, f"set has {len(tags)} arguments; {due}")
        for name, is_, should in zip(profile.names, tags, profile.tags, strict=False):
            if is_ != should:
                self._say(TYPES, f"{name} of set is {_type_name(is_)} in place of {_type_name(should)}")
                return

    def _check_values(self, session_id: int, named: dict[str, float]) -> None:
        for name, value in named.items():
            if not math.isfinite(value):
                self._say(NOT_FINITE, f"{name} of {self._profile.noun} {session_id} is {value}")
            elif name in "xyz" and not -_ROUNDING <= value <= 1.0 + _ROUNDING:
                self._say(OUT_OF_RANGE, f"{name} of {self._profile.noun} {session_id} is {value:.4g}, outside 0..1")

    def _say(self, rule: Rule, found: str) -> None:
        self._breaches.append(Breach(rule, found))


def _numbers(values: Sequence[Argument]) -> Iterator[float]:
    return (value for value in values if isinstance(value, int | float))


def _integers(values: Sequence[Argument]) -> Iterator[int]:
    return (round(value) for value in _numbers(values) if math.isfinite(value))


def _type_name(tag: str) -> str:
    return f"{_TYPE_NAMES.get(tag, 'an argument of another type')} ({tag})"


def _shown(word: Argument) -> str:
    return "no argument" if word is None else repr(word)[:40]
