"""The pictures of the soak: a few seconds of a busy table, to be shown over and over."""

from dataclasses import dataclass

from touchd.model import Image16, Sensor
from touchd.table.actors import Actor, Drag, Touch
from touchd.table.hands import HandPose, open_hand
from touchd.table.scenarios import AREA, CAMERA
from touchd.table.script import Script
from touchd.table.table import Table

PERIOD_NS = 33_333_333
CALIBRATION_FRAMES = 30
# The table is empty for long enough to learn it each time round, whenever a calibration begins.
_EMPTY_FRAMES = CALIBRATION_FRAMES + 15


@dataclass(frozen=True, slots=True)
class Show:
    """Pictures (H, W) of an empty table and then of two hands that come, touch, sweep, lift and leave."""

    sensor: Sensor
    pictures: tuple[Image16, ...]


def busy_table() -> Show:
    """Render the show: 5.5 s, in which each finger of both hands touches three times."""
    table = Table(CAMERA, seed=1)
    script = Script(CAMERA, AREA, _hands())
    with_hands = script.end_ns // PERIOD_NS + 1
    scenes = [script.at(0).hands[:0]] * _EMPTY_FRAMES
    scenes += [script.at(number * PERIOD_NS).hands for number in range(with_hands)]
    return Show(table.sensor, tuple(table.render(hands, 0, number).raw for number, hands in enumerate(scenes)))


def _hands() -> list[Actor]:
    left = HandPose((0.0, 0.0), heading_deg=12.0, left=True)
    right = HandPose((0.0, 0.0), heading_deg=-12.0)
    sweep_left = Drag(AREA.at(0.25, 0.55), AREA.at(0.3, 0.4), 700.0)
    sweep_right = Drag(AREA.at(0.75, 0.5), AREA.at(0.68, 0.4), 600.0)
    return [
        Actor(left, (sweep_left, _tap(0.25, 0.5), _tap(0.28, 0.55)), shape=open_hand),
        Actor(right, (_tap(0.75, 0.5), sweep_right, _tap(0.72, 0.45)), start_ms=60.0, shape=open_hand),
    ]


def _tap(x: float, y: float) -> Touch:
    return Touch(AREA.at(x, y), 100.0)
