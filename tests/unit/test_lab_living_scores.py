"""Scores of a surface that lives: upsets, things, whose finger is whose, hovers."""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pytest
from touchd.errors import RecordingError
from touchd.lab.scoring import HAPPENINGS_NAME, Score, figures, pooled, read_truth, score, truth_of

from lab_tables import SIZE_MM, Event, Stroke, TipJson, moved, perfect, renamed, seen, table, with_cursor, without

Happenings = Sequence[dict[str, Any]]
Frames = Sequence[Sequence[TipJson]]
# The first touch lasts from frame 8 to 47, the second one from 72 to 81; both at x = 100 mm, y = 50 mm.
TWO_TOUCHES = table([[Stroke(8, 40, 100.0), Stroke(20, 10, 100.0)]])
SECOND = range(72, 82)


def scored(frames: Frames, events: Iterable[Event], happenings: Happenings = ()) -> Score:
    return score(seen(events), truth_of(frames, SIZE_MM, happenings))


def knocked(frames: Iterable[int]) -> Happenings:
    return [{"frame": at, "upset": "knocked", "things": []} for at in frames]


def rectangle(left_mm: float, top_mm: float, right_mm: float, bottom_mm: float) -> list[list[float]]:
    corners = ((left_mm, top_mm), (right_mm, top_mm), (right_mm, bottom_mm), (left_mm, bottom_mm))
    return [[x / SIZE_MM[0], y / SIZE_MM[1]] for x, y in corners]


def things(frames: Iterable[int], x_mm: float = 100.0, held: bool = False) -> Happenings:
    """A thing of 80 x 60 mm whose middle is at (x_mm, 50 mm)."""
    outline = rectangle(x_mm - 40.0, 20.0, x_mm + 40.0, 80.0)
    thing = {"id": 1, "kind": "phone", "outline": outline, "footprint": outline, "height_mm": 8.0, "held": held}
    return [{"frame": at, "upset": None, "things": [thing]} for at in frames]


def changed(frames: Frames, which: Iterable[int], change: dict[str, Any]) -> list[list[TipJson]]:
    """Return the truth with something else about every fingertip of some frames."""
    these = set(which)
    return [[tip | change if at in these else tip for tip in tips] for at, tips in enumerate(frames)]


def told(events: Iterable[Event], key: str, of: Callable[[Event], Any]) -> list[Event]:
    return [event | {key: of(event)} for event in events]


def test_nothing_besides_touches_is_told_where_nothing_happens_and_a_program_says_nothing() -> None:
    got = figures(scored(TWO_TOUCHES, perfect(TWO_TOUCHES)))
    keys = ("outlived", "after_found", "on_found", "lay_found", "on_false", "hand_right", "hovers_found", "hover_error")
    assert [got[key] for key in keys] == [None] * len(keys)


def test_a_touch_during_a_knock_is_not_asked_for_and_the_one_after_it_is() -> None:
    got = scored(TWO_TOUCHES, perfect(TWO_TOUCHES), knocked(range(20, 60)))
    assert (got.touches, got.found, got.false_touches) == (1, 1, 0)
    assert (got.upset.after, got.upset.found_after) == (1, 1)
    assert max(got.upset.errors_after_mm) < 1e-9
    lost = scored(TWO_TOUCHES, without(perfect(TWO_TOUCHES), 2), knocked(range(20, 60)))
    assert figures(lost)["after_found"] == 0.0


def test_errors_after_an_upset_are_those_of_the_touches_after_it() -> None:
    got = figures(scored(TWO_TOUCHES, moved(perfect(TWO_TOUCHES), 3.0, 4.0), knocked(range(20, 60))))
    assert got["after_error"] == pytest.approx(5.0)


@pytest.mark.parametrize("frames", [1, 3, 12])
def test_how_long_a_cursor_outlives_a_knock_counts_to_the_first_frame_without_it(frames: int) -> None:
    events = [e | {"cursors": []} if 20 + frames <= e["frame"] < 60 else e for e in perfect(TWO_TOUCHES)]
    events = [event | {"t": round(event["t"], 9)} for event in events]
    got = figures(scored(TWO_TOUCHES, events, knocked(range(20, 60))))
    assert got["outlived"] == pytest.approx(frames * 1e3 / 30, abs=0.01)


def test_a_cursor_that_a_knock_makes_of_nothing_outlives_it_and_is_false_and_one_on_a_finger_is_neither() -> None:
    quiet = [event | {"cursors": []} if 20 <= event["frame"] < 60 else event for event in perfect(TWO_TOUCHES)]
    ghost = scored(
        TWO_TOUCHES, with_cursor(quiet, {"id": 9, "x": 0.8, "y": 0.8}, range(25, 34)), knocked(range(20, 60))
    )
    assert ghost.upset.outlived_ms == pytest.approx([300.0], abs=0.01)
    assert ghost.false_touches == 1
    tip = TWO_TOUCHES[30][0]
    on_it = with_cursor(quiet, {"id": 9, "x": tip["x"], "y": tip["y"]}, range(25, 40))
    assert scored(TWO_TOUCHES, on_it, knocked(range(20, 60))).upset.outlived_ms == ()
    assert scored(TWO_TOUCHES, on_it, knocked(range(20, 60))).false_touches == 0


def test_a_cursor_in_a_knock_that_is_a_little_early_for_its_touch_outlives_nothing() -> None:
    frames = [[tip | {"clearance_mm": 6.0, "touching": False} for tip in tips] for tips in TWO_TOUCHES[:28]]
    frames += TWO_TOUCHES[28:]
    quiet = [event | {"cursors": []} if event["frame"] < 26 else event for event in perfect(TWO_TOUCHES)]
    assert scored(frames, quiet, knocked(range(20, 60))).upset.outlived_ms == ()


def test_touches_are_counted_on_a_thing_beside_it_and_where_it_lay() -> None:
    raised = changed(TWO_TOUCHES, SECOND, {"z_mm": 8.0})
    on = scored(raised, perfect(raised), things(range(60, 90)))
    assert (on.things.on, on.things.found_on, on.things.beside, on.things.where_lay) == (1, 1, 0, 0)
    beside = scored(TWO_TOUCHES, perfect(TWO_TOUCHES), things(range(60, 90), x_mm=300.0))
    assert (beside.things.on, beside.things.beside, beside.things.found_beside) == (0, 1, 1)
    lay = scored(TWO_TOUCHES, without(perfect(TWO_TOUCHES), 2), things(range(50, 60)))
    assert (lay.things.where_lay, lay.things.found_where_lay) == (1, 0)
    assert (figures(lay)["lay_found"], figures(lay)["on_found"]) == (0.0, None)


@pytest.mark.parametrize(("held", "lies"), [(False, range(50, 70)), (True, range(50, 70)), (False, range(50, 55))])
def test_a_false_touch_on_a_thing_or_where_it_lay_is_the_thing_s(held: bool, lies: range) -> None:
    events = with_cursor(perfect(TWO_TOUCHES), {"id": 9, "x": 300.0 / SIZE_MM[0], "y": 0.125}, range(60, 66))
    before = things([45], x_mm=300.0)
    got = scored(TWO_TOUCHES, events, [*before, *things(lies, x_mm=300.0, held=held)])
    on = 60 in lies
    assert (got.false_touches, got.things.false_on, got.things.false_where_lay) == (1, int(on), int(not on))


def test_a_cursor_on_a_finger_that_holds_a_thing_is_not_false_if_it_goes_with_the_hand() -> None:
    holding = changed(TWO_TOUCHES, range(90), {"tip": -1, "touching": False, "clearance_mm": 8.0, "either": True})
    free = changed(holding, range(40, 90), {"clearance_mm": 90.0, "either": False})
    tip = free[20][0]
    cursor = {"id": 1, "x": tip["x"], "y": tip["y"]}
    nothing = [event | {"cursors": []} for event in perfect(TWO_TOUCHES)]
    assert scored(free, with_cursor(nothing, cursor, range(20, 45))).false_touches == 0
    assert scored(free, with_cursor(nothing, cursor, range(20, 60))).false_touches == 1
    assert scored(free, with_cursor(nothing, cursor, range(60, 70))).false_touches == 1


def test_objects_are_seen_where_things_lie_and_ghosts_where_none_is() -> None:
    lies = things(range(90), x_mm=400.0)
    right = {"id": 1, "outline": rectangle(360.0, 20.0, 440.0, 80.0), "height_mm": 8.0}
    wrong = {"id": 2, "outline": rectangle(100.0, 300.0, 140.0, 340.0), "height_mm": 8.0}
    events = perfect(TWO_TOUCHES)
    all_right = figures(scored(TWO_TOUCHES, told(events, "objects", lambda _: [right]), lies))
    assert (all_right["things_seen"], all_right["ghosts"]) == (100.0, 0.0)
    half = figures(scored(TWO_TOUCHES, told(events, "objects", lambda _: [right, wrong]), lies))
    assert (half["things_seen"], half["ghosts"]) == (100.0, 50.0)
    none = figures(scored(TWO_TOUCHES, told(events, "objects", lambda _: [wrong]), lies))
    assert (none["things_seen"], none["ghosts"]) == (0.0, 100.0)


# Two hands of two people, touching in frames 8 to 47.
TWO_HANDS = [
    [tip | {"hand": tip["finger"], "person": tip["finger"], "side": ("left", "right")[tip["finger"]]} for tip in tips]
    for tips in table([[Stroke(8, 40, 100.0)], [Stroke(8, 40, 100.0)]])
]


def owned(hand_of: Callable[[int, int], int | None], side: str | None = None) -> list[Event]:
    """Return right events in which a touch's cursor has the hand that a function of touch and frame gives.

    Hand n is person n's.
    """
    events = []
    for event in perfect(TWO_HANDS):
        cursors = [c | {"hand": hand_of(c["id"], event["frame"])} for c in event["cursors"]]
        hands = [{"id": n, "x": 0.5, "y": 0.5, "height_mm": 50.0, "side": side, "person": n} for n in (4, 5, 6, 7)]
        events.append(event | {"cursors": cursors, "hands": hands})
    return events


def test_hands_are_right_whatever_their_ids_if_each_stands_for_one() -> None:
    got = figures(scored(TWO_HANDS, owned(lambda touch, _: {1: 6, 2: 5}[touch])))
    assert (got["hand_right"], got["person_right"], got["side_right"]) == (100.0, 100.0, None)


def test_one_hand_for_two_and_two_for_one_are_wrong_for_the_lesser_part() -> None:
    shared = figures(scored(TWO_HANDS, owned(lambda _touch, _: 5)))
    assert (shared["hand_right"], shared["person_right"]) == (50.0, 50.0)
    renewed = figures(scored(TWO_HANDS, owned(lambda touch, at: 7 if touch == 1 and at >= 38 else 4 + touch)))
    assert renewed["hand_right"] == pytest.approx(87.5)
    missing = figures(scored(TWO_HANDS, owned(lambda touch, _: 5 if touch == 1 else None)))
    assert missing["hand_right"] == 50.0


def test_a_hand_that_was_away_may_come_back_under_another_id() -> None:
    frames = [*TWO_HANDS, *([[]] * 20), *TWO_HANDS]
    first = owned(lambda touch, _: 4 + touch)
    empty = [{"frame": len(first) + i, "cursors": []} for i in range(20)]
    again = [e | {"frame": e["frame"] + len(first) + 20} for e in owned(lambda touch, _: {1: 7, 2: 4}[touch])]
    events = [e | {"t": e["frame"] / 30, "state": "tracking"} for e in (*first, *empty, *again)]
    assert figures(scored(frames, events))["hand_right"] == 100.0


def test_a_side_is_right_or_wrong_where_it_is_said() -> None:
    assert figures(scored(TWO_HANDS, owned(lambda touch, _: 4 + touch, "left")))["side_right"] == 50.0


def hovering(clearance_mm: float) -> list[list[TipJson]]:
    """Return the truth of a finger that hovers in frames 0 to 49, touches in 50 to 59, and hovers again."""
    return changed(table([[Stroke(50, 10, 100.0, 4.0)]]), [*range(50), *range(60, 64)], {"clearance_mm": clearance_mm})


def with_hovers(frames: Frames, off_mm: float, until: int = 999) -> list[Event]:
    def hovers(event: Event) -> list[Event]:
        tips = [tip for tip in frames[event["frame"]] if not tip["touching"] and event["frame"] < until]
        return [{"id": 1, "x": t["x"], "y": t["y"], "height_mm": t["clearance_mm"] + off_mm} for t in tips]

    return told(perfect(frames), "hovers", hovers)


def test_hovers_are_found_or_not_and_have_an_error_of_height() -> None:
    frames = hovering(20.0)
    got = figures(scored(frames, with_hovers(frames, -2.5)))
    assert (got["hovers_found"], got["hover_error"], got["hover_p95"]) == pytest.approx((100.0, 2.5, 2.5))
    half = figures(scored(frames, with_hovers(frames, 0.0, until=26)))
    assert half["hovers_found"] == pytest.approx(50.0, abs=3.0)


def test_fingers_higher_than_hovers_are_followed_are_not_asked_for() -> None:
    frames = hovering(45.0)
    assert scored(frames, with_hovers(frames, 0.0)).hovering.hovering == 0


@pytest.mark.parametrize(("speed_mm_s", "error_mm_s"), [(60.0, 0.0), (0.0, 60.0), (100.0, 40.0)])
def test_the_first_frame_of_a_touch_that_follows_a_hover_has_an_error_of_place_and_of_velocity(
    speed_mm_s: float, error_mm_s: float
) -> None:
    frames = hovering(20.0)  # at rest until it touches: from the frame before the touch to the one after, 60 mm/s
    velocity = {"vx": speed_mm_s / SIZE_MM[0], "vy": 0.0}
    events = told(moved(perfect(frames), 3.0, 0.0), "cursors", lambda e: [c | velocity for c in e["cursors"]])
    got = figures(scored(frames, events))
    assert got["landing_error"] == pytest.approx(3.0)
    assert got["landing_speed"] == pytest.approx(error_mm_s, abs=1e-6)


def test_a_program_that_tells_no_velocity_has_no_error_of_it() -> None:
    frames = hovering(20.0)
    got = figures(scored(frames, perfect(frames)))
    assert got["landing_error"] == pytest.approx(0.0, abs=1e-9)
    assert got["landing_speed"] is None


def test_a_touch_that_comes_down_from_above_hovers_follows_none() -> None:
    frames = hovering(60.0)
    assert scored(frames, perfect(frames)).hovering.landing_errors_mm == ()


def test_the_scores_of_runs_add_up_with_those_within_them() -> None:
    one = scored(TWO_TOUCHES, perfect(TWO_TOUCHES), knocked(range(20, 60)))
    other = scored(TWO_HANDS, owned(lambda touch, _: 4 + touch))
    both = pooled([one, other, one])
    assert (both.upset.upsets, both.upset.after, both.owners.contacts) == (2, 2, other.owners.contacts)
    assert both.upset.outlived_ms == one.upset.outlived_ms * 2


def test_happenings_are_read_from_beside_the_truth(tmp_path: Path) -> None:
    (tmp_path / "truth.json").write_text(json.dumps(TWO_TOUCHES))
    (tmp_path / HAPPENINGS_NAME).write_text(json.dumps([*knocked([20]), *things([30])]))
    read = read_truth(tmp_path / "truth.json", SIZE_MM)
    assert read == truth_of(TWO_TOUCHES, SIZE_MM, [*knocked([20]), *things([30])])
    assert set(read.happenings) == {20, 30}


def test_happenings_that_are_none_are_refused_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "truth.json").write_text("[]")
    (tmp_path / HAPPENINGS_NAME).write_text('[{"frame": 1}]')
    with pytest.raises(RecordingError) as caught:
        read_truth(tmp_path / "truth.json", SIZE_MM)
    assert str(caught.value) == (
        f"{tmp_path / HAPPENINGS_NAME} holds no happenings (KeyError: 'things'): expected is a list of frames such as "
        '{"frame": 100, "upset": null, "things": []}'
    )


def test_a_split_of_a_held_finger_is_one_however_long_it_was_held() -> None:
    frames = table([[Stroke(8, 300, 100.0)]])
    assert figures(scored(frames, perfect(frames)))["switches"] == 0.0
    assert figures(scored(frames, renamed(perfect(frames), 1, 2, 200)))["switches"] == 100.0
