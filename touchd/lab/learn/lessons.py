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
_HANDS = (  # hands of as many people as possible, since that is what beliefs lack most
    "crowd", "five", "ten", "pinch", "two-fingers", "flat-palm", "writing", "hover-open", "hover-height",
)  # fmt: skip
_FAR = ("taps", "targets-tilted", "hover")  # at 1.5 m alone
_PEOPLE = range(431, 441)
_LATER_HANDS = (*_HANDS[:-1], "two-people", "passing", "four-hands")
_LATER_FINGERS = ("taps", "hover", "hover-height")
_LATER_FAR = ("taps-tilted", "forearm", "targets-tilted")
_IN_TURN = ("circles", "drag", "own-hand", "sway")  # one of four with each seed, as of the next three
_THINGS_FAR, _THINGS_NEAR = ("laptop", "phone", "cup", "book"), ("laptop", "book", "targets-book", "taps-tilted")
_STEREO_IN_TURN = ("taps-stereo", "targets-stereo", "hover-stereo", "drag-stereo")
_LATER_PEOPLE = range(452, 461)
# So that nothing is forgotten: the other calm scenes, one of three with each seed, other heights and cameras.
_LASTING = (
    "dark-hair", "dark-sleeve", "descent", "drag-bowl", "drag-lens", "head", "legs", "objects", "paper", "ray", "still",
    "sweep", "targets", "targets-bowl", "targets-lens", "targets-unknown-lens",
)  # fmt: skip
_ELSEWHERE = ("crowd", "pinch", "hover-open", "drag", "taps")
_HEIGHTS_IN_TURN = (600.0, 1250.0, 1900.0)
_LASTING_PEOPLE = range(452, 457)
_LAST_WORLDS = range(341, 366)
_ENOUGH = 450  # frames of a scene in which one hand does the same for long
_WORLDS, _LATER_WORLDS = range(1, 193), range(201, 341)


@dataclass(frozen=True, slots=True)
class Lesson:
    """A scene to learn from, of which one frame in ``every`` is seen; without a name, the world with a seed.

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
    for scene, height_mm, seed in product(_HANDS, (750.0, 1500.0), _PEOPLE):
        yield Lesson(scene, height_mm, seed)
    for scene, seed in product(_FAR, _PEOPLE):
        yield Lesson(scene, 1500.0, seed)
    for seed in _PEOPLE[1::3]:
        yield Lesson("forearm", 1500.0, seed)
    for seed in _LATER_WORLDS:
        yield Lesson(None, 0.0, seed)


def later_lessons() -> Iterator[Lesson]:
    """Yield what beliefs are learned from once more, when they have learned from the others: new people."""
    for seed in _LATER_PEOPLE:
        turn = seed % 4
        for scene, height_mm in product(_LATER_HANDS, (1500.0, 750.0)):
            yield Lesson(scene, height_mm, seed)
        for scene, height_mm in product((*_LATER_FINGERS, _IN_TURN[turn], _STEREO_IN_TURN[turn]), (1500.0, 750.0)):
            yield Lesson(scene, height_mm, seed, most=_ENOUGH)
        yield Lesson(_THINGS_FAR[turn], 1500.0, seed)
        yield Lesson(_THINGS_NEAR[turn], 750.0, seed)
        for scene in _LATER_FAR:
            yield Lesson(scene, 1500.0, seed, most=_ENOUGH)
    for seed in _LASTING_PEOPLE:
        turn = seed % 3
        for scene in (*_ELSEWHERE, "targets-tilted", "five"):
            yield Lesson(scene, 1000.0, seed, most=_ENOUGH)
        for scene in _ELSEWHERE:
            yield Lesson(scene, _HEIGHTS_IN_TURN[turn], seed, most=_ENOUGH)
        for scene, height_mm in product(_LASTING[turn::3], (1500.0, 750.0)):
            yield Lesson(scene, height_mm, seed, most=_ENOUGH)
    for seed in _LAST_WORLDS:
        yield Lesson(None, 0.0, seed)
