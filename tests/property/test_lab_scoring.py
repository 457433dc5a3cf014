from math import hypot

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from touchd.lab.scoring import Score, figures, pooled, score

from lab_tables import Event, Stroke, TipJson, late, moved, perfect, renamed, seen, table, truth, with_cursor, without

strokes = st.builds(
    Stroke, pause=st.integers(7, 12), frames=st.integers(1, 40), x_mm=st.floats(60, 180), step_mm=st.floats(0, 9)
)
tables = st.lists(st.lists(strokes, min_size=1, max_size=4), min_size=1, max_size=3).map(table)
some = settings(deadline=None, max_examples=40)


def scored(frames: list[list[TipJson]], events: list[Event]) -> Score:
    return score(seen(events), truth(frames))


@some
@given(tables, st.permutations(range(10, 20)))
def test_hands_are_right_whatever_numbers_they_have(frames: list[list[TipJson]], ids: list[int]) -> None:
    by_touch = {tip["tip"]: tip["hand"] for tips in frames for tip in tips}
    hands = [{"id": ids[hand], "x": 0.5, "y": 0.5, "height_mm": 40.0, "side": None, "person": 3} for hand in range(2)]
    events = [
        event | {"hands": hands, "cursors": [c | {"hand": ids[by_touch[c["id"]]]} for c in event["cursors"]]}
        for event in perfect(frames)
    ]
    got = figures(scored(frames, events))
    assert (got["hand_right"], got["person_right"]) == (100.0, 100.0)


def numbers(frames: list[list[TipJson]]) -> list[int]:
    return sorted({tip["tip"] for tips in frames for tip in tips if tip["touching"]})


def frames_of(frames: list[list[TipJson]], touch: int) -> list[int]:
    return [i for i, tips in enumerate(frames) if any(t["tip"] == touch and t["touching"] for t in tips)]


@some
@given(tables)
def test_a_perfect_tracker_has_a_perfect_score(frames: list[list[TipJson]]) -> None:
    got = scored(frames, perfect(frames))
    assert got.touches == got.found == len(numbers(frames))
    assert (got.merged, got.splits, got.swaps, got.false_touches) == (0, 0, 0, 0)
    assert max(got.errors_mm) < 1e-9
    assert set(got.down_frames) == set(got.lift_frames) == {0.0}
    assert set(got.fired_mm) == {0.0}
    assert all(abs(lag) < 1e-9 for lag in got.lags_ms)
    assert got.unresolved_gaps_mm == ()


@some
@given(tables, st.floats(-12, 12), st.floats(-12, 12))
def test_cursors_moved_by_a_way_have_an_error_of_its_length_and_no_other_fault(
    frames: list[list[TipJson]], dx_mm: float, dy_mm: float
) -> None:
    got, right = scored(frames, moved(perfect(frames), dx_mm, dy_mm)), scored(frames, perfect(frames))
    assert got.errors_mm == pytest.approx([hypot(dx_mm, dy_mm)] * len(right.errors_mm))
    assert (got.found, got.splits, got.swaps, got.false_touches) == (right.touches, 0, 0, 0)
    assert all(wobble < 1e-6 for wobble in got.wobbles_mm)


@some
@given(tables, st.data())
def test_a_touch_without_a_cursor_is_one_missed(frames: list[list[TipJson]], data: st.DataObject) -> None:
    missed = data.draw(st.sampled_from(numbers(frames)))
    got = scored(frames, without(perfect(frames), missed))
    assert got.touches - got.found == 1
    assert (got.splits, got.swaps, got.false_touches, got.merged) == (0, 0, 0, 0)


@some
@given(tables, st.data())
def test_a_touch_that_goes_on_under_a_new_id_is_a_split(frames: list[list[TipJson]], data: st.DataObject) -> None:
    touch = data.draw(st.sampled_from(numbers(frames)))
    touching = frames_of(frames, touch)
    assume(len(touching) > 1)
    at = data.draw(st.sampled_from(touching[1:]))
    got = scored(frames, renamed(perfect(frames), touch, 1000, at))
    assert (got.splits, got.swaps, got.false_touches) == (1, 0, 0)
    assert got.found == got.touches


@some
@given(tables, st.data())
def test_cursors_that_are_nowhere_near_a_finger_are_false_touches(
    frames: list[list[TipJson]], data: st.DataObject
) -> None:
    ghosts = data.draw(st.integers(1, 4))
    events = perfect(frames)
    for ghost in range(ghosts):
        begin = data.draw(st.integers(0, len(frames) - 1))
        cursor = {"id": 1000 + ghost, "x": 0.95, "y": 0.1 + 0.2 * ghost}
        events = with_cursor(events, cursor, range(begin, begin + data.draw(st.integers(1, 30))))
    got, right = scored(frames, events), scored(frames, perfect(frames))
    assert got.false_touches == ghosts
    assert (got.found, got.splits, got.errors_mm) == (right.found, 0, right.errors_mm)


@some
@given(tables, st.integers(1, 2))
def test_a_late_tracker_finds_all_that_late(frames: list[list[TipJson]], frames_late: int) -> None:
    got = scored(frames, late(perfect(frames), frames_late))
    assert set(got.down_frames) == set(got.lift_frames) == {float(frames_late)}
    assert got.found == got.touches
    assert (got.splits, got.swaps, got.false_touches) == (0, 0, 0)
    assert got.lags_ms == () or figures(got)["lag"] == pytest.approx(1000 / 30 * frames_late, rel=0.5)


@some
@given(st.lists(tables, min_size=1, max_size=4))
def test_runs_add_up(runs: list[list[list[TipJson]]]) -> None:
    each = [scored(frames, perfect(frames)) for frames in runs]
    together = pooled(each)
    assert together.touches == sum(one.touches for one in each)
    assert together.tracked_s == pytest.approx(sum(one.tracked_s for one in each))
    assert len(together.errors_mm) == sum(len(one.errors_mm) for one in each)
    assert pooled([]) == Score()
