"""Things that are put down on the table: no touches, but objects, for as long as they lie there."""

from collections.abc import Callable
from math import dist

import numpy as np
import pytest
from touchd.hands.stage import HandStage
from touchd.model import Contact, Frame, Mask, Slide, TableObject
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Block, Capsule, Hand, Place

from tabletop import FRAME_NS, Watch, booklet, cup, in_dark_sleeve, phone, tabletop

HEIGHTS = (750.0, 1500.0)
THINGS = {"phone": (phone, 8.5), "booklet": (booklet, 15.0), "cup": (cup, 93.0)}
Thing = Callable[..., Hand]


def pointing(at_mm: Place, lift_mm: float) -> Hand:
    return pointing_hand(HandPose(at_mm, clearance_mm=lift_mm))


def put_down(
    watch: Watch, thing: Thing, high_mm: float, dress: Callable[[Hand], Hand] = lambda hand: hand
) -> HandStage:
    """Carry a thing in, leave it where it is, and go."""
    for lift in (60.0, 40.0, 20.0, 0.0, 0.0):
        watch.see(dress(pointing((0.0, 30.0), lift + high_mm)), thing((0.0, 0.0), lift))
    for away in (60.0, 120.0, 180.0, 240.0, 300.0, 400.0, 500.0):
        watch.see(dress(pointing((0.0, 30.0 + away), 50.0 + high_mm)), thing((0.0, 0.0)))
    for _ in range(15):
        stage = watch.see(thing((0.0, 0.0)))
    return stage


def middle_mm(found: TableObject, at: Callable[[Place], Place]) -> Place:
    corners = [at(corner) for corner in found.outline]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    x_mm, y_mm = (0.5 * (low + high)).tolist()
    return x_mm, y_mm


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", THINGS)
def test_what_is_put_down_is_an_object_once_the_hand_has_left(height_mm: float, name: str) -> None:
    thing, high_mm = THINGS[name]
    top = tabletop(height_mm)
    (found,) = put_down(Watch(top), thing, high_mm).objects
    assert found.object_id == 1
    assert abs(found.height_mm - high_mm) < 0.1 * high_mm + 3.0
    assert dist(middle_mm(found, top.mm_of), (0.0, 0.0)) < 15.0
    assert 3 <= len(found.outline) <= 16


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", THINGS)
def test_what_a_hand_in_a_dark_sleeve_puts_down_is_an_object_and_its_hand_is_none(height_mm: float, name: str) -> None:
    thing, high_mm = THINGS[name]
    assert [o.object_id for o in put_down(Watch(tabletop(height_mm)), thing, high_mm, in_dark_sleeve).objects] == [1]


def bottle(at_mm: Place, lift_mm: float = 0.0) -> Hand:
    x_mm, y_mm = at_mm
    return Hand((Capsule((x_mm, y_mm, lift_mm + 35.0), (x_mm, y_mm, lift_mm + 215.0), 35.0, 25.0),), ())


def long_box(at_mm: Place, lift_mm: float = 0.0) -> Hand:
    return Hand((Block((*at_mm, lift_mm), (280.0, 60.0, 75.0), 20.0),), ())


def open_laptop(at_mm: Place, lift_mm: float = 0.0) -> Hand:
    x_mm, y_mm = at_mm
    screen = Block((x_mm, y_mm + 95.0, lift_mm), (300.0, 8.0, 190.0), lean_deg=20.0)
    return Hand((Block((*at_mm, lift_mm), (300.0, 200.0, 16.0)), screen), ())


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("thing", [bottle, long_box, open_laptop])
@pytest.mark.parametrize("at_mm", [(0.0, 0.0), (-80.0, -30.0)])
def test_what_is_long_or_tall_is_an_object_and_no_arm(height_mm: float, thing: Thing, at_mm: Place) -> None:
    watch = Watch(tabletop(height_mm))

    def there(at: Place, lift_mm: float = 0.0) -> Hand:
        return thing((at[0] + at_mm[0], at[1] + at_mm[1]), lift_mm)

    put_down(watch, there, 220.0)
    for _ in range(20):
        stage = watch.see(there((0.0, 0.0)))
    assert [found.object_id for found in stage.objects] == [1]
    assert stage.hands == ()


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", THINGS)
def test_no_touch_is_on_a_thing_but_fingers_beside_it_touch(height_mm: float, name: str) -> None:
    thing, _ = THINGS[name]
    pipeline, top = tabletop(height_mm).pipeline(), tabletop(height_mm)
    touches = []
    for index in range(30, 72):
        hands = [thing((0.0, 0.0))]
        if index >= 50:
            hands.append(pointing((130.0, 40.0), max(0.0, 100.0 - 12.0 * (index - 50))))
        frame = pipeline.step(Frame(index, index * FRAME_NS, top.picture(hands, index)))
        touches.append([top.mm_of((cursor.x, cursor.y)) for cursor in frame.cursors])
    assert touches[:25] == [[]] * 25
    (touch,) = touches[-1]
    assert dist(touch, (130.0, 40.0)) < 13.0 * top.scale
    assert [(cursor.hand, hand.hand_id) for cursor in frame.cursors for hand in frame.hands] == [(1, 1)]


@pytest.mark.parametrize("height_mm", HEIGHTS)
def test_what_is_taken_away_is_gone_within_a_second(height_mm: float) -> None:
    watch = Watch(tabletop(height_mm))
    put_down(watch, booklet, 15.0)
    for away in (0.0, 0.0, 100.0, 200.0, 300.0, 400.0, 600.0):
        watch.see(pointing((0.0, 30.0 + away), 15.0 + 0.3 * away), booklet((0.0, away), 0.3 * away))
    for _ in range(20):
        stage = watch.see()
    assert stage.objects == ()


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", THINGS)
def test_a_thing_that_is_pushed_keeps_its_id_and_is_where_it_is(height_mm: float, name: str) -> None:
    thing, high_mm = THINGS[name]
    top = tabletop(height_mm)
    watch = Watch(top)
    put_down(watch, thing, high_mm)
    reach = {"phone": 84.0, "booklet": 72.0, "cup": 46.0}[name]
    for step in range(16):
        pushed = -5.0 * max(0, step - 3)
        stage = watch.see(pointing((0.0, reach + pushed), 0.0), thing((0.0, pushed)))
        assert [o.object_id for o in stage.objects] == [1]
    for _ in range(6):
        stage = watch.see(thing((0.0, -60.0)))
    (found,) = stage.objects
    assert found.object_id == 1
    assert dist(middle_mm(found, top.mm_of), (0.0, -60.0)) < 20.0


def test_a_large_thing_is_followed_as_closely_as_it_is_seen() -> None:
    top = tabletop(750.0)
    watch = Watch(top)

    def tray(at_mm: Place, lift_mm: float = 0.0) -> Hand:
        return Hand((Block((*at_mm, lift_mm), (230.0, 170.0, 20.0)),), ())

    put_down(watch, tray, 20.0)
    for step in range(1, 11):
        stage = watch.see(tray((0.0, -6.0 * step)), pointing((0.0, 93.0 - 6.0 * step), 0.0))
        (found,) = stage.objects
        assert abs(middle_mm(found, top.mm_of)[1] + 6.0 * step) < 9.0


def test_a_thing_is_offered_to_the_surface_after_its_time_and_not_under_a_hand() -> None:
    watch = Watch(tabletop(750.0), join_after_s=1.0)
    stage = put_down(watch, booklet, 15.0)
    assert stage.due(watch.t_ns) is None
    for _ in range(45):
        watch.see(booklet((0.0, 0.0)), pointing((0.0, -30.0), 20.0))
        assert stage.due(watch.t_ns) is None
    offered = [mask for _ in range(45) if (mask := _due_after(watch, booklet((0.0, 0.0)))) is not None]
    assert len(offered) == 1
    assert offered[0].shape == (480, 640)
    assert 0.01 < offered[0].mean() < 0.15


def test_work_beside_a_thing_does_not_keep_the_surface_from_taking_it_in() -> None:
    watch = Watch(tabletop(750.0), join_after_s=1.0)
    put_down(watch, booklet, 15.0)
    offered = [
        mask
        for _ in range(45)
        if (mask := watch.see(booklet((0.0, 0.0)), pointing((140.0, 40.0), 0.0)).due(watch.t_ns)) is not None
    ]
    assert len(offered) == 1


def _due_after(watch: Watch, thing: Hand) -> Mask | None:
    return watch.see(thing).due(watch.t_ns)


def test_what_the_surface_took_in_stays_an_object_until_the_surface_lets_it_go() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.3)
    put_down(watch, booklet, 15.0)
    mask = None
    while mask is None:
        mask = _due_after(watch, booklet((0.0, 0.0)))
    for _ in range(3):
        stage = watch.see(joined=mask)
        assert [o.object_id for o in stage.objects] == [1]
    assert stage.admitted([contact_in_the_middle()]) == [contact_in_the_middle()]
    watch.see(joined=np.zeros_like(mask))
    assert watch.see(joined=np.zeros_like(mask)).objects == ()


@pytest.mark.parametrize("height_mm", HEIGHTS)
@pytest.mark.parametrize("name", THINGS)
def test_what_was_pushed_until_the_surface_let_it_go_is_the_same_thing_where_it_is_now(
    height_mm: float, name: str
) -> None:
    thing, high_mm = THINGS[name]
    top = tabletop(height_mm)
    watch = Watch(top, join_after_s=0.3)
    put_down(watch, thing, high_mm)
    mask = None
    while mask is None:
        mask = _due_after(watch, thing((0.0, 0.0)))
    for _ in range(3):
        watch.see(joined=mask)
    for _ in range(8):
        stage = watch.see(thing((0.0, -60.0)), joined=np.zeros_like(mask))
    (found,) = stage.objects
    assert found.object_id == 1
    assert dist(middle_mm(found, top.mm_of), (0.0, -60.0)) < 20.0


def test_what_the_surface_let_go_under_a_hand_is_the_same_thing() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.5)
    mask = taken_in(watch)
    for _ in range(4):
        stage = watch.see(booklet((0.0, 0.0)), pointing((0.0, 62.0), 0.0), joined=np.zeros_like(mask))
    assert [o.object_id for o in stage.objects] == [1]


def test_the_part_of_a_thing_that_is_pushed_off_its_place_is_no_thing_while_a_finger_pushes() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.5)
    joined = taken_in(watch)
    part = Hand((Block((0.0, -60.0, 0.0), (120.0, 26.0, 15.0)),), ())
    for _ in range(15):
        stage = watch.see(part, pointing((0.0, 72.0), 0.0), joined=joined)
        assert [o.object_id for o in stage.objects] == [1]
    for _ in range(15):
        stage = watch.see(part, joined=joined)
    assert [o.object_id for o in stage.objects] == [1, 2]


def taken_in(watch: Watch) -> Mask:
    """Put a booklet down and wait until it is offered to the surface; return where."""
    put_down(watch, booklet, 15.0)
    mask = None
    while mask is None:
        mask = _due_after(watch, booklet((0.0, 0.0)))
    for _ in range(3):
        watch.see(joined=mask)
    return mask


def slid(watch: Watch, mask: Mask, px: int) -> Mask:
    """Tell that what the surface took in was pushed by so many px to the right; return where it is."""
    now = np.roll(mask, px, axis=1)
    watch.see(joined=now, slides=[Slide(mask, now)])
    return now


def test_what_the_surface_took_in_goes_with_it_where_it_is_pushed_and_is_still_the_same() -> None:
    top = tabletop(750.0)
    watch = Watch(top, join_after_s=0.5)
    mask = taken_in(watch)
    (before,) = watch.see(joined=mask).objects
    for _ in range(20):
        mask = slid(watch, mask, 3)
    (found,) = watch.see(joined=mask).objects
    assert found.object_id == 1
    assert found.height_mm == pytest.approx(before.height_mm, abs=1.0)
    (x_mm, y_mm), (was_x_mm, was_y_mm) = (middle_mm(each, top.mm_of) for each in (found, before))
    px_mm = 750.0 / top.surface.sensor.intrinsics.fx
    assert (x_mm - was_x_mm, y_mm - was_y_mm) == pytest.approx((60.0 * px_mm, 0.0), abs=6.0)


def test_what_was_pushed_is_offered_again_once_it_lies_still_and_no_hand_is_over_it_or_beside_it() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.5)
    mask = slid(watch, taken_in(watch), 8)
    offered = []
    for hand in [[pointing((0.0, 30.0), 40.0)]] * 30 + [[pointing((0.0, 66.0), 0.0)]] * 10 + [[]] * 30:
        stage = watch.see(*hand, joined=mask)
        offered.append(stage.due(watch.t_ns) is not None)
    assert (sum(offered[:40]), sum(offered)) == (0, 1)


def test_no_touch_is_on_a_thing_that_was_pushed_but_a_hand_s_until_the_surface_has_looked_at_it_anew() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.5)
    mask = slid(watch, taken_in(watch), 1)
    stage = watch.see(joined=mask)
    assert stage.admitted([contact_in_the_middle()]) == []
    stage = watch.see(pointing((0.0, 0.0), 0.0), joined=mask)
    assert stage.admitted([contact_in_the_middle()]) == [contact_in_the_middle()]
    while stage.due(watch.t_ns) is None:
        stage = watch.see(joined=mask)
    assert watch.see(joined=mask).admitted([contact_in_the_middle()]) == [contact_in_the_middle()]


def test_a_side_that_is_seen_of_a_thing_once_it_was_pushed_is_no_thing() -> None:
    watch = Watch(tabletop(750.0), join_after_s=2.0)
    mask = slid(watch, taken_in(watch), 8)
    side = Hand((Block((95.0, 0.0, 0.0), (25.0, 70.0, 12.0)),), ())
    for _ in range(20):
        stage = watch.see(side, joined=mask)
    assert [o.object_id for o in stage.objects] == [1]


def test_what_is_put_on_a_thing_that_the_surface_took_in_is_offered_to_it_in_its_turn() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.5)
    joined = taken_in(watch)
    offered = []
    for _ in range(30):
        stage = watch.see(phone((0.0, 0.0)), joined=joined)
        offered.append(stage.due(watch.t_ns) is not None)
    assert sum(offered) == 1
    assert [o.object_id for o in stage.objects] == [1, 2]
    assert stage.admitted([contact_in_the_middle()]) == []
    watch.see(joined=joined)
    assert stage.admitted([contact_in_the_middle()]) == [contact_in_the_middle()]


def test_the_edge_of_a_thing_that_the_surface_took_in_is_no_object_of_its_own_and_is_offered_to_it() -> None:
    watch = Watch(tabletop(750.0), join_after_s=0.5)
    joined = taken_in(watch)
    edge = Hand((Block((80.0, 0.0, 0.0), (12.0, 90.0, 9.0), 10.0),), ())
    offered = []
    for _ in range(30):
        stage = watch.see(edge, joined=joined)
        offered.append(stage.due(watch.t_ns) is not None)
        assert [o.object_id for o in stage.objects] == [1]
    assert sum(offered) == 1


def test_contacts_on_a_thing_are_dropped_and_those_on_what_may_be_one_begin_no_touch() -> None:
    watch = Watch(tabletop(750.0))
    stage = watch.see(cup((0.0, 0.0)))
    assert [contact.firm for contact in stage.admitted([contact_in_the_middle()])] == [False]
    for _ in range(6):
        stage = watch.see(cup((0.0, 0.0)))
    assert stage.admitted([contact_in_the_middle()]) == []


def test_a_thing_put_down_again_a_moment_later_is_the_same() -> None:
    watch = Watch(tabletop(750.0))
    put_down(watch, phone, 8.5)
    for _ in range(10):
        watch.see()
    for _ in range(6):
        stage = watch.see(phone((60.0, -40.0)))
    assert [o.object_id for o in stage.objects] == [1]


def test_things_are_cleared_from_the_picture_but_a_hand_over_them_is_not() -> None:
    top = tabletop(750.0)
    watch = Watch(top)
    stage = put_down(watch, booklet, 15.0)
    raw = top.picture([booklet((0.0, 0.0))], 90)
    nearer = np.count_nonzero(top.surface.reference - raw > 3.0)
    cleared = stage.cleared(raw, top.surface.reference)
    assert np.count_nonzero(top.surface.reference - cleared > 3.0) < 0.02 * nearer
    over = top.picture([booklet((0.0, 0.0)), pointing((0.0, 0.0), 40.0)], 91)
    alone = top.picture([pointing((0.0, 0.0), 40.0)], 91)
    hand = np.count_nonzero(top.surface.reference - alone > 8.0)
    kept = np.count_nonzero(top.surface.reference - stage.cleared(over, top.surface.reference) > 8.0)
    assert 0.95 * hand < kept < 1.05 * hand


def contact_in_the_middle() -> Contact:
    return Contact(0.5, 0.5, 300.0, 206.0, 0.0, 130.0, 0.0, firm=True)
