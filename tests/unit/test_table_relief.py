import numpy as np
import pytest
from touchd.geometry import Doubles, rays
from touchd.table.backdrop import backdrop
from touchd.table.relief import FLAT_TABLE, Book, Bowl, Ground
from touchd.table.render import DepthRenderer
from touchd.table.scene import Block, Capsule, Hand, Place, Point, Sphere, TableCamera
from touchd.table.table import Table

SIZE = (640, 480)
CAMERA = TableCamera(900.0, 18.0, 7.0)
BOOK = Book((20.0, -10.0), (200.0, 150.0), 25.0, 20.0)
BOWL = Bowl((-15.0, 10.0), 130.0, 14.0)


def depth_at(depth: Doubles, camera: TableCamera, point: Point) -> tuple[float, float]:
    """Return what is seen in the pixel of a point, and how deep the point is."""
    u, v = camera.pixels(np.array(point)).round().astype(int).tolist()
    return float(depth[v, u]), float(camera.to_camera(np.array(point))[2])


def empty_depth(ground: Ground, camera: TableCamera = CAMERA) -> Doubles:
    return DepthRenderer(camera, SIZE, ground).table_mm.astype(np.float64)


@pytest.mark.parametrize("ground", [Ground((BOOK,)), Ground((BOWL,))])
@pytest.mark.parametrize("place", [(-15.0, 10.0), (40.0, -30.0), (60.0, 20.0), (-70.0, -40.0), (0.0, 65.0)])
def test_what_is_seen_of_a_book_and_a_bowl_is_where_its_height_says(ground: Ground, place: Place) -> None:
    seen, real = depth_at(empty_depth(ground), CAMERA, (*place, ground.height_at(place)))
    assert seen == pytest.approx(real, abs=0.7)


def test_beside_things_the_table_is_seen_as_if_nothing_was_there() -> None:
    ground = Ground((BOOK, BOWL))
    with_things, bare = empty_depth(ground), empty_depth(FLAT_TABLE)
    assert np.array_equal(with_things[:60], bare[:60])
    assert (with_things <= bare + 1e-3).all()
    assert (with_things < bare - 5.0).any()


def test_a_bowl_s_normal_leans_towards_its_middle_and_a_book_s_stands_upright() -> None:
    x, y, z = Ground((BOWL,)).normal_at((85.0, 10.0))
    assert x < -0.1
    assert y == pytest.approx(0.0)
    assert x * x + y * y + z * z == pytest.approx(1.0)
    heights = Ground((BOWL,)).height_mm(np.array([85.0, 86.0]), np.array([10.0, 10.0]))
    assert -x / z == pytest.approx(np.diff(heights)[0], abs=0.002)
    assert Ground((BOOK,)).normal_at((20.0, -10.0)) == (0.0, 0.0, 1.0)


def test_the_ground_s_top_is_that_of_its_highest_thing() -> None:
    assert (Ground((BOWL, BOOK)).top_mm, FLAT_TABLE.top_mm) == (25.0, 0.0)


def test_beyond_its_edges_the_table_gives_way_to_the_floor() -> None:
    ground = Ground(edges_mm=(-200.0, -150.0, 210.0, 160.0), floor_mm=-700.0)
    depth = empty_depth(ground)
    seen, real = depth_at(depth, CAMERA, (190.0, 100.0, 0.0))
    assert seen == pytest.approx(real, abs=1.0)
    seen, real = depth_at(depth, CAMERA, (600.0, 0.0, -700.0))
    assert seen == pytest.approx(real, abs=2.0)


def test_only_a_bare_endless_table_is_flat() -> None:
    u, v = np.meshgrid(np.arange(64.0), np.arange(48.0))
    ray = rays(CAMERA.intrinsics, np.stack([u, v], -1) * 10.0)
    assert backdrop(CAMERA, FLAT_TABLE, ray).flat
    assert not backdrop(CAMERA, Ground((BOOK,)), ray).flat


def test_a_block_s_top_is_seen_at_its_height_and_its_turn_is_clockwise() -> None:
    camera = TableCamera(900.0)
    block = Block((0.0, 0.0, 0.0), (300.0, 40.0, 50.0), 30.0)
    depth = DepthRenderer(camera, SIZE).render([Hand((block,), ())]).depth_mm.astype(np.float64)
    assert depth[240, 320] == pytest.approx(850.0, abs=0.01)
    inside, outside = (
        depth_at(depth, camera, (120.0 * np.cos(turn), 120.0 * np.sin(turn), 50.0))[0]
        for turn in np.radians([30.0, -30.0])
    )
    assert inside == pytest.approx(850.0, abs=0.01)
    assert outside == pytest.approx(900.0, abs=0.01)


def test_a_slanting_view_shows_a_block_s_side() -> None:
    camera = TableCamera(900.0, 35.0)
    block = Block((0.0, 0.0, 0.0), (200.0, 100.0, 80.0))
    depth = DepthRenderer(camera, SIZE).render([Hand((block,), ())]).depth_mm.astype(np.float64)
    seen, real = depth_at(depth, camera, (0.0, 50.0, 40.0))  # the middle of the side that faces the camera
    assert seen == pytest.approx(real, abs=1.5)


def test_dark_things_are_dark_only_where_nothing_light_lies_before_them() -> None:
    ball, veil = Sphere((0.0, 0.0, 100.0), 30.0), Sphere((0.0, 0.0, 40.0), 35.0)
    renderer = DepthRenderer(TableCamera(900.0), SIZE)
    behind = renderer.render([Hand((ball,), (), dark=(veil,))])
    before = renderer.render([Hand((veil,), (), dark=(ball,))])
    assert behind.dark is not None
    assert before.dark is not None
    assert not behind.dark[240, 320]
    assert behind.dark.any()
    assert before.dark[240, 320]
    assert renderer.render([Hand((ball,), ())]).dark is None


def test_nothing_is_read_of_a_dark_sleeve() -> None:
    table = Table(TableCamera(900.0), 1)
    arm = Capsule((-300.0, 0.0, 60.0), (300.0, 0.0, 60.0), 40.0, 40.0)
    light, dark = (
        np.array([table.render([hand], i, i).raw[232:248, 200:440] for i in range(4)])
        for hand in (Hand((arm,), ()), Hand((), (), dark=(arm,)))
    )
    assert (light == 2047).mean() < 0.02
    assert (dark == 2047).mean() > 0.95


def test_a_book_is_part_of_what_an_empty_table_reads() -> None:
    camera = TableCamera(900.0)
    table = Table(camera, 1, ground=Ground((Book((0.0, 0.0), (200.0, 150.0), 30.0),)))
    readings = np.median([table.render([], i, i).raw for i in range(12)], axis=0)
    book, bare = readings[230:250, 300:340].mean(), readings[20:40, 300:340].mean()
    to_mm = table.sensor.to_mm
    assert np.interp(book, np.arange(2048), to_mm) == pytest.approx(870.0, abs=1.5)
    assert np.interp(bare, np.arange(2048), to_mm) == pytest.approx(900.0, abs=1.5)


def test_readings_lost_at_outlines_stay_lost_for_a_while() -> None:
    table = Table(TableCamera(900.0), 1)
    beam = Hand((Capsule((-400.0, 0.0, 150.0), (400.0, 0.0, 150.0), 60.0, 60.0),), ())
    frames = np.array([table.render([beam], i, i).raw == 2047 for i in range(30)])[:, 120:360, 200:450]
    often = frames.mean(0)
    rims = (often > 0.05) & (often < 0.95)
    again = (frames[1:] & frames[:-1])[:, rims].sum() / frames[:-1][:, rims].sum()
    assert again > 1.5 * frames[:, rims].mean()
