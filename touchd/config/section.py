"""What all sections of the config are made of.

A field's unit and its reload tag are in its ``json_schema_extra``. The tag says what a change of it needs:
"live" takes effect at the next frame, "source" opens the source anew, "restart" starts the daemon anew.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from touchd.config.checks import resolve_path

Reload: TypeAlias = Literal["live", "source", "restart"]


class Section(BaseModel):
    """A group of keys: immutable, without room for unknown ones, and without conversions between types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Expects:
    """In a field's annotation: what to write there, where type, range and unit do not say it well."""

    def __init__(self, phrase: str) -> None:
        self.phrase = phrase


def field(default: Any, meaning: str, reload: Reload = "live", unit: str = "", example: Any = None) -> Any:
    """Return a pydantic field with all that a key has; ``example`` is for keys whose default is nothing."""
    extra: dict[str, Any] = {"reload": reload, "unit": unit} if unit else {"reload": reload}
    examples = None if example is None else [example]
    return Field(default=default, description=meaning, examples=examples, json_schema_extra=extra)


def _nothing_is_defaults(value: object) -> object:
    # All keys of a section commented out leave "section:", which YAML reads as null.
    return {} if value is None else value


Emptiable = BeforeValidator(_nothing_is_defaults)
FilePath = Annotated[Path, BeforeValidator(resolve_path), Field(strict=False)]
