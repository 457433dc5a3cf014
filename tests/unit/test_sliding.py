"""Things that are part of the surface are pushed: the surface goes with them, and with it what can be touched."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.model import Floats, Image16, Intrinsics, Mask, Sensor
from touchd.surface.joining import Change
from touchd.surface.sliding import Sliding
from touchd.table.scene import Block, Capsule, Hand

from living_tables import AT_MM, Desk, cursor_counts, finger, off_raw

X, Y = AT_MM
SIZE = 120  # of the picture made by hand
HIGH_RAW = 20.0


def book(right_mm: float = 0.0, down_mm: float = 0.0, turn_deg: float = 20.0) -> Hand:
    return Hand((Block((X + right_mm, Y + down_mm, 0.0), (148.0, 105.0, 25.0), turn_deg),), ())


def mug(right_mm: float = 0.0, down_mm: float = 0.0) -> Hand:
    x, y = X + right_mm, Y + down_mm
    return Hand((Capsule((x, y, 38.0), (x, y, 50.0), 38.0, 38.0),), ())


def joined(height_mm: float, thing: Hand, method: str = "shell") -> Desk:
    """Return a desk on which a thing has become part of the surface."""
    desk = Desk(height_mm, method)
    desk.play(3, thing)
    desk.living.join(desk.mask_of(thing))
    desk.play(24, thing)
    assert np.mean(desk.living.part_of_surface[desk.mask_of(thing)]) > 0.9
    return desk


def overlap(a: Mask, b: Mask) -> float:
    return float(np.count_nonzero(a & b) / np.count_nonzero(a | b))


@pytest.mark.parametrize("height_mm", [750.0, 1500.0])
@pytest.mark.parametrize("thing", [book, mug])
def test_the_surface_goes_with_a_thing_that_is_pushed(height_mm: float, thing: Callable[..., Hand]) -> None:
    desk = joined(height_mm, thing())
    for step in range(1, 21):
        desk.play(1, thing(-3.0 * step, 2.0 * step))
    desk.play(4, there := thing(-60.0, 40.0))
    part, mask = desk.living.part_of_surface, desk.mask_of(there)
    assert overlap(part, mask) > 0.75
    assert np.abs(off_raw(desk, 0.0))[~mask].mean() < 0.1
    assert sum(cursor_counts(desk.play(10, there))) == 0


def test_the_surface_goes_with_a_thing_that_is_turned_as_it_is_pushed() -> None:
    desk = joined(750.0, book())
    for step in range(1, 26):
        desk.play(1, book(-1.5 * step, 0.0, 20.0 + 1.2 * step))
    there = book(-37.5, 0.0, 50.0)
    desk.play(4, there)
    assert overlap(desk.living.part_of_surface, desk.mask_of(there)) > 0.75


def test_what_is_tall_moves_farther_in_the_picture_and_the_surface_with_it() -> None:
    def laptop(down_mm: float) -> Hand:
        keys = Block((X, Y + down_mm, 0.0), (220.0, 130.0, 22.0))
        screen = Block((X, Y + down_mm - 60.0, 0.0), (220.0, 14.0, 170.0))
        return Hand((keys, screen), ())

    desk = joined(750.0, laptop(0.0))
    for step in range(1, 21):
        desk.play(1, laptop(3.0 * step))
    desk.play(4, there := laptop(60.0))
    mask = desk.mask_of(there)
    assert overlap(desk.living.part_of_surface, mask) > 0.88
    off = np.abs(desk.living.whole().reference - desk.frame([there]).raw)[mask]
    assert np.mean(off > 5.0) < 0.15


def test_what_was_pushed_is_given_back_once_it_is_taken_away() -> None:
    desk = joined(750.0, book())
    for step in range(1, 16):
        desk.play(1, book(-3.0 * step))
    desk.play(30)
    assert not desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0)).mean() < 0.05


def test_the_finger_that_pushes_a_thing_is_one_touch_all_the_way() -> None:
    desk = joined(750.0, book(turn_deg=0.0), "fingertip")
    edge_mm = Y + 0.5 * 105.0 + 10.0

    def pushing(step: int) -> Sequence[Hand]:
        return book(0.0, -3.0 * step, 0.0), finger(0.0, (X, edge_mm - 3.0 * step), heading_deg=0.0)

    above = desk.play(8, book(turn_deg=0.0), finger(20.0, (X, edge_mm), heading_deg=0.0))
    assert sum(cursor_counts(above)) == 0
    results = [result for step in [0] * 10 + list(range(20)) for result in desk.play(1, *pushing(step))]
    assert {cursor.session_id for result in results for cursor in result.cursors} == {1}
    assert cursor_counts(results[-20:]) == [1] * 20
    width_mm, depth_mm = results[-1].area_mm or (1.0, 1.0)
    began, ended = results[10].cursors[0], results[-1].cursors[0]
    assert (ended.y - began.y) * depth_mm == pytest.approx(-57.0, abs=6.0)
    assert (ended.x - began.x) * width_mm == pytest.approx(0.0, abs=4.0)


@pytest.mark.parametrize("clearance_mm", [26.0, 60.0])
def test_a_finger_on_a_thing_or_over_its_edge_does_not_push_it(clearance_mm: float) -> None:
    desk = joined(750.0, book())
    before = desk.living.part_of_surface
    for step in range(30):
        desk.play(1, book(), finger(clearance_mm, (X + 5.0 * (step - 15), Y + 45.0)))
        assert not desk.living.slides
    assert np.array_equal(desk.living.part_of_surface, before)


def sensor() -> Sensor:
    to_mm = np.full(2048, np.nan, np.float32)
    to_mm[300:1100] = np.arange(300, 1100, dtype=np.float32)
    step_mm = np.ones(2048, np.float32)
    lens = Intrinsics(500.0, 500.0, SIZE / 2, SIZE / 2)
    return Sensor("by hand", "1", (SIZE, SIZE), lens, "mm", 0, to_mm, step_mm, 0.5, "none", 0.0)


def slab(right_px: float, down_px: float, turn_deg: float) -> Floats:
    """Return what a slab of 50 x 34 px around a place near the picture's middle makes of a surface (H, W)."""
    v, u = np.mgrid[:SIZE, :SIZE] - np.array([58.0 + down_px, 62.0 + right_px])[:, None, None]
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    inside = (np.abs(c * u + s * v) <= 25.0) & (np.abs(c * v - s * u) <= 17.0)
    return np.where(inside, np.float32(-HIGH_RAW), np.float32(0.0))


def whole(by: Floats) -> Change:
    return Change((slice(0, SIZE), slice(0, SIZE)), by)


def picture(by: Floats, seed: int) -> Image16:
    noise = np.random.default_rng(seed).integers(-1, 2, (SIZE, SIZE))
    return (800 + by + noise).astype(np.uint16)


@settings(max_examples=40, deadline=None)
@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-2.0, 2.0), st.integers(0, 9))
def test_a_slab_that_slid_and_turned_is_found_within_a_pixel(
    right_px: float, down_px: float, turn_deg: float, seed: int
) -> None:
    start, moved = slab(0.0, 0.0, 0.0), slab(right_px, down_px, turn_deg)
    reference = np.float32(800.0) + start
    sliding = Sliding(sensor(), whole(start), start < 0.0, reference, 2.0)
    now = whole(start)
    assert sliding.step(picture(start, seed), reference, now) is None
    for _ in range(3):
        found = sliding.step(picture(moved, seed), np.float32(800.0) + _on_table(now), now)
        now = found[0] if found else now
    off = _on_table(now) != moved
    # Of the slab's outline, 168 px long: no more than one and a half px of it are wrong.
    assert np.count_nonzero(off) < 1.5 * 168


def _on_table(change: Change) -> Floats:
    table = np.zeros((SIZE, SIZE), np.float32)
    table[change.window] = change.by
    return table


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_noise_pushes_nothing(seed: int) -> None:
    start = slab(0.0, 0.0, 0.0)
    reference = np.float32(800.0) + start
    sliding = Sliding(sensor(), whole(start), start < 0.0, reference, 2.0)
    assert not any(sliding.step(picture(start, seed + i), reference, whole(start)) for i in range(8))


def test_what_is_too_small_to_tell_is_not_followed() -> None:
    start = np.zeros((SIZE, SIZE), np.float32)
    start[50:54, 50:54] = -HIGH_RAW
    sliding = Sliding(sensor(), whole(start), start < 0.0, np.float32(800.0) + start, 2.0)
    assert sliding.step(picture(np.zeros_like(start), 0), np.float32(800.0) + start, whole(start)) is None
