"""What a client of profile 2Dblb is told: the rectangle around each thing on the surface, and how it moves."""

import math
from collections.abc import Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.model import State, TableObject, TouchFrame
from touchd.outputs.blobs import Blobs
from touchd.outputs.screen import ScreenMap
from touchd.outputs.things import Blob

FRAME_NS = 33_333_333
AREA_MM = (800.0, 600.0)


def box(
    object_id: int, x_mm: float, y_mm: float, size_mm: tuple[float, float] = (150.0, 75.0), angle: float = 0.0
) -> TableObject:
    """Return a thing of that size, its longer side at ``angle`` from the x axis, clockwise."""
    width, height = size_mm
    corners = []
    for along, across in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
        u, v = along * width, across * height
        x = x_mm + u * math.cos(angle) - v * math.sin(angle)
        y = y_mm + u * math.sin(angle) + v * math.cos(angle)
        corners.append((x / AREA_MM[0], y / AREA_MM[1]))
    return TableObject(object_id, tuple(corners), 8.0)


class Client:
    """Frames of tracking, 30 a second, to one destination."""

    def __init__(self, placement: ScreenMap | None = None, most: int = 60) -> None:
        self.view = Blobs(placement or ScreenMap(), most)
        self.index = 0

    def see(self, *objects: TableObject) -> list[Blob]:
        self.index += 1
        frame = TouchFrame(self.index, self.index * FRAME_NS, State.TRACKING, objects=objects, area_mm=AREA_MM)
        told = self.view.of(frame)
        assert all(isinstance(each, Blob) for each in told)
        return [each for each in told if isinstance(each, Blob)]


def ids(told: Sequence[Blob]) -> list[int]:
    return [each.session_id for each in told]


def test_a_phone_is_told_by_its_centre_its_sides_their_angle_and_its_area() -> None:
    (told,) = Client().see(box(1, 400.0, 150.0))
    assert (told.x, told.y) == pytest.approx((0.5, 0.25))
    assert (told.width, told.height) == pytest.approx((150.0 / 800.0, 75.0 / 600.0))
    assert told.angle % math.pi == pytest.approx(0.0, abs=1e-5)
    assert told.area == pytest.approx(150.0 * 75.0 / (800.0 * 600.0))


@given(angle=st.floats(0.02, 3.1), width=st.floats(40.0, 200.0), slimness=st.floats(0.2, 0.9))
def test_a_rectangle_at_any_angle_is_found_in_the_surface_s_lengths(
    angle: float, width: float, slimness: float
) -> None:
    (told,) = Client().see(box(1, 400.0, 300.0, (width, width * slimness), angle))
    assert told.width * AREA_MM[0] == pytest.approx(width, rel=1e-3)
    assert told.height * AREA_MM[1] == pytest.approx(width * slimness, rel=1e-3)
    assert told.angle == pytest.approx(angle, abs=2e-3)


def test_what_lies_still_has_no_velocity_and_no_acceleration() -> None:
    client = Client()
    seen = [client.see(box(1, 400.0, 300.0, angle=0.4))[0] for _ in range(10)]
    assert {(b.vx, b.vy, b.turn, b.accel, b.turn_accel) for b in seen} == {(0.0, 0.0, 0.0, 0.0, 0.0)}


@pytest.mark.parametrize("shake_mm", [1.0, 5.0])
def test_an_outline_that_flickers_is_still(shake_mm: float) -> None:
    client = Client()
    seen = [
        client.see(box(1, 400.0 + shake_mm * (k % 2), 300.0, (150.0 + k % 3, 75.0), 0.4 + 0.02 * (k % 2)))[0]
        for k in range(30)
    ]
    assert all(b == seen[0] for b in seen)


def test_a_thing_that_was_pushed_and_lies_again_comes_to_rest_where_it_is() -> None:
    client = Client()
    for k in range(10):
        client.see(box(1, 200.0 + 8.0 * k, 300.0))
    seen = [client.see(box(1, 272.0 + 2.0 * (k % 2), 300.0))[0] for k in range(30)]
    assert all((b.vx, b.vy, b.turn) == (0.0, 0.0, 0.0) for b in seen[15:])
    assert seen[-1].x * AREA_MM[0] == pytest.approx(273.0, abs=2.0)
    assert max(b.x for b in seen[25:]) - min(b.x for b in seen[25:]) < 1e-4


def test_a_thing_that_is_pushed_has_the_velocity_of_the_push() -> None:
    client = Client()
    seen = [client.see(box(1, 200.0 + 8.0 * k, 300.0))[0] for k in range(20)]
    assert seen[-1].vx == pytest.approx(8.0 * 30.0 / 800.0, rel=0.02)
    assert seen[-1].vy == 0.0
    assert seen[-1].accel == pytest.approx(0.0, abs=0.05)
    assert seen[2].accel > 0.0
    assert seen[-1].x == pytest.approx((200.0 + 8.0 * 19) / 800.0, abs=0.01)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_thing_that_is_turned_round_has_the_turns_a_second_and_never_jumps(direction: float) -> None:
    client = Client()
    seen = [client.see(box(1, 400.0, 300.0, angle=0.3 + direction * 0.1 * k))[0] for k in range(80)]
    steps = [(b.angle - a.angle + math.pi) % math.tau - math.pi for a, b in pairwise(seen)]
    assert all(0.0 <= direction * step < 0.13 for step in steps)
    assert all(0.0 <= b.angle < math.tau for b in seen)
    assert seen[-1].turn == pytest.approx(direction * 0.1 * 30.0 / math.tau, rel=0.02)
    assert all(b.width == pytest.approx(150.0 / 800.0, rel=1e-3) for b in seen)


def test_a_square_does_not_turn_when_its_other_side_comes_out_longer() -> None:
    client = Client()
    seen = [client.see(box(1, 400.0, 300.0, (80.0 + k % 2, 80.5), angle=0.2))[0] for k in range(20)]
    assert {b.turn for b in seen} == {0.0}
    assert max(b.angle for b in seen) - min(b.angle for b in seen) < 0.01


def test_a_client_that_shows_the_left_half_turned_gets_the_rectangle_as_it_lies_on_its_screen() -> None:
    client = Client(ScreenMap((0.0, 0.0, 2.0, 1.0)))
    (told,) = client.see(box(1, 200.0, 300.0, angle=0.5))
    assert (told.x, told.y) == pytest.approx((0.5, 0.5))
    assert (told.width, told.height) == pytest.approx((150.0 / 400.0, 75.0 / 600.0))
    assert told.angle == pytest.approx(0.5, abs=1e-3)
    (quarter,) = Client(ScreenMap(swap_axes=True, flip_x=True)).see(box(1, 400.0, 300.0, angle=0.5))
    assert (quarter.width, quarter.height) == pytest.approx((150.0 / 600.0, 75.0 / 800.0))
    assert quarter.angle == pytest.approx(0.5 + math.pi / 2.0, abs=1e-3)


def test_what_lies_beyond_the_client_s_screen_is_not_told() -> None:
    client = Client(ScreenMap((0.0, 0.0, 2.0, 1.0)))
    assert ids(client.see(box(1, 600.0, 300.0), box(2, 200.0, 300.0))) == [2]


def test_a_thing_that_was_away_comes_back_under_a_new_id_as_after_a_pause() -> None:
    client = Client()
    assert ids(client.see(box(4, 400.0, 300.0), box(7, 100.0, 100.0))) == [1, 2]
    assert ids(client.see(box(7, 100.0, 100.0))) == [2]
    assert ids(client.see(box(4, 400.0, 300.0), box(7, 100.0, 100.0))) == [2, 3]
    client.view.end_all()
    assert ids(client.see(box(4, 400.0, 300.0))) == [4]


@pytest.mark.parametrize("outline", [(), ((0.5, 0.5),), ((0.5, 0.5), (0.5, 0.5), (0.5, 0.5)), ((0.1, 0.2), (0.3, 0.4))])
def test_an_outline_without_an_inside_breaks_nothing(outline: tuple[tuple[float, float], ...]) -> None:
    client = Client()
    for _ in range(3):
        told = client.see(TableObject(1, outline, 3.0))
        assert len(told) == (1 if outline else 0)
        assert all(b.area == 0.0 and math.isfinite(b.angle) for b in told)
