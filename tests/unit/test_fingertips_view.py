"""What a client of profile 25Dcur is told: each fingertip as one cursor, from the air to the surface and back."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.model import Cursor, Hover, State, TouchFrame
from touchd.outputs.fingertips import Fingertips
from touchd.outputs.screen import Screen, ScreenMap
from touchd.outputs.things import AirCursor

FRAME_NS = 33_333_333
FULL_MM = 40.0


def touch(session_id: int, x: float = 0.5, vx: float = 0.0, hover_id: int | None = None) -> Cursor:
    return Cursor(session_id, x, 0.25, vx, 0.0, 0.0, 4.0, 60.0, 0.0, hover_id=hover_id)


def hover(
    hover_id: int, height_mm: float = 20.0, x: float = 0.5, vz_mm_s: float = 0.0, session_id: int | None = None
) -> Hover:
    return Hover(hover_id, x, 0.25, height_mm, vz_mm_s=vz_mm_s, session_id=session_id)


class Client:
    """Frames of tracking, 30 a second, to one destination."""

    def __init__(self, screen: Screen | None = None) -> None:
        self.view = Fingertips(screen or Screen(), FULL_MM)
        self.index = 0

    def see(self, *things: Cursor | Hover) -> list[AirCursor]:
        self.index += 1
        touches = tuple(each for each in things if isinstance(each, Cursor))
        hovers = tuple(each for each in things if isinstance(each, Hover))
        frame = TouchFrame(self.index, self.index * FRAME_NS, State.TRACKING, touches, hovers=hovers)
        told = self.view.of(frame)
        assert all(isinstance(each, AirCursor) for each in told)
        return [each for each in told if isinstance(each, AirCursor)]


def ids(told: Sequence[AirCursor]) -> list[int]:
    return [each.session_id for each in told]


def test_a_touch_is_at_0_and_a_hover_at_its_share_of_the_greatest_height() -> None:
    told = Client().see(touch(1, 0.125), hover(1, 10.0, 0.75), hover(2, 40.0), hover(3, 44.0))
    assert [(each.x, each.y, each.z) for each in told] == [
        *[(0.125, 0.25, 0.0), (0.75, 0.25, 0.25)],
        *[(0.5, 0.25, 1.0), (0.5, 0.25, 1.0)],
    ]


def test_a_finger_that_comes_down_touches_and_lifts_again_is_one_cursor() -> None:
    client = Client()
    seen = [
        *client.see(hover(5, 30.0)),
        *client.see(hover(5, 12.0)),
        *client.see(touch(9, hover_id=5)),
        *client.see(touch(9, hover_id=5)),
        *client.see(hover(6, 11.0, session_id=9)),
        *client.see(hover(6, 35.0, session_id=9)),
    ]
    assert set(ids(seen)) == {1}
    assert [each.z for each in seen] == [0.75, 0.3, 0.0, 0.0, 0.275, 0.875]


def test_fingers_that_nothing_links_are_different_cursors() -> None:
    client = Client()
    client.see(hover(1))
    assert ids(client.see(touch(1))) != [1]
    assert ids(client.see(hover(2)))[-1] > 2


def test_a_hover_that_is_hidden_for_one_frame_stays_where_it_was_and_then_ends() -> None:
    client = Client()
    client.see(hover(1, 20.0, vz_mm_s=40.0))
    (held,) = client.see()
    assert (held.session_id, held.z, held.vz) == (1, 0.5, 0.0)
    assert client.see() == []


def test_a_hover_that_comes_back_after_one_frame_keeps_its_id_and_later_ones_do_not() -> None:
    client = Client()
    client.see(hover(1))
    client.see()
    assert ids(client.see(hover(1))) == [1]
    client.see()
    client.see()
    assert ids(client.see(hover(1))) == [2]


def test_a_hover_that_touches_after_a_frame_without_it_is_followed() -> None:
    client = Client()
    client.see(hover(1))
    client.see()
    assert ids(client.see(touch(1, hover_id=1))) == [1]


def test_a_touch_that_ends_is_gone_at_once() -> None:
    client = Client()
    client.see(touch(1))
    assert client.see() == []


def test_the_speed_of_rising_and_sinking_is_in_shares_of_the_greatest_height_a_second() -> None:
    (falling,) = Client().see(hover(1, 20.0, vz_mm_s=-100.0))
    assert falling.vz == -2.5


def test_the_frame_that_lands_has_the_speed_of_its_last_fall_and_the_next_has_none() -> None:
    client = Client()
    client.see(hover(1, 10.0))
    (landed,) = client.see(touch(1, hover_id=1))
    assert landed.vz == pytest.approx(-0.25 * 30.0)
    (rests,) = client.see(touch(1, hover_id=1))
    assert math.copysign(1.0, rests.vz + 0.0) == 1.0
    assert rests.vz == 0.0


def test_the_acceleration_is_the_change_of_all_three_axes_speed() -> None:
    client = Client()
    client.see(hover(1, vz_mm_s=0.0))
    (faster,) = client.see(hover(1, vz_mm_s=-40.0))
    assert faster.accel == pytest.approx(1.0 * 30.0)
    (touching,) = client.see(touch(1, vx=0.5, hover_id=1))
    assert touching.accel == pytest.approx((math.hypot(0.5, 0.5 * 30.0) - 1.0) * 30.0)


def test_the_client_s_map_moves_fingertips_and_leaves_their_height() -> None:
    client = Client(Screen(ScreenMap((0.0, 0.0, 2.0, 1.0), flip_y=True)))
    (placed,) = client.see(hover(1, 10.0, 0.25))
    assert (placed.x, placed.y, placed.z) == (0.5, 0.75, 0.25)


def test_after_a_pause_no_id_comes_back() -> None:
    client = Client()
    client.see(touch(1), hover(1))
    client.view.end_all()
    assert ids(client.see(hover(1))) == [3]


fates = st.lists(st.lists(st.sampled_from(["air", "touch", "gone"]), min_size=4, max_size=4), min_size=1, max_size=25)


@given(fates)
def test_no_id_ever_comes_back_and_no_two_fingers_share_one(script: list[list[str]]) -> None:
    """Four fingers that land, lift and leave at random, linked as the trackers link them."""
    client = Client()
    last: list[tuple[str, int]] = [("gone", 0)] * 4
    count = 0
    ended: set[int] = set()
    alive: set[int] = set()
    for states in script:
        things: list[Cursor | Hover] = []
        for finger, state in enumerate(states):
            before, number = last[finger]
            if state != before:
                count += 1
            number = number if state == before else count
            came_from = last[finger][1] if before not in (state, "gone") else None
            if state == "touch":
                things.append(touch(number, hover_id=came_from))
            elif state == "air":
                things.append(hover(number, session_id=came_from))
            last[finger] = state, number
        told = ids(client.see(*things))
        assert len(set(told)) == len(told)
        assert not ended & set(told)
        ended |= alive - set(told)
        alive = set(told)
        assert len(told) >= len(things)
