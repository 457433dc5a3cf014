"""Whatever fingertips seem to be of, they change hands rarely; whatever was pushed is found again."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.hands.thing import moved, shape_of
from touchd.hands.whose import Owners
from touchd.model import CoarsePicture

SIGHTS = st.lists(
    st.tuples(st.sampled_from([None, 1, 2, 3]), st.sets(st.sampled_from([1, 2, 3]), min_size=1)),
    min_size=1,
    max_size=40,
)


@given(SIGHTS)
def test_a_fingertip_stays_with_its_hand_while_that_lives_unless_another_is_seen_for_long(
    sights: list[tuple[int | None, set[int]]],
) -> None:
    owners, before = Owners(), None
    for i, (seen, living) in enumerate(sights):
        now = owners.settle({7: seen}, living)[7]
        if before is None or before not in living:
            assert now == seen
        elif now != before:
            recent = [hand for hand, _ in sights[max(0, i - 5) : i + 1]]
            assert recent == [now] * 6
        before = now


@given(SIGHTS)
def test_a_fingertip_that_is_gone_is_forgotten(sights: list[tuple[int | None, set[int]]]) -> None:
    owners = Owners()
    for seen, living in sights:
        owners.settle({7: seen}, living)
    owners.settle({}, {1, 2, 3})
    assert owners.settle({7: 3}, {1, 2, 3}) == {7: 3}


@settings(max_examples=40)
@given(
    left=st.integers(20, 100),
    top=st.integers(20, 80),
    size=st.tuples(st.integers(6, 14), st.integers(6, 14)),
    height_mm=st.floats(8.0, 100.0),
    way=st.tuples(st.integers(-6, 6), st.integers(-6, 6)),
    seed=st.integers(0, 99),
)
def test_by_how_much_a_thing_was_pushed_is_seen(
    left: int, top: int, size: tuple[int, int], height_mm: float, way: tuple[int, int], seed: int
) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 1.0, (120, 160)).astype(np.float32)
    before, after = np.zeros((2, 120, 160), np.float32)
    before[top : top + size[1], left : left + size[0]] = height_mm
    after[top + way[1] : top + way[1] + size[1], left + way[0] : left + way[0] + size[0]] = height_mm
    shape = shape_of(before > 0.0, before)
    assert moved(shape, CoarsePicture(after + noise, np.ones(after.shape, np.bool_)), 6) == way
