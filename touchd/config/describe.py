"""Reads the schema: which key lies where, and what to write there, in words."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from touchd.config.problems import KeyPath
from touchd.config.schema import Config
from touchd.config.section import Expects, Section


def section_in(annotation: Any) -> type[Section] | None:
    """Return the section that an annotation is, or holds in a union or list; None if there is none."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    found = (section_in(part) for part in get_args(annotation))
    return next((section for section in found if section is not None), None)


def known_path(location: KeyPath) -> KeyPath:
    """Return a pydantic error's location without the names of union branches that it adds."""
    section: type[Section] | None = Config
    known: list[str | int] = []
    for part in location:
        if isinstance(part, str):
            if section is None or part not in section.model_fields:
                break
            section = section_in(section.model_fields[part].annotation)
        known.append(part)
    return tuple(known)


def field_at(path: KeyPath) -> FieldInfo | None:
    """Return the field that a path leads to (in a list: the list's), or None where there is no such key."""
    section: type[Section] | None = Config
    found: FieldInfo | None = None
    for name in (part for part in path if isinstance(part, str)):
        if section is None or name not in section.model_fields:
            return None
        found = section.model_fields[name]
        section = section_in(found.annotation)
    return found


def section_at(path: KeyPath) -> type[Section] | None:
    """Return the section that a path leads to, or None where it leads to something else."""
    if not path:
        return Config
    field = field_at(path)
    return None if field is None else section_in(field.annotation)


def all_keys(section: type[Section] = Config, above: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the paths of all keys in the order of the schema, sections before what is in them."""
    for name, field in section.model_fields.items():
        yield (*above, name)
        inside = section_in(field.annotation)
        if inside is not None:
            yield from all_keys(inside, (*above, name))


def choices(field: FieldInfo) -> tuple[str, ...]:
    """Return the words that may be written for a key; none where it is free."""
    return tuple(word for part in _parts(field) if get_origin(part) is Literal for word in get_args(part))


def takes(field: FieldInfo, kind: type) -> bool:
    """Return whether a value of this Python type may be written for a key (outside lists)."""
    return kind in _parts(field)


def expectation(field: FieldInfo) -> str:
    """Return what to write for a key, to follow "expected": "milliseconds from 34 to 5000"."""
    phrase = next((item.phrase for item in _metadata(field) if isinstance(item, Expects)), None)
    if phrase is not None:
        return phrase
    section = section_in(field.annotation)
    if section is not None:
        return f"keys below it, such as '{next(iter(section.model_fields))}:'"
    words = choices(field)
    if takes(field, int) or takes(field, float):
        return ", or ".join((*words, _number(field)))
    if words:
        return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
    if takes(field, bool):
        return "true or false"
    return "text" if takes(field, str) else "a path"


def summary(field: FieldInfo) -> str:
    """Return a key's meaning and what to write, in one line."""
    if section_in(field.annotation) is not None:
        return str(field.description)
    return f"{field.description} ({expectation(field)})"


def extra(field: FieldInfo, name: str) -> str:
    """Return the "unit" or "reload" tag of a field, "" where it has none."""
    return str(field.json_schema_extra.get(name, "")) if isinstance(field.json_schema_extra, dict) else ""


def bounds(metadata: Iterator[Any]) -> dict[str, float]:
    """Return the least and greatest allowed value in an annotation's metadata, as "ge" and "le"."""
    found = {}
    for item in metadata:
        for name in ("ge", "le"):
            if getattr(item, name, None) is not None:
                found[name] = getattr(item, name)
    return found


def _number(field: FieldInfo) -> str:
    unit, limits = extra(field, "unit"), bounds(_metadata(field))
    noun = unit or "number"
    if takes(field, int):
        noun = f"a whole number of {unit}" if unit else "a whole number"
    elif noun in {"number", "share"} or noun.startswith("share "):
        noun = f"a {noun}"
    return f"{noun} from {limits['ge']:.10g} to {limits['le']:.10g}" if limits else noun


def _parts(field: FieldInfo) -> list[Any]:
    """Return the members of a field's union, or its one type, without their metadata."""
    annotation = field.annotation
    members = [annotation]
    if get_origin(annotation) is not tuple and get_origin(annotation) is not Literal and get_args(annotation):
        members = list(get_args(annotation))
    return [get_args(part)[0] if get_origin(part) is Annotated else part for part in members]


def _metadata(field: FieldInfo) -> Iterator[Any]:
    yield from field.metadata
    for part in get_args(field.annotation):
        for item in getattr(part, "__metadata__", ()):
            yield item
            yield from getattr(item, "metadata", ())
