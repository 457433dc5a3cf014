"""Writes the config in force as YAML that reads back as the same config, with the origin of each value."""

import json
import re
from pathlib import Path

from touchd.config.describe import field_at, summary
from touchd.config.load import Origin
from touchd.config.problems import KeyPath
from touchd.config.schema import Config
from touchd.config.section import Section
from touchd.config.yaml_marks import plain_value

_PLAIN = re.compile(r"[A-Za-z0-9/][A-Za-z0-9/._-]*", re.ASCII)


def effective_yaml(config: Config, origin: Origin) -> str:
    """Return every key with its value and a comment: its line in the file or "default", meaning and unit."""
    source = "the defaults alone" if origin.name is None else f"{json.dumps(origin.name)} and the defaults"
    head = f"# The config in force, from {source}."
    return "\n".join([head, *_section_lines(config, origin, (), "")]) + "\n"


def yaml_scalar(value: object) -> str:
    """Return a truth value, number, text, path or tuple of those as YAML in one line."""
    if isinstance(value, tuple):
        return f"[{', '.join(yaml_scalar(item) for item in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 2**53 else repr(value)
    if isinstance(value, (str, Path)):
        text = str(value)
        is_plain = _PLAIN.fullmatch(text) and plain_value(text) == text
        return text if is_plain else json.dumps(text, ensure_ascii=False)
    return str(value)


def _section_lines(section: Section, origin: Origin, path: KeyPath, indent: str) -> list[str]:
    lines = []
    for name in type(section).model_fields:
        lines += _key_lines(name, getattr(section, name), origin, (*path, name), indent)
    return lines


def _key_lines(name: str, value: object, origin: Origin, path: KeyPath, indent: str) -> list[str]:
    comment = f"  # {_origin(origin, path)}: {_meaning(path)}"
    if value is None:
        return [f"{indent}# {name}: not set{comment}"]
    if isinstance(value, Section):
        return [f"{indent}{name}:{comment}", *_section_lines(value, origin, path, f"{indent}  ")]
    if isinstance(value, tuple) and value and isinstance(value[0], Section):
        lines = [f"{indent}{name}:{comment}"]
        for index, item in enumerate(value):
            lines += _item_lines(item, origin, (*path, index), f"{indent}  ")
        return lines
    return [f"{indent}{name}: {yaml_scalar(value)}{comment}"]


def _item_lines(item: Section, origin: Origin, path: KeyPath, indent: str) -> list[str]:
    """Return the lines of a list's item; only those of its keys that are set are shown."""
    lines: list[str] = []
    for name in type(item).model_fields:
        value = getattr(item, name)
        if value is not None:
            lines += _key_lines(name, value, origin, (*path, name), f"{indent}  ")
    lines[0] = f"{indent}- {lines[0].lstrip()}"
    return lines


def _origin(origin: Origin, path: KeyPath) -> str:
    return f"line {origin.lines[path]}" if path in origin.lines else "default"


def _meaning(path: KeyPath) -> str:
    field = field_at(path)
    return "" if field is None else summary(field)
