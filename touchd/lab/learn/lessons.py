"""What is learned from: which scenes, heights and seeds. No table in docs/accuracy.md is of these seeds."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

_ORDINARY = (
    "targets", "targets-tilted", "targets-bowl", "taps", "taps-tilted", "drag", "pinch", "two-fingers", "five", "ten",
    "crowd", "two-people", "flat-palm", "writing", "hover", "hover-open", "descent", "legs", "ray", "own-hand",
    "objects", "head",
)  # fmt: skip
_STEREO = ("targets-stereo", "taps-stereo", "drag-stereo", "hover-stereo")
_HARD = (
    "crowd", "five", "pinch", "ten", "flat-palm", "two-fingers", "hover-open", "targets-tilted", "writing", "own-hand",
)  # fmt: skip
_RARE = (
    "targets-book", "book", "phone", "cup", "laptop", "forearm", "hover-height", "drag-lens", "dark-sleeve",
)  # fmt: skip
_ALIKE = (  # of one sensor's ordinary pictures, so that what is learned of time is learned of all kinds of hands
    "circles", "dark-hair", "drag-bowl", "drag-lens", "dark-sleeve", "still", "sway", "sweep", "passing",
    "targets-book", "targets-lens", "targets-unknown-lens",
)  # fmt: skip
_GROUPS = (
    "targets-tilted", "taps", "drag", "pinch", "two-fingers", "five", "ten", "crowd", "two-people", "flat-palm",
    "writing", "hover-open", "hover", "own-hand", "passing",
)  # fmt: skip
_OTHERS = (
    "five", "ten", "crowd", "passing", "two-fingers", "pinch", "two-people", "hover-open", "flat-palm", "writing",
    "targets-tilted", "taps-tilted", "own-hand", "forearm", "book", "laptop", "phone", "cup",
)  # fmt: skip
_CALM = (  # all scenes of a Kinect in which nothing upsets the surface
    "book", "circles", "crowd", "cup", "dark-hair", "dark-sleeve", "descent", "drag", "drag-bowl", "drag-lens", "five",
    "flat-palm", "forearm", "four-hands", "head", "hover", "hover-height", "hover-open", "laptop", "legs", "objects",
    "own-hand", "paper", "passing", "phone", "pinch", "ray", "still", "sway", "sweep", "taps", "taps-tilted", "targets",
    "targets-book", "targets-bowl", "targets-lens", "targets-tilted", "targets-unknown-lens", "ten", "two-fingers",
    "two-people", "writing",
)  # fmt: skip
HANDS = (  # hands of as many people as possible, since that is what beliefs lack most
    "crowd", "five", "ten", "pinch", "two-fingers", "flat-palm", "writing", "hover-open", "hover-height",
)  # fmt: skip
_FAR = ("taps", "targets-tilted", "hover")  # at 1.5 m alone
_PEOPLE = range(431, 441)
_WORLDS, _LATER_WORLDS = range(1, 193), range(201, 341)


@dataclass(frozen=True, slots=True)
class Lesson:
    """A scene to learn from, of which one frame in ``every`` is seen; without a name, the world with a seed.

    Named as one of ``Fingers``: the world that such visitors come to. Worlds have heights of their own.
    ``most``: of how many frames, counted before any are left out; None: all.
    """

    scene: str | None
    height_mm: float
    seed: int
    every: int = 1
    most: int | None = None


def judge_lessons() -> Iterator[Lesson]:
    """Yield what the judge learns from."""
    for scene, height_mm, seed in product(_ORDINARY + _STEREO, (750.0, 1500.0), (401, 403)):
        yield Lesson(scene, height_mm, seed)
    for scene, height_mm in product(_ORDINARY, (600.0, 1000.0, 1250.0, 1900.0)):
        yield Lesson(scene, height_mm, 405)
    for scene, height_mm, seed in product(_HARD, (750.0, 1500.0), range(410, 418)):
        yield Lesson(scene, height_mm, seed, every=2)
    for scene, height_mm, seed in product(_RARE, (750.0, 1500.0), range(410, 413)):
        yield Lesson(scene, height_mm, seed, every=2)
    for scene, height_mm, seed in product(_STEREO, (750.0, 1500.0), range(410, 414)):
        yield Lesson(scene, height_mm, seed, every=2)
    for seed in _WORLDS:
        yield Lesson(None, 0.0, seed)


def belief_lessons() -> Iterator[Lesson]:
    """Yield what beliefs are learned from: nothing that the judge was taught, for of that it is too sure."""
    for scene, height_mm, seed in product(_ORDINARY + _STEREO + _ALIKE, (750.0, 1500.0), (421, 423)):
        yield Lesson(scene, height_mm, seed)
    for scene, height_mm in product(_OTHERS, (750.0, 1500.0)):
        yield Lesson(scene, height_mm, 422)
    for scene, height_mm in product(_GROUPS, (600.0, 1000.0, 1250.0, 1900.0)):
        yield Lesson(scene, height_mm, 425)
    for scene, height_mm in product(_CALM, (750.0, 1500.0)):
        yield Lesson(scene, height_mm, 402)
    for scene, height_mm, seed in product(HANDS, (750.0, 1500.0), _PEOPLE):
        yield Lesson(scene, height_mm, seed)
    for scene, seed in product(_FAR, _PEOPLE):
        yield Lesson(scene, 1500.0, seed)
    for seed in _PEOPLE[1::3]:
        yield Lesson("forearm", 1500.0, seed)
    for seed in _LATER_WORLDS:
        yield Lesson(None, 0.0, seed)
