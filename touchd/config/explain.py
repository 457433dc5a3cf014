"""Turns pydantic's errors into problems: what was expected, what was found, and what may have been meant."""

import json
import re
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from touchd.config.checks import FAULT
from touchd.config.describe import (
    all_keys,
    choices,
    expectation,
    field_at,
    known_path,
    section_at,
    section_in,
    takes,
)
from touchd.config.problems import KeyPath, Problem, dotted, shorten
from touchd.config.yaml_marks import Document, Place, plain_value

_FOUND_CHARACTERS = 40
_WITH_UNIT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*[^\W\d]*\.?\s*")
_WITH_COMMA = re.compile(r"\s*([-+]?[0-9]+),([0-9]+)\s*")


def explain(errors: Sequence[ErrorDetails], document: Document) -> list[Problem]:
    """Return what is wrong with the document's values in our words, each at its place in the file."""
    return [_problem(error, document) for error in errors]


def _problem(error: ErrorDetails, document: Document) -> Problem:
    location = error["loc"]
    if error["type"] == "extra_forbidden":
        path = (*known_path(location[:-1]), location[-1])
        return Problem(document.place(path).key, f"{dotted(path)}: {_unknown_key(path)}")
    path = known_path(location)
    if error["type"] == FAULT:
        return _fault(path, error["ctx"], document)
    if error["type"] == "missing" and isinstance(path[-1], str):
        field = field_at(path)
        wanted = "" if field is None else f"; give {expectation(field)}"
        return Problem(document.place(path).key, f"{dotted(path)}: missing{wanted}")
    field = field_at(path)
    place = document.place(path)
    what = "expected keys such as 'touch:'" if field is None else f"expected {expectation(field)}"
    hint = "" if field is None else _hint(field, error["input"], place)
    found = _found(error["input"], place)
    return Problem(place.value, f"{_where(path)}{what}, found {found}{hint}")


def _fault(path: KeyPath, context: dict[str, Any], document: Document) -> Problem:
    whole = (*path, context["key"]) if context["key"] else path
    place = document.place(whole)
    return Problem(place.key if context["key"] else place.value, f"{_where(whole)}{context['what']}")


def _where(path: KeyPath) -> str:
    """Return how a message begins; the caret shows which item of a list is meant."""
    while path and isinstance(path[-1], int):
        path = path[:-1]
    return f"{dotted(path)}: " if path else ""


def _unknown_key(path: KeyPath) -> str:
    key = str(path[-1])
    section = section_at(path[:-1])
    here = [] if section is None else list(section.model_fields)
    close = get_close_matches(key[:_FOUND_CHARACTERS].lower(), here, 1)
    above = tuple(part for part in path[:-1] if isinstance(part, str))
    elsewhere = next((known[:-1] for known in all_keys() if known[-1] == key), None)
    if elsewhere is not None and elsewhere[:-1] == above:
        return f"unknown key here; it belongs under '{elsewhere[-1]}:', indented further"
    if close:
        return f"unknown key; did you mean '{close[0]}'?"
    if elsewhere:
        return f"unknown key here; it belongs under '{dotted(elsewhere)}:'"
    if elsewhere is not None:
        return "unknown key here; it belongs at the top, without indentation"
    return f"unknown key; known here: {', '.join(here)}"


def _found(value: object, place: Place) -> str:
    match value:
        case None:
            return "nothing"
        case str():
            return shorten(json.dumps(value, ensure_ascii=False), _FOUND_CHARACTERS)
        case ():
            return "an empty list"
        case tuple():
            return f"a list of {len(value)}"
        case dict():
            return "a group of keys"
        case _:
            return shorten(place.text or "something else", _FOUND_CHARACTERS)


def _hint(field: FieldInfo, value: object, place: Place) -> str:
    """Return what may have been meant, as an addition to the sentence; "" where nothing comes to mind."""
    if not isinstance(value, str):
        quoted = place.text is not None and value is not None and takes(field, str)
        return f'; put it in quotes: "{shorten(place.text or "", _FOUND_CHARACTERS)}"' if quoted else ""
    text = value[:_FOUND_CHARACTERS]
    close = get_close_matches(text.lower(), choices(field), 1)
    if close:
        return f"; did you mean '{close[0]}'?"
    if section_in(field.annotation) is not None and re.match(r"\w+:\S", text):
        return "; put a space after the ':'"
    if takes(field, int) or takes(field, float):
        return _number_hint(text)
    return ""


def _number_hint(text: str) -> str:
    with_comma = _WITH_COMMA.fullmatch(text)
    if with_comma:
        return f"; write it as {with_comma[1]}.{with_comma[2]}"
    with_unit = _WITH_UNIT.fullmatch(text)
    if with_unit and not isinstance(plain_value(with_unit[1]), str):
        return f"; write it as {with_unit[1]}"
    return ""
