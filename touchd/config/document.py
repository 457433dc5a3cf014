"""Writes what people and editors read about the config from its schema: the default file and a JSON Schema.

``python -m touchd.config.document OUTDIR`` writes them as ``touchd.yaml`` and ``touchd.schema.json``.
"""

import argparse
import json
from pathlib import Path
from textwrap import wrap
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from touchd.config.describe import bounds, section_in, summary
from touchd.config.schema import Config
from touchd.config.section import Emptiable, Section
from touchd.config.show import yaml_scalar

_HEAD = """\
# yaml-language-server: $schema=touchd.schema.json
#
# The config of touchd. Every key is here with its default, commented out: to change one, remove the "#"
# before it and keep the indentation. "touchd check-config" checks the file. A running touchd takes up what is
# saved; where that has errors, it keeps the config it has and says so. Relative paths begin at this file's
# folder.
"""
_WIDTH = 100  # of the meanings, without their indentation
_SIMPLE_TYPES = {bool: "boolean", int: "integer", float: "number", str: "string", Path: "string"}


def default_yaml() -> str:
    """Return the default config file: all keys with their meanings, none of them set."""
    lines: list[str] = []
    for name, field in Config.model_fields.items():
        lines += ["", *_key_lines(name, field, getattr(Config(), name))]
    return _HEAD + "\n".join(lines) + "\n"


def json_schema() -> dict[str, Any]:
    """Return the config's JSON Schema (draft 7, which editors know best).

    Made by hand from the fields: pydantic's own differs from release to release, and is of a later draft.
    """
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "The config file of touchd",
        **_section_schema(Config),
    }


def write_documents(folder: Path) -> None:
    """Write ``touchd.yaml`` and ``touchd.schema.json`` into ``folder``."""
    schema = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    (folder / "touchd.yaml").write_text(default_yaml(), encoding="utf-8")
    (folder / "touchd.schema.json").write_text(schema, encoding="utf-8")


def _section_lines(section: type[Section], value: object) -> list[str]:
    """Return the lines of a section's keys; ``value`` is the default section, or None where it is not set."""
    return [
        line
        for name, field in section.model_fields.items()
        for line in _key_lines(name, field, getattr(value, name, None))
    ]


def _key_lines(name: str, field: FieldInfo, value: object) -> list[str]:
    meaning = [f"# {line}" for line in wrap(summary(field), _WIDTH)]
    return [*meaning, *_body_lines(name, field, value)]


def _body_lines(name: str, field: FieldInfo, value: object) -> list[str]:
    section = section_in(field.annotation)
    if section is None:
        return _scalar_lines(name, field, value)
    if isinstance(value, tuple):
        keys = [line for item in value for line in _item_lines(section, item)]
    else:
        keys = _section_lines(section, value)
    lines = [f"{name}:", *_indented(keys, "  ")]
    return lines if value is not None else _indented(lines, "#")


def _item_lines(section: type[Section], item: object) -> list[str]:
    """Return the lines of a list's default item, and of the other kinds of item as comments."""
    lines: list[str] = []
    for name, field in section.model_fields.items():
        first, *keys = _body_lines(name, field, getattr(item, name))
        deeper = [f"#  {key[1:]}" if key.startswith("#") else f"  {key}" for key in keys]
        lines += [f"# {field.description}", first.replace(name, f"- {name}", 1), *deeper]
    return lines


def _scalar_lines(name: str, field: FieldInfo, value: object) -> list[str]:
    if value is not None:
        return [f"#{name}: {yaml_scalar(value)}"]
    example = yaml_scalar((field.examples or [None])[0])
    mark = "" if field.is_required() else "#"
    return [f"{mark}{name}: {example}  # an example; there is no default"]


def _indented(lines: list[str], indent: str) -> list[str]:
    return [f"{indent}{line}" for line in lines]


def _section_schema(section: type[Section]) -> dict[str, Any]:
    fields = section.model_fields
    schema: dict[str, Any] = {
        "type": "object",
        "additionalProperties": False,
        "properties": {name: _field_schema(field) for name, field in fields.items()},
    }
    required = [name for name, field in fields.items() if field.is_required()]
    limits = section.model_config.get("json_schema_extra")
    return schema | ({"required": required} if required else {}) | (limits if isinstance(limits, dict) else {})


def _field_schema(field: FieldInfo) -> dict[str, Any]:
    schema: dict[str, Any] = {"description": field.description}
    if isinstance(field.json_schema_extra, dict):
        schema |= field.json_schema_extra
    if section_in(field.annotation) is None and field.default is not None and not field.is_required():
        schema["default"] = field.default
    if field.examples:
        schema["examples"] = field.examples
    return schema | _type_schema(field.annotation, field.metadata)


def _type_schema(annotation: Any, metadata: list[Any]) -> dict[str, Any]:
    """Return the schema of a type; ``metadata`` is what Annotated adds to it."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        inner = [limit for item in parts[1:] for limit in getattr(item, "metadata", [item])]
        return _type_schema(parts[0], inner)
    if origin is Literal:
        return {"enum": list(parts)}
    if origin is tuple:
        items = {"type": "array", "items": _type_schema(parts[0], [])}
        return items if parts[1] is ... else items | {"minItems": len(parts), "maxItems": len(parts)}
    if parts:
        return _union_schema(parts, metadata)
    if annotation in _SIMPLE_TYPES:
        names = {"ge": "minimum", "le": "maximum"}
        limits = {names[name]: limit for name, limit in bounds(iter(metadata)).items()}
        return {"type": _SIMPLE_TYPES[annotation]} | limits
    schema = _section_schema(annotation)
    return _or_null(schema) if Emptiable in metadata else schema


def _union_schema(parts: tuple[Any, ...], metadata: list[Any]) -> dict[str, Any]:
    schemas = [_type_schema(part, metadata) for part in parts if part is not NoneType]
    return {"anyOf": schemas} if len(schemas) > 1 else _or_null(schemas[0])


def _or_null(schema: dict[str, Any]) -> dict[str, Any]:
    kind = schema["type"]
    return schema | {"type": [kind, "null"] if isinstance(kind, str) else kind}


def _main() -> None:
    parser = argparse.ArgumentParser(description="Write the default config and its JSON Schema.")
    parser.add_argument("folder", type=Path, help="the folder to write into")
    write_documents(parser.parse_args().folder)


if __name__ == "__main__":
    _main()
