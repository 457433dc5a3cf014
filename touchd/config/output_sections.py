"""The config's sections on where touches go."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from touchd.config.checks import check_box, check_destination, check_ipv4, check_not_empty, fault
from touchd.config.section import Emptiable, Expects, FilePath, Section, field
from touchd.outputs.blobs import Blobs
from touchd.outputs.fingertips import Fingertips
from touchd.outputs.profiles import BLOB_2D, CURSOR_25D, MAX_CURSORS
from touchd.outputs.screen import Screen, ScreenMap
from touchd.outputs.udp import Destination, is_multicast, parse_destination
from touchd.outputs.views import Touches, View

_Destination = Annotated[str, AfterValidator(check_destination)]
_Edge = Annotated[float, Field(ge=-100, le=100)]
_Box = Annotated[tuple[_Edge, _Edge, _Edge, _Edge], AfterValidator(check_box), Expects("[left, top, right, bottom]")]


class Tuio(Section):
    """TUIO messages to programs on this or other computers."""

    to: Annotated[
        tuple[_Destination, ...],
        AfterValidator(check_not_empty),
        Expects('a list of destinations such as ["127.0.0.1:3333"]'),
    ] = field(("127.0.0.1:3333",), "Who gets them, as HOST:PORT; [ADDRESS]:PORT for IPv6")
    transport: Literal["udp"] = field("udp", "How they travel")
    profile: Literal["2Dcur", "25Dcur", "2Dblb"] = field(
        "2Dcur",
        "Which TUIO profile is sent: touches, fingertips with their height, or the things on the surface; each needs a"
        " port of its own",
    )
    # Clients read OSC strings as ASCII.
    source: Annotated[
        str, Field(pattern=r"^[ -~]{1,100}$"), Expects("auto, or a name of 1 to 100 ASCII characters")
    ] = field("auto", "The sender's name; auto: touchd, this computer's name, the instance and the address")
    map: _Box = field(
        (0.0, 0.0, 1.0, 1.0),
        "Where the area lies on the clients' screen, in shares of it; touches that begin beyond it are not sent",
    )
    swap_axes: bool = field(False, "Exchange x and y, before all else")
    flip_x: bool = field(False, "Turn left and right round, before map")
    flip_y: bool = field(False, "Turn top and bottom round, before map")
    max_cursors: Annotated[int, Field(ge=1, le=MAX_CURSORS)] = field(
        MAX_CURSORS,
        "At most so many at a time; one that begins while there are as many is not sent",
        unit="touches",
    )
    interface: Annotated[str, AfterValidator(check_ipv4), Expects("an IPv4 address")] | None = field(
        None,
        "This computer's address on the network into which multicast is sent; without it the system chooses",
        example="192.168.0.2",
    )

    @model_validator(mode="after")
    def _interface_is_of_use(self) -> Self:
        if self.interface is not None and not any(map(is_multicast, self.to)):
            raise fault(
                f"for multicast alone, and no destination is a multicast address; found {', '.join(self.to)};"
                " remove it, or send to one of 224.0.0.0 to 239.255.255.255",
                "interface",
            )
        return self

    def view(self, hover_mm: float) -> View:
        """Return a new view of the frames as these keys want it; hovers are followed up to ``hover_mm``."""
        placement = ScreenMap(self.map, self.swap_axes, self.flip_x, self.flip_y)
        if self.profile == BLOB_2D.name:
            return Blobs(placement, self.max_cursors)
        screen = Screen(placement, self.max_cursors)
        return Fingertips(screen, hover_mm) if self.profile == CURSOR_25D.name else Touches(screen)


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


def check_profiles_are_apart(outputs: tuple[Output, ...]) -> tuple[Output, ...]:
    """Return ``outputs`` if no destination gets two TUIO profiles."""
    sent: dict[Destination, Tuio] = {}
    for tuio in (item.tuio for item in outputs if item.tuio is not None):
        for text in tuio.to:
            other = sent.setdefault(_address(text), tuio)
            if other.profile != tuio.profile:
                raise fault(
                    f"{text} gets {other.profile} and {tuio.profile}, and clients stumble over a second profile on"
                    " their port (Kivy stops listening); send each profile to a port of its own"
                )
    return outputs


def _address(text: str) -> Destination:
    """Return a destination, the same one for the common ways to write it."""
    parsed = parse_destination(text)
    host = parsed.host.lower()
    return Destination("127.0.0.1" if host == "localhost" else host, parsed.port)
