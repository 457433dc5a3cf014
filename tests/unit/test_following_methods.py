"""What contact methods know of a surface goes with it: followed by rows, it is as if made for the surface as it is."""

from dataclasses import replace

import numpy as np
import pytest
from touchd.contacts.heights import Box, Heights
from touchd.contacts.method import FollowsSurface
from touchd.contacts.settings import BlobSettings
from touchd.contacts.shell import ShellFinder
from touchd.contacts.things import Things
from touchd.geometry import map_surface
from touchd.model import Floats, Surface, SurfaceRows
from touchd.surface.settings import ShellSettings
from touchd.surface.shell import shell_over

from living_tables import Desk, learned
from shifting_table import SHAPE, gradient

INSIDE = np.ones(SHAPE, np.bool_)
INSIDE[:21] = INSIDE[:, :30] = False
WHOLE = Box(0, 0, SHAPE[1], SHAPE[0])


def moved(surface: Surface, by: Floats) -> Surface:
    """Return a surface as it would have been learned elsewhere."""
    reference = (surface.reference + by).astype(np.float32)
    return replace(surface, reference=reference, dmax=np.rint(surface.dmax + by).astype(np.uint16))


def rows_of(surface: Surface) -> list[SurfaceRows]:
    return [SurfaceRows(slice(top, top + 16), surface.reference[top : top + 16]) for top in range(0, SHAPE[0], 16)]


@pytest.fixture(scope="module", params=[750.0, 1500.0])
def surface(request: pytest.FixtureRequest) -> Surface:
    found = learned(request.param)[1]
    # Where it could not be read there is nothing to compare.
    return replace(found, valid=found.valid & (np.indices(SHAPE)[1] < SHAPE[1] - 16))


BOOK = np.zeros(SHAPE, np.float32)
BOOK[180:300, 240:400] = -12.0
CHANGES = {"drift": np.full(SHAPE, 2.0, np.float32), "knock": gradient(6.0), "book": BOOK}


@pytest.mark.parametrize("change", CHANGES)
def test_heights_are_those_over_the_surface_as_it_is_by_now(surface: Surface, change: str) -> None:
    now = moved(surface, CHANGES[change])
    followed = Heights(surface, map_surface(surface), INSIDE)
    for rows in rows_of(now):
        followed.follow(rows)
    step_mm = float(np.nanmedian(surface.sensor.step_mm[surface.dmax[surface.valid]]))
    for high_raw in (0, 4, 9):
        raw = np.rint(now.reference - high_raw).astype(np.uint16)
        heights, readings = followed.over(raw, WHOLE)
        seen = heights[(readings > 0) & INSIDE & surface.valid]
        assert np.median(seen) == pytest.approx(high_raw * step_mm, rel=0.1, abs=0.3 * step_mm)
        assert np.abs(seen - np.median(seen)).max() < 1.5 * step_mm


def test_over_a_thing_a_pixel_is_smaller_and_a_step_lower(surface: Surface) -> None:
    heights = Heights(surface, map_surface(surface), INSIDE)
    before = heights.lay(320.0, 240.0)
    for rows in rows_of(moved(surface, BOOK)):
        heights.follow(rows)
    on_it, beside = heights.lay(320.0, 240.0), heights.lay(100.0, 240.0)
    z_mm, z_there_mm = (surface.sensor.to_mm[round(float(surface.reference[240, 320])) + off] for off in (0, -12))
    assert on_it.pixel_mm == pytest.approx(before.pixel_mm * z_there_mm / z_mm, rel=0.01)
    assert on_it.step_mm == pytest.approx(before.step_mm * (z_there_mm / z_mm) ** 2, rel=0.01)
    assert (on_it.x_by_z, on_it.y_by_z) == (before.x_by_z, before.y_by_z)
    assert beside == Heights(surface, map_surface(surface), INSIDE).lay(100.0, 240.0)


@pytest.mark.parametrize("change", CHANGES)
def test_what_stands_above_the_surface_as_it_is_by_now_is_noticed_and_the_surface_is_not(
    surface: Surface, change: str
) -> None:
    heights = Heights(surface, map_surface(surface), INSIDE)
    things = Things(heights, (5.6, 11.4), 1.6)
    now = moved(surface, CHANGES[change])
    for rows in rows_of(now):
        heights.follow(rows)
        things.follow(rows.rows)
    assert things.busy(np.rint(now.reference).astype(np.uint16)) is None
    raw = np.rint(now.reference).astype(np.uint16)
    raw[230:246, 300:316] -= np.uint16(8)
    box = things.busy(raw)
    assert box is not None
    assert max(box.left - 300, 316 - box.right, box.top - 230, 246 - box.bottom) <= 0
    assert box.right - box.left < 60


@pytest.mark.parametrize("change", CHANGES)
def test_the_shell_goes_with_the_surface(surface: Surface, change: str) -> None:
    now = moved(surface, CHANGES[change])
    finder = ShellFinder(surface, shell_over(surface, ShellSettings()), BlobSettings(), INSIDE)
    for rows in rows_of(now):
        finder.follow(rows)
    raw = np.rint(now.reference).astype(np.uint16)
    assert finder.find(raw) == []
    raw[230:246, 300:316] -= np.uint16(3)
    (blob,) = finder.find(raw)
    assert (blob.u, blob.v) == pytest.approx((307.5, 237.5), abs=1.0)
    assert blob.surface_raw - blob.seen_raw == pytest.approx(3.0, abs=0.3)
    raw[230:246, 300:316] -= np.uint16(30)
    assert finder.find(raw) == []


def test_rows_that_read_as_they_did_change_nothing(surface: Surface) -> None:
    shell = shell_over(surface, ShellSettings())
    before, after = (ShellFinder(surface, shell, BlobSettings(), INSIDE) for _ in range(2))
    for rows in rows_of(surface):
        after.follow(rows)
    assert np.array_equal(before._low, after._low)
    assert np.array_equal(before._high, after._high)


def test_our_own_methods_follow() -> None:
    for method in ("fingertip", "shell"):
        ready = Desk(750.0, method).pipeline.ready
        assert ready is not None
        assert isinstance(ready.method, FollowsSurface)
