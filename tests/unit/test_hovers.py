"""Fingertips in the air: followed under ids of their own, up to a height, and not where a touch is."""

from dataclasses import replace

import pytest
from touchd.model import Contact, Hover
from touchd.tracking.handover import Ground
from touchd.tracking.hovers import HoverTracker
from touchd.tracking.settings import TrackingSettings

AREA_MM = (600.0, 400.0)
FRAME_NS = 33_333_333


def airborne(x_mm: float, y_mm: float, height_mm: float = 20.0) -> Contact:
    return Contact(x_mm / AREA_MM[0], y_mm / AREA_MM[1], x_mm, y_mm, height_mm, 150.0, 0.0, firm=False)


class Air:
    def __init__(self, settings: TrackingSettings | None = None) -> None:
        self.tracker = HoverTracker(settings or TrackingSettings(), AREA_MM)
        self.t_ns = 0

    def see(self, *contacts: Contact, touches_mm: tuple[tuple[float, float], ...] = ()) -> tuple[Hover, ...]:
        self.t_ns += FRAME_NS
        return self.tracker.step(contacts, self.t_ns, Ground(touches_mm))


def test_a_fingertip_in_the_air_keeps_its_id_while_it_moves_and_sinks() -> None:
    air = Air()
    seen = [air.see(airborne(300.0 + 10.0 * k, 200.0, 30.0 - 5.0 * k))[0] for k in range(4)]
    assert {hover.hover_id for hover in seen} == {1}
    assert [hover.height_mm for hover in seen] == pytest.approx([30.0, 25.0, 20.0, 15.0], abs=2.0)
    assert seen[-1].x * AREA_MM[0] == pytest.approx(330.0, abs=8.0)


def test_its_velocity_is_the_way_since_the_last_frame_and_it_has_the_speed_of_its_sinking() -> None:
    air = Air()
    before = air.see(airborne(100.0, 200.0, 40.0 - 0.1))[0]
    for k in range(1, 16):
        (hover,) = air.see(airborne(100.0 + 10.0 * k, 200.0, 39.9 - 2.0 * k))
        assert hover.vx == pytest.approx((hover.x - before.x) / (FRAME_NS / 1e9))
        before = hover
    assert hover.vx * AREA_MM[0] == pytest.approx(300.0, rel=0.03)
    assert hover.vz_mm_s == pytest.approx(-60.0, rel=0.03)


def test_a_finger_that_is_held_still_in_the_air_has_exactly_no_velocity() -> None:
    air = Air()
    air.see(airborne(300.0, 200.0))
    for wobble in (0.1, -0.1, 0.05):
        (hover,) = air.see(airborne(300.0 + wobble, 200.0, 20.0 + wobble))
        assert (hover.vx, hover.vy, hover.vz_mm_s) == (0.0, 0.0, 0.0)


def test_the_height_of_a_finger_that_is_held_still_wobbles_less_than_what_is_seen() -> None:
    air = Air()
    heights = [air.see(airborne(300.0, 200.0, 20.0 + (-1) ** k))[0].height_mm for k in range(20)]
    assert heights[-4:] == pytest.approx([20.0] * 4, abs=0.5)


def test_each_fingertip_has_an_id_of_its_own_whichever_is_named_first() -> None:
    air = Air()
    one, other = airborne(100.0, 200.0), airborne(160.0, 200.0)
    first = {hover.x: hover.hover_id for hover in air.see(one, other)}
    assert {hover.x: hover.hover_id for hover in air.see(other, one)} == first
    assert sorted(first.values()) == [1, 2]


def test_one_that_is_not_seen_for_a_frame_is_not_told_of_and_keeps_its_id() -> None:
    air = Air()
    air.see(airborne(300.0, 200.0))
    assert air.see() == ()
    assert air.see(airborne(302.0, 200.0))[0].hover_id == 1


def test_one_that_stays_away_comes_back_under_a_new_id() -> None:
    air = Air()
    air.see(airborne(300.0, 200.0))
    for _ in range(3):
        air.see()
    assert air.see(airborne(300.0, 200.0))[0].hover_id == 2


def test_what_is_higher_than_hovers_are_followed_is_none() -> None:
    air = Air(TrackingSettings(hover_mm=25.0))
    assert air.see(airborne(300.0, 200.0, 25.0)) == ()
    assert air.see(airborne(300.0, 200.0, 24.0))[0].height_mm == 24.0


def test_at_a_height_of_0_there_are_none() -> None:
    assert Air(TrackingSettings(hover_mm=0.0)).see(airborne(300.0, 200.0, 0.0)) == ()


def test_beside_the_area_there_are_none() -> None:
    assert Air().see(airborne(-1.0, 200.0), airborne(300.0, 401.0)) == ()


def test_the_fingertip_of_a_live_touch_does_not_hover() -> None:
    air = Air()
    assert air.see(airborne(300.0, 200.0, 9.0), touches_mm=((305.0, 200.0),)) == ()
    assert air.see(airborne(340.0, 200.0, 9.0), touches_mm=((305.0, 200.0),))[0].hover_id == 1


def test_after_all_ended_there_are_new_ids_under_other_settings() -> None:
    air = Air()
    air.see(airborne(300.0, 200.0))
    air.tracker.end_all()
    assert air.see(airborne(300.0, 200.0))[0].hover_id == 2
    air.tracker.adopt(replace(TrackingSettings(), hover_mm=10.0), AREA_MM)
    assert air.see(airborne(300.0, 200.0)) == ()
