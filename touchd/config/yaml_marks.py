"""Reads YAML and remembers where in the file every key and value stands.

A subset on purpose, so that a file means what it looks like. Structure is YAML's, through PyYAML's scanner
and parser; plain scalars are read by the core schema of YAML 1.2 (chapter 10.3), not by PyYAML's YAML 1.1:
``1e3`` is a number, ``no``, ``on``, ``12:30`` and ``2024-05-01`` are text, ``010`` is ten. Anchors, aliases,
merge keys and tags are refused, so that no small file can stand for a huge value.
"""

import re
from dataclasses import dataclass, field
from typing import TypeAlias

import yaml

from touchd.config.problems import DRAWN_TO_LINE_END, KeyPath, Mark, Problem, dotted, split_lines
from touchd.config.yaml_wording import yaml_problem

Scalar: TypeAlias = str | int | float | bool | None
Value: TypeAlias = "Scalar | tuple[Value, ...] | dict[str, Value]"

DEEPEST = 20
MOST_VALUES = 5000

_TOP = Mark(1, 1)
_INTEGER = re.compile(r"[-+]?[0-9]+", re.ASCII)
_OTHER_BASE = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+", re.ASCII)
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)
_INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_NOT_TEXT = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_NOT_A_VALUE = re.compile("[^\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_WORDS: dict[str, bool | None] = {
    "": None,
    "~": None,
    "null": None,
    "Null": None,
    "NULL": None,
    "true": True,
    "True": True,
    "TRUE": True,
    "false": False,
    "False": False,
    "FALSE": False,
}


class UnreadableYamlError(Exception):
    """The text is no YAML that we read; ``problem`` says why and where."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.what)
        self.problem = problem


@dataclass(frozen=True, slots=True)
class Place:
    """Where a key and its value stand; ``key`` is the value's own mark for list items.

    ``text`` is how a scalar is written, without its quotes; None for lists and groups.
    """

    key: Mark
    value: Mark
    text: str | None


@dataclass(slots=True)
class Document:
    """A file's content: dicts, tuples and scalars, with the place of each by its path from the top."""

    value: Value = None
    places: dict[KeyPath, Place] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)  # duplicate keys

    def place(self, path: KeyPath) -> Place:
        """Return the place of ``path``, or of the nearest thing around it that is in the file."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.places:
                return self.places[path[:length]]
        return Place(_TOP, _TOP, None)


def read_yaml(text: str) -> Document:
    """Return the content of ``text``; of a key given twice the first counts, and the second is a problem.

    Raises UnreadableYamlError for what is no YAML, or uses parts of YAML that we do not support.
    """
    text = text.removeprefix("\ufeff")
    _check_characters(text)
    reader = _Reader(Document())
    loader = yaml.SafeLoader(text)
    try:
        while loader.check_event():
            reader.take(loader.get_event())  # type: ignore[no-untyped-call]
    except yaml.MarkedYAMLError as error:
        raise UnreadableYamlError(yaml_problem(error)) from error
    except (ValueError, OverflowError) as error:  # PyYAML's answer to "\UFFFFFFFF", beyond Unicode
        mark = Mark(loader.line + 1, loader.column + 1)
        raise UnreadableYamlError(Problem(mark, "this escape stands for no character; remove it")) from error
    return reader.document


def plain_value(text: str) -> Scalar:
    """Return what an unquoted scalar means in YAML 1.2's core schema; whole numbers become int."""
    if text in _WORDS:
        return _WORDS[text]
    if _OTHER_BASE.fullmatch(text):
        return int(text, 0)
    if _INTEGER.fullmatch(text) and len(text) < 16:
        return int(text)
    if _FLOAT.fullmatch(text):
        number = float(text)
        return int(number) if number.is_integer() and abs(number) < 2**53 else number
    if _INFINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def _check_characters(text: str) -> None:
    bad = _NOT_TEXT.search(text)
    if bad is not None:
        above = split_lines(text[: bad.start()])
        what = f"the character U+{ord(bad.group()):04X} has no place in a config file; remove it"
        raise UnreadableYamlError(Problem(Mark(len(above), len(above[-1]) + 1), what))


@dataclass(slots=True)
class _Group:
    """A mapping being read; ``key`` is set between a key and its value."""

    path: KeyPath
    keys: dict[str, Value] = field(default_factory=dict)
    key: str | None = None
    key_mark: Mark = _TOP


@dataclass(slots=True)
class _List:
    path: KeyPath
    items: list[Value] = field(default_factory=list)


class _Reader:
    """Builds the document from PyYAML's events, with a stack of its own that deep nesting cannot exhaust."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._open: list[_Group | _List] = []
        self._documents = 0
        self._values = 0

    def take(self, event: yaml.Event) -> None:
        match event:
            case yaml.DocumentStartEvent():
                self._documents += 1
                if self._documents > 1:
                    raise _refused(event, "a second YAML document begins here; keep one")
            case yaml.AliasEvent():
                raise _refused(event, "YAML aliases ('*') are not supported; write the value out")
            case yaml.NodeEvent():
                self._take_node(event)
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                self._close()

    def _take_node(self, event: yaml.NodeEvent) -> None:
        self._values += 1
        if self._values > MOST_VALUES:
            raise _refused(event, f"the file holds more than {MOST_VALUES} keys and values; this is no config")
        if event.anchor is not None:
            raise _refused(event, "YAML anchors ('&') are not supported; write the value out where it is needed")
        if getattr(event, "tag", None) is not None:
            raise _refused(event, "YAML tags ('!') are not supported; remove the tag, or put the value in quotes")
        inside = self._open[-1] if self._open else None
        if isinstance(inside, _Group) and inside.key is None:
            self._begin_key(inside, event)
        elif isinstance(event, yaml.ScalarEvent):
            self._place(event)
            self._put(_scalar(event))
        else:
            self._begin(event)

    def _begin_key(self, group: _Group, event: yaml.NodeEvent) -> None:
        if not isinstance(event, yaml.ScalarEvent):
            raise _refused(event, "a key must be a single word")
        if event.value == "<<":
            raise _refused(event, "YAML merge keys ('<<') are not supported; write the keys out")
        group.key, group.key_mark = event.value, _mark(event)
        earlier = self.document.places.get((*group.path, event.value))
        if event.value in group.keys and earlier is not None:
            key = dotted((*group.path, event.value))
            what = f"{key}: given twice, first in line {earlier.key.line}; keep one"
            self.document.problems.append(Problem(group.key_mark, what))

    def _begin(self, event: yaml.NodeEvent) -> None:
        if len(self._open) == DEEPEST:
            raise _refused(event, f"nested deeper than {DEEPEST} levels; no key of a config lies so deep")
        path = self._place(event)
        self._open.append(_Group(path) if isinstance(event, yaml.MappingStartEvent) else _List(path))

    def _close(self) -> None:
        closed = self._open.pop()
        value: Value = closed.keys if isinstance(closed, _Group) else tuple(closed.items)
        self._put(value)

    def _place(self, event: yaml.NodeEvent) -> KeyPath:
        """Note where the value that begins with ``event`` stands, and return its path."""
        inside = self._open[-1] if self._open else None
        value = _mark(event)
        if inside is None:
            path: KeyPath = ()
            key = value
        elif isinstance(inside, _List):
            path, key = (*inside.path, len(inside.items)), value
        else:
            path, key = (*inside.path, inside.key or ""), inside.key_mark
        text = event.value if isinstance(event, yaml.ScalarEvent) else None
        empty = isinstance(event, yaml.ScalarEvent) and event.style is None and not text
        self.document.places.setdefault(path, Place(key, key if empty else value, text))
        return path

    def _put(self, value: Value) -> None:
        if not self._open:
            self.document.value = value
            return
        inside = self._open[-1]
        if isinstance(inside, _List):
            inside.items.append(value)
        elif inside.key is not None:
            inside.keys.setdefault(inside.key, value)
            inside.key = None


def _scalar(event: yaml.ScalarEvent) -> Scalar:
    bad = _NOT_A_VALUE.search(event.value)
    if bad is not None:
        raise _refused(event, f"the character U+{ord(bad.group()):04X} has no place in a value; remove it")
    return plain_value(event.value) if event.style is None else event.value


def _mark(event: yaml.Event) -> Mark:
    start, end = event.start_mark, event.end_mark
    if start is None or end is None:
        return _TOP
    width = end.column - start.column if end.line == start.line else DRAWN_TO_LINE_END
    return Mark(start.line + 1, start.column + 1, width)


def _refused(event: yaml.Event, what: str) -> UnreadableYamlError:
    return UnreadableYamlError(Problem(_mark(event), what))
