"""The truth that events are scored against: every fingertip of every frame, in millimetres of the area."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

from touchd.errors import RecordingError
from touchd.formats.folder import reading

HAPPENINGS_NAME = "happenings.json"

TipJson: TypeAlias = Mapping[str, Any]
HappeningJson: TypeAlias = Mapping[str, Any]
Outline: TypeAlias = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Tip:
    """A true fingertip in one frame.

    ``touch`` numbers touches from 1, each with its way down and up; below 1 for a fingertip that only hovers.
    ``finger`` and ``hand`` stay the same from touch to touch where the truth tells them. ``x_mm``, ``y_mm``: the touch
    point, from the area's top left corner. ``clearance_mm``: the gap between fingertip and surface.
    """

    touch: int
    finger: int
    hand: int
    x_mm: float
    y_mm: float
    clearance_mm: float
    touching: bool
    inside: bool  # the area
    person: int
    side: str | None = None  # "left" or "right": which hand it is, where the truth tells
    z_mm: float = 0.0  # how high the touch point lies over the table
    either: bool = False  # it holds something so low that it may be taken for a touch or not


@dataclass(frozen=True, slots=True)
class TrueThing:
    """A thing in one frame: the corners of its upper side, and of the table under it, in mm of the area.

    ``held``: a hand holds it.
    """

    number: int
    outline_mm: Outline
    footprint_mm: Outline
    held: bool


@dataclass(frozen=True, slots=True)
class Happening:
    """What there was besides fingertips in a frame: things, and why no touch can be asked for (None: any can)."""

    things: tuple[TrueThing, ...] = ()
    upset: str | None = None


NOTHING = Happening()


@dataclass(frozen=True, slots=True)
class Truth:
    """The fingertips of each depth frame, counted from 0; ``size_mm`` is the area's width and height.

    ``visible``: by touch, which share of its fingertip's side towards the camera nothing hides (0..1), where known.
    ``happenings``: by frame, what there was besides fingertips, if anything.
    """

    size_mm: tuple[float, float]
    frames: tuple[tuple[Tip, ...], ...]
    visible: Mapping[int, float] = field(default_factory=dict)
    happenings: Mapping[int, Happening] = field(default_factory=dict)

    @property
    def crowded(self) -> bool:
        """Whether at some time two people touch, or five fingers of one hand."""
        return any(_is_crowd([tip for tip in tips if tip.touching]) for tips in self.frames)


def _is_crowd(down: Sequence[Tip]) -> bool:
    fingers = Counter((tip.person, tip.hand) for tip in down)
    return len({tip.person for tip in down}) > 1 or max(fingers.values(), default=0) >= 5


def truth_of(
    frames: Sequence[Sequence[TipJson]], size_mm: tuple[float, float], happenings: Sequence[HappeningJson] = ()
) -> Truth:
    """Return the truth in the form of a truth file: a list of fingertips for each frame; and of a file of happenings.

    Needed of each tip: tip, x, y, clearance_mm, touching. Where they are not given, finger and hand are each touch's
    own.
    Raises KeyError, TypeError or ValueError for anything else.
    """
    tips = tuple(tuple(_tip(tip, size_mm) for tip in frame) for frame in frames)
    return Truth(size_mm, tips, happenings=_happenings(happenings, size_mm))


def _happenings(happenings: Sequence[HappeningJson], size_mm: tuple[float, float]) -> dict[int, Happening]:
    return {int(one["frame"]): _happening(one, size_mm) for one in happenings}


def _happening(happening: HappeningJson, size_mm: tuple[float, float]) -> Happening:
    things = tuple(
        TrueThing(
            number=int(thing["id"]),
            outline_mm=_outline_mm(thing["outline"], size_mm),
            footprint_mm=_outline_mm(thing["footprint"], size_mm),
            held=bool(thing["held"]),
        )
        for thing in happening["things"]
    )
    return Happening(things, happening["upset"])


def _outline_mm(corners: Sequence[Sequence[float]], size_mm: tuple[float, float]) -> Outline:
    return tuple((float(x) * size_mm[0], float(y) * size_mm[1]) for x, y in corners)


def _tip(tip: TipJson, size_mm: tuple[float, float]) -> Tip:
    touch = int(tip["tip"])
    x, y = float(tip["x"]), float(tip["y"])
    return Tip(
        touch=touch,
        finger=int(tip.get("finger", touch)),
        hand=int(tip.get("hand", 0)),
        x_mm=x * size_mm[0],
        y_mm=y * size_mm[1],
        clearance_mm=float(tip["clearance_mm"]),
        touching=bool(tip["touching"]),
        inside=0.0 <= x <= 1.0 and 0.0 <= y <= 1.0,
        person=int(tip.get("person", 0)),
        side=tip.get("side"),
        z_mm=float(tip.get("z_mm", 0.0)),
        either=bool(tip.get("either", False)),
    )


def read_truth(path: Path, size_mm: tuple[float, float]) -> Truth:
    """Return the truth in a truth.json for an area of this size, with the happenings beside it, if there are any.

    Raises RecordingError.
    """
    happenings = _read_happenings(path.parent / HAPPENINGS_NAME, size_mm)
    with reading(path):
        text = path.read_bytes()
    try:
        return replace(truth_of(json.loads(text), size_mm), happenings=happenings)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise RecordingError(
            f"{path} is no truth file ({type(error).__name__}: {error}): expected is a list for each depth frame of "
            'its fingertips, such as {"tip": 1, "x": 0.5, "y": 0.5, "clearance_mm": 0.0, "touching": true}'
        ) from error


def _read_happenings(path: Path, size_mm: tuple[float, float]) -> dict[int, Happening]:
    """Return the happenings in a file, none where there is no file. Raises RecordingError."""
    if not path.exists():
        return {}
    with reading(path):
        text = path.read_bytes()
    try:
        return _happenings(json.loads(text), size_mm)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise RecordingError(
            f"{path} holds no happenings ({type(error).__name__}: {error}): expected is a list of frames such as "
            '{"frame": 100, "upset": null, "things": []}'
        ) from error
