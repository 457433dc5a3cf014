"""The lab's scenes by name."""

from collections.abc import Mapping
from dataclasses import dataclass
from zlib import crc32

import numpy as np

from touchd.errors import UsageError
from touchd.lab.scenes import (
    crowds,
    disturbances,
    handling,
    living,
    many_fingers,
    pointing,
    resting,
    strokes,
    surfaces,
)
from touchd.lab.scenes.cast import NS, Family
from touchd.lab.scenes.play import Play
from touchd.lab.scenes.room import Stage, View, make_room
from touchd.lab.scenes.scene import LabScene
from touchd.table.show import frame_index

CALIBRATION_FRAMES = 100
_AFTER_FRAMES = 10  # the empty surface once more, for touches that do not let go


@dataclass(frozen=True, slots=True)
class Entry:
    """A scene: what happens, in what kind of room."""

    family: Family
    meaning: str
    view: View = View.PLAIN


_ENTRIES: Mapping[str, Entry] = {
    "targets": Entry(pointing.targets, "targets touched from all sides, with steep and flat fingers"),
    "targets-tilted": Entry(
        pointing.targets, "targets under a camera tilted by 20 to 35 degrees and rolled", View.TILTED
    ),
    "targets-lens": Entry(pointing.targets, "targets through a bent lens that touchd knows", View.LENS),
    "targets-unknown-lens": Entry(
        pointing.targets, "targets through a lens that it takes for a straight one", View.UNKNOWN_LENS
    ),
    "targets-book": Entry(surfaces.targets_on_it, "targets on a book that belongs to the surface", View.BOOK),
    "targets-bowl": Entry(surfaces.targets_on_it, "targets in a shallow bowl", View.BOWL),
    "targets-stereo": Entry(pointing.targets, "targets under a stereo camera", View.STEREO),
    "taps": Entry(pointing.taps, "quick taps, 50 to 100 ms, three to five a second"),
    "taps-tilted": Entry(pointing.taps, "quick taps under a tilted and rolled camera", View.TILTED),
    "taps-stereo": Entry(pointing.taps, "quick taps under a stereo camera", View.STEREO),
    "descent": Entry(pointing.descent, "fingers that come down and rise slowly: where does a touch fire and release?"),
    "stacks": Entry(disturbances.stacks, "stacks of paper that grow to 44 mm: when are they taken for touches?"),
    "drag": Entry(strokes.drag, "lines at 0.1 to 0.9 m/s"),
    "drag-lens": Entry(strokes.drag, "lines through a bent lens that touchd knows", View.LENS),
    "drag-bowl": Entry(surfaces.slides_on_it, "lines in a shallow bowl", View.BOWL),
    "drag-stereo": Entry(strokes.drag, "lines under a stereo camera", View.STEREO),
    "circles": Entry(strokes.circles, "circles at 0.2 to 0.9 m/s"),
    "passing": Entry(strokes.passing, "two fingers that pass each other 45 mm apart"),
    "pinch": Entry(many_fingers.pinch, "thumb and index finger draw together, until they all but meet, and apart"),
    "two-fingers": Entry(many_fingers.two_fingers, "index and middle finger slide side by side"),
    "five": Entry(many_fingers.five, "all five fingers of a hand come down, slide and turn"),
    "ten": Entry(many_fingers.ten, "all ten fingers slide and turn"),
    "two-people": Entry(crowds.two_people, "two people tap and draw with both hands"),
    "crowd": Entry(crowds.crowd, "two people slide all twenty fingers"),
    "flat-palm": Entry(many_fingers.flat_palm, "a hand lies flat: its five fingertips touch, its palm does not count"),
    "writing": Entry(many_fingers.writing, "a finger writes while the hand's heel rests on the surface"),
    "still": Entry(pointing.still, "a finger held perfectly still for a minute"),
    "sway": Entry(pointing.sway, "a finger held on one spot for a minute while the hand sways"),
    "hover": Entry(pointing.hover, "a finger over the surface that never touches"),
    "hover-open": Entry(pointing.hover_open, "an open hand over the surface that never touches"),
    "hover-stereo": Entry(pointing.hover, "a finger that never touches, under a stereo camera", View.STEREO),
    "sweep": Entry(disturbances.sweep, "hands that sweep in and out without touching"),
    "dark-sleeve": Entry(disturbances.dark_sleeve, "taps and lines by an arm in black cloth that gives no readings"),
    "dark-hair": Entry(disturbances.dark_hair, "a head with hair that gives no readings leans in during touches"),
    "head": Entry(disturbances.heads, "a head between camera and table while someone touches"),
    "legs": Entry(disturbances.legs, "legs beside the table while someone touches", View.EDGES),
    "objects": Entry(disturbances.objects, "a phone, a cup and a booklet are put down; touches beside them"),
    "near-head": Entry(disturbances.near_head, "a head too near for the camera covers a part; touches beside it go on"),
    "drift": Entry(living.drift, "readings drift by 3 raw steps in 25 s during taps and lines"),
    "drift-long": Entry(living.drift_long, "readings drift by 10 raw steps in 10 minutes, with taps all along"),
    "knock": Entry(living.knock, "the camera is knocked while someone touches; then an empty table, then touches"),
    "blind": Entry(living.blind, "the camera is covered, and then dazzled, while someone touches"),
    "phone": Entry(handling.phone, "a phone is put down, touched, pushed and taken away"),
    "cup": Entry(handling.cup, "a cup with a lid is put down, touched, pushed and taken away"),
    "book": Entry(handling.book, "a book is put down, touched, pushed and taken away"),
    "paper": Entry(handling.paper, "a sheet with a curled corner is put down, touched, pushed and taken away"),
    "laptop": Entry(handling.laptop, "an open laptop is put down, touched, pushed and taken away"),
    "forearm": Entry(resting.forearm, "a forearm rests on the table for a minute while both hands' fingers work"),
    "hover-height": Entry(resting.hover_height, "fingers held and moved at known heights, which then touch"),
    "held": Entry(resting.held, "a finger held for 10 minutes, swaying by less than a millimetre"),
    "four-hands": Entry(crowds.four_hands, "two people tap and draw with both hands, at times near each other"),
    "ray": Entry(crowds.along_the_ray, "fingers along the camera's own ray"),
    "own-hand": Entry(crowds.own_hand, "fingers that their own hand hides, wholly or in part"),
}

# Scenes of ten minutes.
LONG_SCENES = ("drift-long", "held")
LAB_SCENES: Mapping[str, str] = {name: entry.meaning for name, entry in _ENTRIES.items()}


def lab_scene(name: str, height_mm: float, seed: int) -> LabScene:
    """Return a scene; all of it follows from name, height and seed: another seed is other people under another camera.

    Raises UsageError for a name that is none and for a seed below 0.
    """
    if name not in _ENTRIES:
        raise UsageError(f"there is no lab scene {name!r}; choose one of {', '.join(_ENTRIES)}")
    if seed < 0:
        raise UsageError(f"a lab scene's seed is a whole number from 0 on, not {seed}")
    entry = _ENTRIES[name]
    rng = np.random.default_rng([seed, crc32(name.encode()), round(height_mm)])
    room = make_room(entry.view, height_mm, seed, rng)
    cast = entry.family(room)
    end_ns = round(cast.props_end_ms * NS)
    play = Play(room.camera, room.area, room.ground, cast.performers, cast.props, cast.stacks, cast.things, end_ns)
    return LabScene(
        name=name,
        height_mm=height_mm,
        seed=seed,
        camera=room.camera,
        area=room.area,
        corners=room.corners(),
        sensor=room.told,
        calibration_frames=CALIBRATION_FRAMES,
        frames=frame_index(play.end_ns) + 1 + _AFTER_FRAMES,
        play=play,
        stage=Stage(room, seed, cast.upsets),
        upsets=cast.upsets,
    )
