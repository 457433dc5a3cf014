"""Hands that do this and that at random, as people do."""

from math import dist

import numpy as np

from touchd.table.actors import Actor, Drag, Gesture, Hover, Touch
from touchd.table.hands import HandPose
from touchd.table.scene import Area, Place, TableCamera
from touchd.table.strokes import strokes

_NS = 1_000_000


def improvised(camera: TableCamera, area: Area, span_ms: float, rng: np.random.Generator) -> list[Actor]:
    """Return two hands that tap, hold, drag and hover, each in its own half and from changing sides.

    Contact times, drag speeds and clearances are spread as people's are: taps of 50 to 100 ms, drags of 60 to
    350 mm/s, hovering at 12 to 40 mm.
    """
    actors: list[Actor] = []
    for half in (0, 1):
        sides = (0.0, 180.0, 90.0 if half == 0 else 270.0)
        t_ms = float(rng.uniform(0.0, 600.0))
        turn = int(rng.integers(len(sides)))
        while t_ms < span_ms:
            actor = _visit(area, half, sides[turn % len(sides)], t_ms, rng)
            actors.append(actor)
            t_ms = strokes(actor, camera)[-1].end_ns / _NS + float(rng.uniform(100.0, 600.0))
            turn += 1
    return actors


def _visit(area: Area, half: int, side_deg: float, start_ms: float, rng: np.random.Generator) -> Actor:
    grip = HandPose(
        (0.0, 0.0),
        heading_deg=side_deg + float(rng.uniform(-25.0, 25.0)),
        pitch_deg=float(rng.uniform(22.0, 50.0)),
        scale=float(rng.uniform(0.88, 1.15)),
        left=half == 0,
    )
    gestures = tuple(_gesture(area, half, rng) for _ in range(int(rng.integers(4, 8))))
    return Actor(grip, gestures, start_ms, travel_mm=float(rng.uniform(15.0, 35.0)))


def _gesture(area: Area, half: int, rng: np.random.Generator) -> Gesture:
    def somewhere() -> Place:
        return area.at(0.5 * half + float(rng.uniform(0.06, 0.40)), float(rng.uniform(0.1, 0.9)))

    first, second = somewhere(), somewhere()
    kind = rng.random()
    if kind < 0.5:
        return Touch(first, float(rng.uniform(50.0, 100.0)))
    if kind < 0.6:
        return Touch(first, float(rng.uniform(300.0, 900.0)))
    if kind < 0.85:
        speed_mm_ms = float(np.clip(0.12 * np.exp(0.6 * rng.standard_normal()), 0.06, 0.35))
        return Drag(first, second, max(150.0, dist(first, second) / speed_mm_ms))
    return Hover(first, float(rng.uniform(12.0, 40.0)), float(rng.uniform(200.0, 600.0)))
