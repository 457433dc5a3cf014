from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from touchd.errors import RecordingError
from touchd.lab.scoring import Score, figures, read_events, read_truth, score

from lab_tables import (
    SIZE_MM,
    Event,
    Stroke,
    TipJson,
    late,
    moved,
    perfect,
    renamed,
    seen,
    table,
    truth,
    with_cursor,
    without,
)

TWO_TAPS = table([[Stroke(8, 2, 100.0), Stroke(8, 2, 100.0)]])


def scored(frames: list[list[TipJson]], events: list[Event]) -> Score:
    return score(seen(events), truth(frames))


def frame_of(frames: list[list[TipJson]], touch: int) -> int:
    return next(i for i, tips in enumerate(frames) if any(t["tip"] == touch and t["touching"] for t in tips))


def test_two_taps_under_one_cursor_are_one_touch_and_a_merged_one() -> None:
    events = perfect(TWO_TAPS)
    first, last = frame_of(TWO_TAPS, 1), frame_of(TWO_TAPS, 2)
    tip = TWO_TAPS[first][0]
    held = with_cursor(without(without(events, 1), 2), {"id": 1, "x": tip["x"], "y": tip["y"]}, range(first, last + 2))
    got = scored(TWO_TAPS, held)
    assert (got.touches, got.found, got.merged) == (2, 1, 1)
    assert (got.splits, got.swaps, got.false_touches) == (0, 0, 0)


def test_of_touches_in_plain_sight_those_found_are_counted_apart() -> None:
    events = without(perfect(TWO_TAPS), 2)
    told = replace(truth(TWO_TAPS), visible={1: 0.95, 2: 0.4})
    got = score(seen(events), told)
    assert (got.touches, got.found, got.free, got.found_free) == (2, 1, 1, 1)
    assert (figures(got)["free"], figures(got)["found_free"]) == (50.0, 100.0)
    untold = figures(scored(TWO_TAPS, events))
    assert (untold["free"], untold["found_free"]) == (None, None)


def test_of_touches_in_plain_sight_those_that_changed_their_cursor_are_counted_apart() -> None:
    frames = table([[Stroke(8, 20, 100.0)], [Stroke(8, 20, 100.0)]])
    split = renamed(perfect(frames), 1, 99, frame_of(frames, 1) + 10)
    for plain, share in ((1, 100.0), (2, 0.0)):
        got = score(seen(split), replace(truth(frames), visible={plain: 0.95, 3 - plain: 0.4}))
        assert (got.splits, figures(got)["switches_free"]) == (1, share)


def test_two_fingers_that_exchange_their_cursors_are_two_swaps() -> None:
    frames = table([[Stroke(8, 20, 100.0)], [Stroke(8, 20, 100.0)]])
    half = frame_of(frames, 1) + 10
    crossed = renamed(renamed(renamed(perfect(frames), 1, 99, half), 2, 1, half), 99, 2, half)
    got = scored(frames, crossed)
    assert (got.found, got.splits, got.swaps, got.false_touches) == (2, 0, 2, 0)


def test_a_cursor_over_a_finger_that_only_hovers_is_false_and_tells_the_clearance_at_which_it_fired() -> None:
    frames = [[tip | {"tip": -1, "touching": False, "clearance_mm": 12.0} for tip in tips] for tips in TWO_TAPS]
    tip = frames[5][0]
    got = scored(frames, with_cursor(perfect(frames), {"id": 1, "x": tip["x"], "y": tip["y"]}, range(5, 9)))
    assert (got.touches, got.false_touches) == (0, 1)
    assert (got.fired_mm, got.released_mm) == ((12.0,), (12.0,))


def test_a_second_cursor_beside_the_right_one_is_false() -> None:
    frames = table([[Stroke(8, 20, 100.0)]])
    x, y = frames[10][0]["x"], frames[10][0]["y"]
    got = scored(frames, with_cursor(perfect(frames), {"id": 7, "x": x + 10.0 / SIZE_MM[0], "y": y}, range(10, 20)))
    assert (got.found, got.splits, got.false_touches) == (1, 0, 1)
    assert max(got.errors_mm) < 1e-9


def test_a_drag_with_a_cursor_in_less_than_half_of_its_frames_is_not_found() -> None:
    frames = table([[Stroke(8, 20, 100.0, 5.0)]])
    events = perfect(frames)
    short = [event if event["frame"] < 8 + 9 else event | {"cursors": []} for event in events]
    assert scored(frames, short).found == 0
    longer = [event if event["frame"] < 8 + 10 else event | {"cursors": []} for event in events]
    assert scored(frames, longer).found == 1


def test_a_tap_of_one_frame_that_is_found_a_frame_late_is_found() -> None:
    frames = table([[Stroke(8, 1, 100.0)]])
    got = scored(frames, late(perfect(frames), 1))
    assert (got.found, got.false_touches, got.down_frames, got.lift_frames) == (1, 0, (1.0,), (1.0,))


def test_a_cursor_that_stays_after_the_lift_is_late_by_all_its_frames() -> None:
    frames = table([[Stroke(8, 3, 100.0), Stroke(20, 3, 100.0)]])
    first = frame_of(frames, 1)
    tip = frames[first][0]
    stuck = with_cursor(without(perfect(frames), 1), {"id": 1, "x": tip["x"], "y": tip["y"]}, range(first, first + 15))
    got = scored(frames, stuck)
    assert (got.found, got.merged, got.lift_frames) == (2, 0, (12.0, 0.0))


def test_cursors_on_fingers_beside_the_area_are_neither_asked_for_nor_false() -> None:
    frames = table([[Stroke(8, 10, -4.0)]])
    assert all(tip["x"] < 0 for tips in frames for tip in tips)
    got = scored(frames, moved(perfect(frames), 4.0, 0.0))
    assert (got.touches, got.false_touches) == (0, 0)


def test_a_cursor_that_trails_a_fast_finger_has_its_lag_in_ms() -> None:
    frames = table([[Stroke(8, 30, 100.0, 16.0)]])  # 480 mm/s
    trailing = scored(frames, moved(perfect(frames), -9.6, 0.0))
    assert figures(trailing)["lag"] == pytest.approx(20.0, rel=0.1)
    sideways = scored(frames, moved(perfect(frames), 0.0, 9.6))
    assert figures(sideways)["lag"] == pytest.approx(0.0, abs=1e-6)


def test_the_wobble_is_the_standard_deviation_of_a_still_finger_s_cursor() -> None:
    frames = table([[Stroke(8, 90, 100.0)]])
    shaken = [moved([event], 0.5 * (-1) ** event["frame"], 0.0)[0] for event in perfect(frames)]
    assert figures(scored(frames, shaken))["wobble"] == pytest.approx(0.5, rel=0.01)
    assert figures(scored(frames, moved(perfect(frames), 3.0, 3.0)))["wobble"] == pytest.approx(0.0, abs=1e-9)


def pinch(least_gap_mm: float) -> tuple[list[list[TipJson]], list[Event]]:
    """Two fingers of a hand that draw together a millimetre a frame, and a tracker that sees one below a gap."""
    frames: list[list[TipJson]] = []
    events: list[Event] = []
    for index, gap_mm in enumerate(range(80, 15, -1)):
        tips = [
            {"tip": n, "finger": n, "hand": 1, "person": 0, "x": (300.0 + side * gap_mm / 2) / SIZE_MM[0], "y": 0.5}
            | {"clearance_mm": 0.0, "touching": True}
            for n, side in ((1, -1), (2, 1))
        ]
        frames.append(tips)
        both = [{"id": tip["tip"], "x": tip["x"], "y": tip["y"]} for tip in tips]
        cursors = both if gap_mm >= least_gap_mm else [{"id": 1, "x": 0.5, "y": 0.5}]
        events.append({"frame": index, "t": index / 30, "state": "tracking", "cursors": cursors})
    return frames, events


def test_a_finger_that_the_camera_cannot_see_tells_nothing_of_how_near_two_may_come() -> None:
    frames, events = pinch(40.0)
    told = replace(truth(frames), visible={1: 1.0, 2: 0.4})
    assert figures(score(seen(events), told))["gap"] is None


@pytest.mark.parametrize("least_gap_mm", [25.0, 40.0])
def test_a_pinch_is_resolved_down_to_where_two_fingers_become_one_cursor(least_gap_mm: float) -> None:
    assert figures(scored(*pinch(least_gap_mm)))["gap"] == least_gap_mm


def test_frames_before_the_first_tracked_one_do_not_count() -> None:
    events = [
        event | {"state": "calibrating", "cursors": []} if event["frame"] < 12 else event for event in perfect(TWO_TAPS)
    ]
    got = scored(TWO_TAPS, events)
    assert (got.touches, got.found) == (1, 1)
    assert got.tracked_s == pytest.approx((len(TWO_TAPS) - 12) / 30)


def test_a_crowd_is_five_fingers_of_a_hand_or_two_people_at_the_same_time() -> None:
    def together(fingers: int, people: int) -> list[list[TipJson]]:
        tips = table([[Stroke(5, 5, 100.0)] for _ in range(fingers)])
        return [[tip | {"hand": 0, "person": tip["finger"] % people} for tip in frame] for frame in tips]

    assert truth(together(5, 1)).crowded
    assert truth(together(2, 2)).crowded
    assert not truth(together(4, 1)).crowded
    alone = [[tip | {"person": tip["tip"]} for tip in frame] for frame in TWO_TAPS]
    assert not truth(alone).crowded


def test_figures_of_nothing_are_none_and_not_nought() -> None:
    assert figures(Score())["found"] is None
    assert figures(Score())["error_mean"] is None
    assert figures(Score())["gap"] is None


def test_percentiles_are_taken_over_all_frames() -> None:
    got = figures(Score(errors_mm=tuple(np.linspace(0.0, 10.0, 101).tolist())))
    assert (got["error_mean"], got["error_p95"], got["error_worst"]) == pytest.approx((5.0, 9.5, 10.0))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("not json\n", "line 1, is no JSON"),
        ('{"frame": 0}\n', "holds no events (KeyError: 't'): expected is a line a depth frame such as"),
        (
            '{"frame": 1, "t": 0.0, "state": "tracking", "cursors": []}\n' * 2,
            "holds no events (ValueError: frame 1 at 0.0 s comes after frame 1 at 0.0 s)",
        ),
        (
            '{"frame": 1, "t": 0.0, "state": "paused", "cursors": []}\n',
            'has no frame with state "tracking" in 1 lines: nothing can be scored',
        ),
    ],
)
def test_events_that_are_none_are_refused_in_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "events.jsonl"
    path.write_text(text)
    with pytest.raises(RecordingError) as caught:
        read_events(path)
    assert sentence in str(caught.value)


@pytest.mark.parametrize("text", ['{"tips": []}', "[[{}]]", "[1]", "nothing"])
def test_a_truth_that_is_none_is_refused_in_one_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "truth.json"
    path.write_text(text)
    with pytest.raises(RecordingError) as caught:
        read_truth(path, SIZE_MM)
    assert "is no truth file" in str(caught.value)


def test_events_of_a_longer_recording_than_the_truth_s_are_refused() -> None:
    with pytest.raises(RecordingError) as caught:
        score(seen(perfect(TWO_TAPS)), truth(TWO_TAPS[:5]))
    assert str(caught.value) == (
        "the events have a frame 5 but the truth has only 5 frames: score events of the recording that the truth "
        "belongs to"
    )


def test_wobble_in_both_axes_adds_up() -> None:
    frames = table([[Stroke(8, 90, 100.0)]])
    shaken = [moved([e], 0.3 * (-1) ** e["frame"], 0.4 * (-1) ** e["frame"])[0] for e in perfect(frames)]
    assert figures(scored(frames, shaken))["wobble"] == pytest.approx(sqrt(0.3**2 + 0.4**2), rel=0.01)
