"""A surface that drifts is followed, and nothing that stands on it is ever learned."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from touchd.contacts.method import Expected, Sighting
from touchd.model import Frame, Image16, State, SurfaceRows
from touchd.ready import prepare
from touchd.surface.coarse import CoarseHeights
from touchd.surface.living import LivingSurface
from touchd.surface.settings import LivingSettings
from touchd.table.scene import Capsule, Hand

import living_tables as tables
from living_tables import Desk, cursor_counts, finger, learned, off_raw
from shifting_table import uneven

HEIGHTS = (750.0, 1500.0)


@pytest.mark.parametrize(
    ("height_mm", "sign", "method"),
    [
        (750.0, 1.0, "fingertip"),
        (1500.0, -1.0, "fingertip"),
        (750.0, -1.0, "shell"),
        (1500.0, -1.0, "shell"),
        (1500.0, 1.0, "shell"),
    ],
)
def test_drift_by_three_steps_in_25_seconds_makes_no_false_touch_and_loses_no_tap(
    height_mm: float, sign: float, method: str
) -> None:
    desk = Desk(height_mm, method)
    for tap in range(3):
        for step in range(80):
            desk.shift(uneven(sign * 3.0 * (80 * tap + step) / 750))
            assert desk.play(1)[0].cursors == ()
        assert sum(cursor_counts(desk.play(3, finger()))) >= 2, f"tap {tap} is lost"
        assert desk.play(4, finger(60.0))[-1].cursors == ()
    assert np.abs(off_raw(desk, uneven(sign * 3.0 * 239 / 750))).mean() < 0.1


def test_a_surface_that_does_not_change_stays_as_it_was_learned() -> None:
    desk = Desk(750.0, "shell")
    desk.play(90)
    assert np.abs(off_raw(desk, 0.0)).mean() < 0.03
    vitals = desk.pipeline.vitals
    assert vitals is not None
    assert vitals.drift_mm < 0.2


def test_drift_goes_on_under_a_hand_that_hides_the_surface() -> None:
    desk = Desk(750.0, frame_ns=100_000_000)
    for step in range(100):
        desk.shift(uneven(0.02 * step))
        (cursor,) = desk.play(1, finger())[0].cursors
        assert cursor.session_id == 1
    under = desk.mask_of(finger())
    assert np.abs(off_raw(desk, uneven(0.02 * 99))[under]).max() < 0.25


def forearm(at_mm: tuple[float, float], high_mm: float) -> Hand:
    """An arm that lies on the table, from the picture's lower border to a place."""
    x, y = at_mm
    return Hand((Capsule((x, y, high_mm / 2), (x + 60.0, y + 700.0, high_mm / 2), high_mm / 2, high_mm / 2),), ())


class Held:
    """A surface over which the same picture stays for ever; only its noise is new."""

    def __init__(self, height_mm: float, *hands: Hand) -> None:
        table, self.surface = learned(height_mm)
        made = prepare(self.surface, tables.settings(height_mm, "shell"))
        self.living = LivingSurface(self.surface, made.surface_map)
        self.coarse = CoarseHeights(self.surface, made.surface_map)
        depth = table.true_depth(hands)
        self.raws = [table.read(depth, 500 + i) for i in range(16)]

    def changed_raw(self, pictures: int) -> float:
        """Return by how much the surface was changed anywhere after so many pictures."""
        seen = [(Frame(0, 0, raw), self.coarse.over(raw)) for raw in self.raws]
        for index in range(pictures):
            frame, coarse = seen[index % len(seen)]
            self.living.step(replace(frame, index=index, t_ns=index * 33_333_333), coarse)
            assert self.living.why is None
        off = np.where(self.surface.valid, self.living.whole().reference - self.surface.reference, 0.0)
        # What was learned of a hand would be many pixels wide; a few pictures' noise is not.
        return float(np.abs(cv2.blur(off, (9, 9))).max())


@settings(max_examples=6, deadline=None, phases=[Phase.explicit, Phase.generate])
@given(
    height_mm=st.sampled_from(HEIGHTS),
    x=st.floats(-120.0, 120.0),
    y=st.floats(-80.0, 80.0),
    heading_deg=st.floats(0.0, 360.0),
    arm_mm=st.floats(30.0, 80.0),
)
def test_an_arm_and_a_finger_that_never_move_are_never_learned(
    height_mm: float, x: float, y: float, heading_deg: float, arm_mm: float
) -> None:
    held = Held(height_mm, finger(0.0, (x, y), heading_deg), forearm((x - 150.0, y), arm_mm))
    # As many visits to every pixel as it takes to learn two thirds of what is seen.
    assert held.changed_raw(2000) < 0.3


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_a_finger_held_for_ten_minutes_stays_one_touch(height_mm: float) -> None:
    desk = Desk(height_mm)
    pictures = [desk.frame([finger()]).raw for _ in range(16)]
    seen = [
        desk.pipeline.step(Frame(second, second * 1_000_000_000, pictures[second % 16])).cursors
        for second in range(600)
    ]
    assert {tuple(cursor.session_id for cursor in cursors) for cursors in seen} == {(1,)}


def test_what_is_not_held_up_is_learned_in_time() -> None:
    held = Held(750.0)
    stripes = np.indices(held.surface.valid.shape)[1] // 40 % 5 == 0
    held.raws = [(raw - stripes).astype(np.uint16) for raw in held.raws]
    assert held.changed_raw(2000) > 0.35


class KeepsItsSurface:
    """A contact method of before there were living surfaces."""

    def __init__(self) -> None:
        self.pictures = 0

    def find(self, raw: Image16, expected: Sequence[Expected]) -> Sighting:
        assert raw.shape == (480, 640)
        assert list(expected) == []
        self.pictures += 1
        return Sighting([])


def test_a_method_that_does_not_follow_is_left_alone() -> None:
    desk = Desk(750.0, "shell", frame_ns=100_000_000)
    ready, method = desk.pipeline.ready, KeepsItsSurface()
    assert ready is not None
    desk.pipeline.adopt(ready.settings, replace(ready, method=method))
    for step in range(30):
        desk.shift(0.03 * step)
        assert desk.play(1)[0].state is State.TRACKING
    assert method.pictures == 30


def test_a_surface_that_is_not_to_be_followed_stays_as_it_was_learned() -> None:
    desk = Desk(750.0)
    ready = desk.pipeline.ready
    assert ready is not None
    desk.pipeline.adopt(replace(ready.settings, living=LivingSettings(follow=False)), ready)
    desk.shift(6.0)
    assert all(result.why is None for result in desk.play(10))
    assert desk.pipeline.vitals is None


def test_a_surface_that_is_followed_again_begins_as_it_was_learned() -> None:
    desk = Desk(750.0, "shell", frame_ns=100_000_000)
    ready = desk.pipeline.ready
    assert ready is not None
    for step in range(60):
        desk.shift(-0.05 * step)
        desk.play(1)
    for follow in (False, True):
        desk.pipeline.adopt(replace(ready.settings, living=LivingSettings(follow)), ready)
    desk.shift(0.0)
    assert sum(cursor_counts(desk.play(20))) == 0
    assert cursor_counts(desk.play(2, finger())) == [1, 1]


def test_other_settings_find_the_surface_as_it_is_by_then() -> None:
    desk = Desk(750.0, frame_ns=100_000_000)
    for step in range(60):
        desk.shift(-0.05 * step)
        desk.play(1)
    ready = desk.pipeline.ready
    assert ready is not None
    other = tables.settings(750.0, "shell")
    desk.pipeline.adopt(other, prepare(ready.surface, other, ready))
    assert sum(cursor_counts(desk.play(5))) == 0


def test_rows_are_told_whole_and_in_the_order_of_the_picture() -> None:
    desk = Desk(750.0)
    told: list[SurfaceRows] = []
    coarse = tables.ready(750.0)
    for _ in range(70):
        desk.shift(0.5)
        frame = desk.frame()
        told += desk.living.step(frame, coarse.over(frame.raw))
    rows = {row for now in told for row in range(now.rows.start, now.rows.stop)}
    assert rows == set(range(480))
    assert all(now.reference.shape == (now.rows.stop - now.rows.start, 640) for now in told)


def test_the_same_frames_give_the_same_surface() -> None:
    first, second = Desk(750.0, "shell"), Desk(750.0, "shell")
    for desk in (first, second):
        desk.shift(0.3)
        desk.play(20, finger())
    assert np.array_equal(first.living.whole().reference, second.living.whole().reference)
