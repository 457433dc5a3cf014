"""Visitors: fingers that do over time what people do, with what is true of them."""

from itertools import combinations, groupby

import pytest
from touchd.lab.learn.courses import course
from touchd.lab.learn.later import later_lessons
from touchd.lab.learn.visitors import Fingers, visitors
from touchd.lab.scoring import Truth


@pytest.fixture(scope="module")
def truths() -> dict[Fingers, Truth]:
    return {fingers: visitors(5, fingers, visits=6).truth for fingers in Fingers}


@pytest.fixture(params=list(Fingers))
def truth(request: pytest.FixtureRequest, truths: dict[Fingers, Truth]) -> Truth:
    return truths[request.param]


def test_a_touch_is_one_visit_to_the_surface(truth: Truth) -> None:
    down: dict[int, list[int]] = {}
    for index, tips in enumerate(truth.frames):
        for tip in tips:
            assert tip.touching == (tip.clearance_mm == 0.0)
            if tip.touching:
                down.setdefault(tip.touch, []).append(index)
    assert len(down) > 8
    assert all(frames == list(range(frames[0], frames[-1] + 1)) for frames in down.values())


def test_some_fingers_hover_low_and_never_touch_meanwhile(truth: Truth) -> None:
    heights = [[(tip.touch, tip.clearance_mm) for tip in tips] for tips in truth.frames]
    lasting = [(same[0], len(list(frames))) for same, frames in groupby(heights) if same]
    hovered = [(touch, height) for (touch, height), count in lasting if count >= 4 and 0.0 < height < 53.0]
    down = {tip.touch for tips in truth.frames for tip in tips if tip.touching}
    assert hovered
    assert not down & {touch for touch, _ in hovered}


def test_visitors_with_other_fingers_are_others(truths: dict[Fingers, Truth]) -> None:
    assert all(one.frames != other.frames for one, other in combinations(truths.values(), 2))


def test_varied_visitors_are_seen_by_cameras_of_several_kinds() -> None:
    kinds = {visitors(seed, Fingers.VARIED, visits=1).pipeline.sensor.kind for seed in (2, 3)}
    assert len(kinds) == 2


def test_the_same_visitors_come_again_and_are_seen_as_they_are() -> None:
    worlds = [visitors(7, Fingers.STRAIGHT, visits=1) for _ in range(2)]
    assert worlds[0].truth == worlds[1].truth
    first, again = (next(there.frames) for there in worlds)
    assert (first.raw == again.raw).all()


def test_beliefs_can_learn_from_them() -> None:
    there = visitors(5, Fingers.BENT, visits=2)
    seen = course(there.pipeline, there.frames, there.truth)
    assert seen is not None
    assert seen.touching.sum() > 20
    assert (seen.clearance_mm[seen.touching] == 0.0).all()
    assert (seen.finger & ~seen.touching).sum() > 20


def test_all_of_them_are_among_the_lessons() -> None:
    assert {lesson.scene for lesson in later_lessons()} >= set(Fingers)
