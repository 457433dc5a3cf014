"""The config's sections on where touches go."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from touchd.config.checks import check_destination, check_not_empty, fault
from touchd.config.section import Emptiable, Expects, FilePath, Section, field

_Destination = Annotated[str, AfterValidator(check_destination)]


class Tuio(Section):
    """TUIO messages to programs on this or other computers."""

    to: Annotated[
        tuple[_Destination, ...],
        AfterValidator(check_not_empty),
        Expects('a list of destinations such as ["127.0.0.1:3333"]'),
    ] = field(("127.0.0.1:3333",), "Who gets them, as HOST:PORT; [ADDRESS]:PORT for IPv6")
    transport: Literal["udp"] = field("udp", "How they travel")
    profile: Literal["2Dcur"] = field("2Dcur", "Which TUIO profile is sent")
    # Clients read OSC strings as ASCII.
    source: Annotated[
        str, Field(pattern=r"^[ -~]{1,100}$"), Expects("auto, or a name of 1 to 100 ASCII characters")
    ] = field("auto", "The sender's name; auto: touchd, this computer's name, the instance and the address")


class Events(Section):
    """Every frame as a line of JSON in a file."""

    path: FilePath = Field(
        description="The file to write", examples=["touches.jsonl"], json_schema_extra={"reload": "live"}
    )


class Output(Section):
    """One output: exactly one of its keys is set."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    tuio: Annotated[Tuio | None, Emptiable] = field(None, "TUIO messages to programs on this or other computers")
    events: Annotated[Events | None, Emptiable] = field(None, "Every frame as a line of JSON in a file")

    @model_validator(mode="after")
    def _is_one_thing(self) -> Self:
        if len(self.model_fields_set) != 1:
            both = "both; give each a '-' of its own"
            raise fault(f"an output is one thing, tuio or events; found {both if self.model_fields_set else 'none'}")
        return self
