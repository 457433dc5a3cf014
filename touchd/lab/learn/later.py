"""What beliefs learn on from, when they have learned from all else: new people, and what there had been little of."""

from collections.abc import Iterator
from itertools import product

from touchd.lab.learn.lessons import HANDS, Lesson
from touchd.lab.learn.visitors import Fingers

_LATER_HANDS = (*HANDS[:-1], "two-people", "passing", "four-hands")
_LATER_FINGERS = ("taps", "hover", "hover-height")
_LATER_FAR = ("taps-tilted", "forearm", "targets-tilted")
_IN_TURN = ("circles", "drag", "own-hand", "sway")  # one of four with each seed, as of the next three
_THINGS_FAR, _THINGS_NEAR = ("laptop", "phone", "cup", "book"), ("laptop", "book", "targets-book", "taps-tilted")
_STEREO = ("taps-stereo", "targets-stereo", "hover-stereo", "drag-stereo")
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
# Of what there had been little: other cameras, things, stereo.
_MIXED_WORLDS = {461: range(366, 386), 462: range(386, 406)}
_MIXED_FAR = (
    *_LATER_HANDS, "own-hand", "taps", "hover", "hover-height", "taps-tilted", "drag", "forearm", "targets-tilted",
)  # fmt: skip
_MIXED_NEAR = ("crowd", "four-hands", "ten", "two-people", "hover-height", "taps-tilted")
_MIXED_THINGS = ("laptop", "book", "targets-book", "phone", "cup")
_MIXED_REST = (*_LASTING, "sway", "circles")
# Fingers that cover their own tips, beside others of the same people.
_STEEP = ("own-hand", "ray", "taps-tilted", "targets-tilted", "forearm", "hover", "hover-height")
_STEEP_BESIDE = {  # at 0.75 m, at 1.5 m, and at another height
    461: (("crowd", "pinch", "hover-open", "book"), ("five", "passing", "dark-hair", "paper"), ("drag", 1000.0)),
    462: (
        ("ten", "writing", "dark-sleeve", "still"),
        ("crowd", "two-fingers", "four-hands", "laptop"),
        ("crowd", 600.0),
    ),
    463: (("crowd", "pinch", "hover-open", "cup"), ("five", "passing", "descent", "sweep"), ("taps", 1000.0)),
}
_STEEP_WORLDS = range(500, 518)
# Fingers that come down as if to touch and hover low; and so that those that hide their tips are not taken for them,
# more of these.
_VISITED = {
    Fingers.PLAIN: range(601, 657),
    Fingers.STRAIGHT: range(701, 773),
    Fingers.BENT: range(801, 840),
    Fingers.SEVERAL: range(901, 941),
}
_HIDDEN_PEOPLE = range(466, 474)
_HIDDEN_FAR = (
    "own-hand", "ray", "forearm", "taps-tilted", "targets-tilted", "crowd", "taps", "passing", "ten",
)  # fmt: skip
_HIDDEN_NEAR = ("own-hand", "ray", "taps-tilted", "forearm")
# Steep fingers of still more people, what had been taken for touches, heights, and visitors under other cameras.
_VARIED_PEOPLE = range(474, 484)
_VARIED_STEEP, _VARIED_FAR = ("own-hand", "ray"), ("hover-open", "forearm", "passing")
_VARIED_WORLDS = range(1001, 1055)
_THINGS, _THINGS_PEOPLE = ("book", "laptop", "phone", "cup"), range(492, 498)  # hands that hold them hover low
_ENOUGH = 450  # frames of a scene in which one hand does the same for long


def later_lessons() -> Iterator[Lesson]:
    """Yield all of it, in the order in which it was found to be needed."""
    yield from dict.fromkeys((*_new_people(), *_lasting(), *_mixed(), *_steep(), *_visited(), *_varied()))


def _new_people() -> Iterator[Lesson]:
    for seed in _LATER_PEOPLE:
        turn = seed % 4
        for scene, height_mm in product(_LATER_HANDS, (1500.0, 750.0)):
            yield Lesson(scene, height_mm, seed)
        for scene, height_mm in product((*_LATER_FINGERS, _IN_TURN[turn], _STEREO[turn]), (1500.0, 750.0)):
            yield Lesson(scene, height_mm, seed, most=_ENOUGH)
        yield Lesson(_THINGS_FAR[turn], 1500.0, seed)
        yield Lesson(_THINGS_NEAR[turn], 750.0, seed)
        for scene in _LATER_FAR:
            yield Lesson(scene, 1500.0, seed, most=_ENOUGH)


def _lasting() -> Iterator[Lesson]:
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


def _mixed() -> Iterator[Lesson]:
    for seed, worlds in _MIXED_WORLDS.items():
        turn = seed - 461
        for world in worlds:
            yield Lesson(None, 0.0, world)
        for scene, height_mm in product(_STEREO, (1500.0, 750.0)):
            yield Lesson(scene, height_mm, seed, most=_ENOUGH)
        for scene in _MIXED_THINGS:
            yield Lesson(scene, (1500.0, 750.0)[turn], seed)
        for scene in _MIXED_FAR:
            yield Lesson(scene, 1500.0, seed, most=_ENOUGH)
        for scene in _MIXED_NEAR:
            yield Lesson(scene, 750.0, seed, most=_ENOUGH)
        for scene in _MIXED_REST[turn::3]:
            yield Lesson(scene, (750.0, 1500.0)[turn], seed, most=_ENOUGH)
        for scene in _ELSEWHERE:
            yield Lesson(scene, (1000.0, 600.0)[turn], seed, most=_ENOUGH)


def _steep() -> Iterator[Lesson]:
    for seed, (near, far, (elsewhere, height_mm)) in _STEEP_BESIDE.items():
        for scene in (*_STEEP, "circles", "taps", *near):
            yield Lesson(scene, 750.0, seed, most=None if scene in _MIXED_THINGS else _ENOUGH)
        for scene in (*_STEEP, *far):
            yield Lesson(scene, 1500.0, seed, most=None if scene in _MIXED_THINGS else _ENOUGH)
        yield Lesson("own-hand", 1000.0, seed, most=_ENOUGH)
        yield Lesson(elsewhere, height_mm, seed, most=_ENOUGH)
    for scene, height_mm in product(_STEEP[:4], (750.0, 1500.0)):
        yield Lesson(scene, height_mm, 465, most=_ENOUGH)
    for world in _STEEP_WORLDS:
        yield Lesson(None, 0.0, world)


def _visited() -> Iterator[Lesson]:
    for fingers, seeds in _VISITED.items():
        for seed in seeds:
            yield Lesson(fingers, 0.0, seed)
    for seed in _HIDDEN_PEOPLE:
        for scene in _HIDDEN_FAR:
            yield Lesson(scene, 1500.0, seed, most=_ENOUGH)
        for scene in _HIDDEN_NEAR:
            yield Lesson(scene, 750.0, seed, most=_ENOUGH)


def _varied() -> Iterator[Lesson]:
    for seed in _VARIED_PEOPLE:
        for scene, height_mm in product(_VARIED_STEEP, (1500.0, 750.0, 1000.0)):
            yield Lesson(scene, height_mm, seed, most=_ENOUGH)
        for scene in (*_VARIED_FAR, _THINGS[seed % 4]):
            yield Lesson(scene, 1500.0, seed, most=_ENOUGH)
        for height_mm in (1500.0, 750.0):
            yield Lesson("hover-height", height_mm, seed, most=_ENOUGH)
    for seed in _VARIED_WORLDS:
        yield Lesson(Fingers.VARIED, 0.0, seed)
    for seed, scene, height_mm in product(_THINGS_PEOPLE, _THINGS, (1500.0, 750.0)):
        yield Lesson(scene, height_mm, seed)
