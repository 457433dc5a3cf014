"""The picture stage of the fingertip method: where something stands above the surface, how high, and its outlines."""

from dataclasses import replace

import numpy as np
import pytest
from touchd.contacts.heights import Box, Heights
from touchd.contacts.things import Things
from touchd.geometry import Doubles, map_surface, raw_of_depth
from touchd.model import Image16, Sensor, Surface

from aligned_table import SENSOR

SIZE = (480, 640)
Z_MM = 750.0
LEVELS_MM = (5.6, 11.4)
STEP_MM = 1.6


def raw_at(height_mm: Doubles | float) -> Image16:
    return np.rint(raw_of_depth(SENSOR, np.asarray(Z_MM - height_mm))).astype(np.uint16)


def picture() -> Image16:
    return np.full(SIZE, raw_at(0.0), np.uint16)


def heights_over(sensor: Sensor, raw: Image16) -> Heights:
    everywhere = np.ones(SIZE, np.bool_)
    surface = Surface(
        sensor=sensor,
        reference=raw.astype(np.float32),
        dmax=raw,
        noise=np.full(SIZE, 0.5, np.float32),
        valid=everywhere,
        moved=~everywhere,
        frames=1,
        made_from="a test",
    )
    inside = np.zeros(SIZE, np.bool_)
    inside[20:460, 20:620] = True
    return Heights(surface, map_surface(surface), inside)


@pytest.fixture(scope="module")
def heights() -> Heights:
    return heights_over(SENSOR, picture())


@pytest.fixture
def things(heights: Heights) -> Things:
    return Things(heights, LEVELS_MM, STEP_MM)


def test_specks_of_noise_keep_no_one_busy(things: Things) -> None:
    raw = picture()
    for v, u in ((20, 20), (101, 100), (200, 301), (458, 618)):
        raw[v : v + 2, u : u + 2] = raw_at(12.0)
    assert things.busy(raw) is None


@pytest.mark.parametrize("at", [(100, 100), (101, 100), (102, 303), (240, 320)])
def test_a_fingertip_of_seven_pixels_alone_is_enough_and_its_box_leaves_room_around_it(
    things: Things, at: tuple[int, int]
) -> None:
    raw = picture()
    rows, columns = np.indices(SIZE)
    raw[np.hypot(rows - at[0], columns - at[1]) <= 3.5] = raw_at(12.0)
    box = things.busy(raw)
    assert box is not None
    room = (at[0] - 3 - box.top, box.bottom - at[0] - 4, at[1] - 3 - box.left, box.right - at[1] - 4)
    assert min(room) >= 10
    assert max(room) <= 18


def test_what_is_outside_is_not_looked_at(things: Things) -> None:
    raw = picture()
    raw[:18] = raw[:, 622:] = raw_at(30.0)
    assert things.busy(raw) is None


def test_what_is_too_high_for_a_fingertip_needs_no_room(things: Things) -> None:
    raw = picture()
    raw[100:300, 100:200] = raw_at(90.0)
    assert things.busy(raw) is None
    raw[260:300, 140:160] = raw_at(15.0)
    box = things.busy(raw)
    assert box is not None
    assert box.top >= 240
    assert box.left >= 125


def test_what_gives_no_reading_stands_nowhere(things: Things, heights: Heights) -> None:
    raw = picture()
    raw[100:200, 100:200] = SENSOR.invalid
    assert things.busy(raw) is None
    seen_mm, readings = heights.over(raw, Box(90, 90, 110, 110))
    assert seen_mm[15, 15] == -20.0
    assert readings[15, 15] == 0
    assert readings[5, 5] == 255


def test_a_sensor_whose_missing_readings_look_near_shows_nothing_there_either() -> None:
    to_mm = np.arange(4000, dtype=np.float32)
    to_mm[:300] = np.nan
    sensor = replace(SENSOR, unit="mm", invalid=0, to_mm=to_mm, step_mm=np.where(to_mm > 0.0, np.float32(1.0), to_mm))
    raw = np.full(SIZE, round(Z_MM), np.uint16)
    heights = heights_over(sensor, raw)
    things = Things(heights, LEVELS_MM, 1.0)
    raw[100:200, 100:200] = 0
    assert things.busy(raw) is None
    seen_mm, readings = heights.over(raw, Box(90, 90, 110, 110))
    assert (seen_mm[15, 15], readings[15, 15]) == (-20.0, 0)
    raw[300:320, 300:320] -= 20
    assert things.busy(raw) is not None


@pytest.mark.parametrize(("height_mm", "seen_mm"), [(0.0, 0.0), (13.0, 13.0), (30.0, 30.0), (200.0, 120.0)])
def test_heights_are_in_mm_up_to_where_all_is_hand(heights: Heights, height_mm: float, seen_mm: float) -> None:
    raw = picture()
    raw[100:120, 100:120] = raw_at(height_mm)
    seen, _ = heights.over(raw, Box(90, 95, 130, 125))
    assert seen.shape == (30, 40)
    assert seen.dtype == np.float32
    np.testing.assert_allclose(seen[10, 15], seen_mm, atol=STEP_MM)


def test_only_what_rises_like_a_hand_has_outlines_one_at_each_level(things: Things) -> None:
    box = Box(100, 100, 200, 200)
    seen_mm = np.zeros((100, 100), np.float32)
    seen_mm[10:30, 10:30] = 20.0
    seen_mm[50:90, 50:90] = 30.0
    outlines = things.outlines(seen_mm, seen_mm, box)
    assert [outline.level for outline in outlines] == [0, 1]
    assert all(outline.points.min() == 50 for outline in outlines)
    assert all(outline.points.max() == 89 for outline in outlines)


def test_what_the_border_cuts_off_may_be_lower(things: Things) -> None:
    seen_mm = np.zeros((100, 100), np.float32)
    seen_mm[:30, 10:30] = 20.0
    assert things.outlines(seen_mm, seen_mm, Box(100, 100, 200, 200)) == []
    assert len(things.outlines(seen_mm, seen_mm, Box(100, 20, 200, 120))) == 2
