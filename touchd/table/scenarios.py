"""The scenarios that the synthetic table plays: hands over an area of 600 x 420 mm, 0.82 m under a Kinect."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from touchd.errors import UsageError
from touchd.model import AreaCorners
from touchd.table.actors import Actor, Circle, Drag, Gesture, Hover, Pinch, Touch
from touchd.table.hands import HandPose, open_hand, pinching_hand
from touchd.table.scenario_names import SCENARIOS
from touchd.table.scene import Area, Place, TableCamera, area_corners_px
from touchd.table.script import Script

CAMERA = TableCamera(height_mm=820.0, tilt_deg=5.0)
AREA = Area(centre_mm=(0.0, 0.0), size_mm=(600.0, 420.0))

_NS = 1_000_000
_PAUSE_MS = 250.0  # between two scenarios of the mixed one
_PLACES = ((0.2, 0.3), (0.45, 0.65), (0.7, 0.25), (0.8, 0.7), (0.55, 0.4), (0.25, 0.75), (0.35, 0.2), (0.6, 0.8))

_Cast: TypeAlias = Callable[[np.random.Generator], list[Actor]]


def scenario(name: str, seed: int) -> Script:
    """Return a scenario's script from its first hand's coming in to its last one's leaving.

    The seed varies places and poses. Raises UsageError for a name that is none, and for a negative seed.
    """
    if name not in SCENARIOS:
        raise UsageError(f"there is no scenario {name!r}; choose one of {', '.join(SCENARIOS)}")
    if seed < 0:
        raise UsageError(f"a scenario's seed is a whole number from 0 on, not {seed}")
    rng = np.random.default_rng(seed)
    if name in _CASTS:
        return Script(CAMERA, AREA, _CASTS[name](rng))
    return Script(CAMERA, AREA, list(_one_after_the_other(rng)))


def area_corners() -> AreaCorners:
    """Return where the scenarios' area is seen, and its size."""
    (a, b), (c, d), (e, f), (g, h) = area_corners_px(CAMERA, AREA).tolist()
    return AreaCorners(((a, b), (c, d), (e, f), (g, h)), AREA.size_mm)


def _one_after_the_other(rng: np.random.Generator) -> Iterator[Actor]:
    begin_ms = 0.0
    for cast in _CASTS.values():
        actors = cast(rng)
        yield from (replace(actor, start_ms=actor.start_ms + begin_ms) for actor in actors)
        begin_ms += Script(CAMERA, AREA, actors).end_ns / _NS + _PAUSE_MS


def _taps(rng: np.random.Generator) -> list[Actor]:
    gestures = tuple(Touch(_near(x, y, rng), float(rng.uniform(70.0, 220.0))) for x, y in _PLACES)
    return [Actor(_grip(rng, heading_deg=10.0), gestures)]


def _drag(rng: np.random.Generator) -> list[Actor]:
    ways = (
        ((0.2, 0.25), (0.8, 0.25), 1300.0),
        ((0.75, 0.35), (0.3, 0.75), 900.0),
        ((0.3, 0.8), (0.75, 0.75), 2200.0),
    )
    gestures = tuple(Drag(_near(*begin, rng), _near(*end, rng), span_ms) for begin, end, span_ms in ways)
    return [Actor(_grip(rng, heading_deg=-10.0, left=True), gestures)]


def _pinch(rng: np.random.Generator) -> list[Actor]:
    gestures = (
        Pinch(_near(0.45, 0.5, rng), 40.0, 115.0, 1500.0),
        Pinch(_near(0.5, 0.45, rng), 115.0, 42.0, 1500.0, turn_deg=-20.0),
        Pinch(_near(0.55, 0.55, rng), 75.0, 80.0, 1800.0, turn_deg=50.0),
    )
    return [Actor(_grip(rng, heading_deg=-5.0), gestures, shape=pinching_hand)]


def _hover(rng: np.random.Generator) -> list[Actor]:
    heights = ((0.3, 0.35, 25.0), (0.5, 0.6, 18.0), (0.7, 0.4, 35.0), (0.45, 0.3, 14.0))
    gestures = tuple(Hover(_near(x, y, rng), clearance_mm, 700.0) for x, y, clearance_mm in heights)
    return [Actor(_grip(rng, heading_deg=15.0), gestures)]


def _circles(rng: np.random.Generator) -> list[Actor]:
    gestures = (
        Circle(_near(0.4, 0.45, rng), 70.0, 2.0, 4200.0),
        Circle(_near(0.65, 0.5, rng), 40.0, -2.0, 3000.0),
    )
    return [Actor(_grip(rng, heading_deg=5.0), gestures)]


def _two_hands(rng: np.random.Generator) -> list[Actor]:
    return [
        Actor(_grip(rng, heading_deg=20.0, left=True), _strokes_of_one_hand(0.0, rng)),
        Actor(_grip(rng, heading_deg=-20.0), _strokes_of_one_hand(1.0, rng), start_ms=90.0),
    ]


def _strokes_of_one_hand(outer: float, rng: np.random.Generator) -> tuple[Gesture, ...]:
    """Return strokes of the left (outer side 0) or right hand (1), which stays on its side of the middle."""

    def at(share: float, y: float) -> Place:
        return _near(0.5 + (outer - 0.5) * share, y, rng)

    return (
        Drag(at(0.25, 0.5), at(0.75, 0.3), 1400.0),
        Drag(at(0.75, 0.35), at(0.3, 0.6), 1400.0),
        Touch(at(0.5, 0.4 + 0.3 * outer), 120.0),
        Touch(at(0.6, 0.7 - 0.3 * outer), 120.0),
    )


def _ten(rng: np.random.Generator) -> list[Actor]:
    left = HandPose((0.0, 0.0), heading_deg=12.0 + float(rng.uniform(-3.0, 3.0)), scale=1.1, left=True)
    right = HandPose((0.0, 0.0), heading_deg=-12.0 + float(rng.uniform(-3.0, 3.0)), scale=1.1)
    return [
        Actor(left, _slides(((0.26, 0.5), (0.3, 0.38), (0.25, 0.55)), 22.0, rng), shape=open_hand),
        Actor(right, _slides(((0.74, 0.5), (0.7, 0.38), (0.75, 0.55)), -22.0, rng), start_ms=60.0, shape=open_hand),
    ]


def _slides(places: tuple[tuple[float, float], ...], turn_deg: float, rng: np.random.Generator) -> tuple[Gesture, ...]:
    first, second, third = (_near(x, y, rng) for x, y in places)
    return (
        Drag(first, second, 1700.0),
        Drag(second, second, 1500.0, turn_deg),
        Drag(second, third, 1700.0),
    )


def _grip(rng: np.random.Generator, heading_deg: float, left: bool = False) -> HandPose:
    return HandPose(
        (0.0, 0.0),
        heading_deg=heading_deg + float(rng.uniform(-8.0, 8.0)),
        pitch_deg=float(rng.uniform(30.0, 42.0)),
        scale=float(rng.uniform(0.92, 1.08)),
        left=left,
    )


def _near(x: float, y: float, rng: np.random.Generator) -> Place:
    """Return the place of area coordinates, or one up to 2 % of the area beside it."""
    return AREA.at(x + float(rng.uniform(-0.02, 0.02)), y + float(rng.uniform(-0.02, 0.02)))


_CASTS: Mapping[str, _Cast] = {
    "taps": _taps,
    "drag": _drag,
    "pinch": _pinch,
    "hover": _hover,
    "circles": _circles,
    "two-hands": _two_hands,
    "ten": _ten,
}
