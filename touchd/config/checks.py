"""What is checked of values beyond their type and range. Each check raises :func:`fault`."""

from ipaddress import IPv4Address
from pathlib import Path

import numpy as np
from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError

from touchd.outputs.screen import Box
from touchd.outputs.udp import parse_destination

Corner = tuple[float, float]

FAULT = "touchd"  # marks errors whose wording is ours
_SHORTEST_SIDE_PX = 8.0
_LEAST_SINE = 0.05  # of the angle at a corner: 3 degrees off a straight line
_CORNERS = ("top-left", "top-right", "bottom-right", "bottom-left")


def fault(what: str, key: str = "") -> PydanticCustomError:
    """Return an error that pydantic hands on as it is; ``key`` names the key in the section checked."""
    return PydanticCustomError(FAULT, "{what}", {"what": what, "key": key})


def check_destination(text: str) -> str:
    """Return ``text`` if it is a destination that outputs can send to."""
    try:
        parse_destination(text)
    except ValueError as error:
        raise fault(str(error).removesuffix(".")) from error
    return text


def check_ipv4(text: str) -> str:
    """Return ``text`` if it is an IPv4 address."""
    try:
        IPv4Address(text)
    except ValueError as error:
        raise fault(f'expected an IPv4 address such as 192.168.0.2, found "{text}"') from error
    return text


def check_box(box: Box) -> Box:
    """Return ``box`` (left, top, right, bottom) if it has an inside that is on the screen at least in part."""
    left, top, right, bottom = box
    for near, far, names, flip in (
        (left, right, "left and right", "flip_x"),
        (top, bottom, "top and bottom", "flip_y"),
    ):
        if near == far:
            raise fault(f"{names} are both {near:g}; leave room between them")
        if near > far:
            raise fault(f"{names} are {near:g} and {far:g}; give the lesser first, and use {flip} to turn them round")
        if far <= 0.0 or near >= 1.0:
            raise fault(f"{names} are {near:g} and {far:g}, beyond the screen, which is 0 to 1; nothing would be sent")
    return box


def check_not_empty(destinations: tuple[str, ...]) -> tuple[str, ...]:
    """Return ``destinations`` if there are any."""
    if not destinations:
        raise fault('expected at least one destination such as "127.0.0.1:3333", found an empty list')
    return destinations


def check_odd(number: int) -> int:
    """Return ``number`` if it is odd."""
    if number % 2 == 0:
        raise fault(f"a window needs a middle pixel, so an odd number; found {number}, take {number + 1}")
    return number


def check_version(version: int) -> int:
    """Return ``version`` if this program reads it."""
    if version != 1:
        raise fault(
            f"this file has layout {version}, and this touchd reads layout 1; update touchd,"
            " or write the file anew from the touchd.yaml that came with it"
        )
    return version


def check_corners(corners: tuple[Corner, Corner, Corner, Corner]) -> tuple[Corner, Corner, Corner, Corner]:
    """Return ``corners`` (u, v), px, if they are convex and run clockwise in the picture."""
    points = np.array(corners, np.float64)
    sides = np.roll(points, -1, axis=0) - points
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    for first in range(4):
        if lengths[first] < _SHORTEST_SIDE_PX:
            raise fault(
                f"the {_CORNERS[first]} and {_CORNERS[(first + 1) % 4]} corners are {lengths[first]:.3g} px"
                f" apart; an area's sides are at least {_SHORTEST_SIDE_PX:g} px long"
            )
    before, before_lengths = np.roll(sides, 1, axis=0), np.roll(lengths, 1)
    cross = before[:, 0] * sides[:, 1] - before[:, 1] * sides[:, 0]
    _check_turns(cross / (lengths * before_lengths))
    return corners


def _check_turns(sines: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    """Judge the turns at the corners: with v down, a turn to the right in the picture has a positive sine."""
    order = "give top-left, top-right, bottom-right, bottom-left"
    for corner in range(4):
        if abs(sines[corner]) < _LEAST_SINE:
            raise fault(f"the {_CORNERS[corner]} corner lies in a line with its neighbours; {order}")
    rights = int(np.count_nonzero(sines > 0))
    if rights == 0:
        raise fault(f"the corners run anticlockwise in the picture; {order}")
    if rights == 2:
        raise fault(f"the outline crosses itself; {order}")
    if rights != 4:
        odd = int(np.argmin(sines) if rights == 3 else np.argmax(sines))
        raise fault(f"the {_CORNERS[odd]} corner dents the area inwards; {order}")


def resolve_path(value: object, info: ValidationInfo) -> object:
    """Return a text as a Path: ``~`` is the home folder, relative means to the config's folder.

    The folder comes as ``folder`` in the validation context. What is no text is left to the type check.
    """
    if not isinstance(value, str):
        return value
    if not value:
        raise fault("the path is empty; write a path, or remove the key")
    folder = info.context["folder"] if info.context else Path()
    try:
        return Path(folder) / Path(value).expanduser()
    except RuntimeError as error:
        raise fault(f'no home folder is known for "{value}"; write the whole path') from error
