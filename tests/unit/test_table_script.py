import numpy as np
import pytest
from touchd.table.actors import Actor, Drag, Gesture, Hover, Touch
from touchd.table.hands import HandPose, open_hand
from touchd.table.improvise import improvised
from touchd.table.scene import Area, Place, TableCamera
from touchd.table.script import Moment, Script

CAMERA = TableCamera(900.0, 10.0)
AREA = Area((0.0, 0.0), (500.0, 350.0))
GRIP = HandPose((0.0, 0.0), heading_deg=20.0, pitch_deg=35.0)
MS = 1_000_000


def script(*gestures: Gesture, start_ms: float = 0.0) -> Script:
    return Script(CAMERA, AREA, [Actor(GRIP, gestures, start_ms)])


def played(part: Script, step_ms: int = 5) -> list[Moment]:
    return [part.at(t_ns) for t_ns in range(0, part.end_ns, step_ms * MS)]


def test_a_tap_touches_at_its_place_for_as_long_as_it_says() -> None:
    place: Place = (60.0, -40.0)
    touching = [m.truth[0] for m in played(script(Touch(place, 80.0)), 1) if m.truth and m.truth[0].touching]
    assert len(touching) == pytest.approx(80, abs=2)
    assert {(entry.tip, entry.x, entry.y) for entry in touching} == {(1, 60 / 500 + 0.5, -40 / 350 + 0.5)}


def test_a_tip_has_its_number_on_the_way_down_and_up_and_none_while_it_travels() -> None:
    truth = [m.truth[0] for m in played(script(Touch((0.0, 0.0), 60.0), Touch((50.0, 0.0), 60.0))) if m.truth]
    order = [entry.tip for entry in truth]
    assert [tip for i, tip in enumerate(order) if i == 0 or tip != order[i - 1]] == [-1, 1, -1, 2, -1]
    assert any(entry.tip == 1 and not entry.touching for entry in truth)


def test_a_drag_goes_smoothly_from_its_first_place_to_its_last() -> None:
    moments = played(script(Drag((-100.0, 50.0), (100.0, -50.0), 1000.0)), 10)
    path = np.array([(t.x, t.y) for m in moments for t in m.truth if t.touching])
    assert path[0] == pytest.approx((-0.2 + 0.5, 50 / 350 + 0.5), abs=0.01)
    assert path[-1] == pytest.approx((0.2 + 0.5, -50 / 350 + 0.5), abs=0.01)
    speed = np.hypot(*np.diff(path, axis=0).T)
    assert speed[0] < 0.1 * speed.max()
    assert np.argmax(speed) == pytest.approx(len(speed) / 2, abs=2)


def test_a_hover_stays_at_its_clearance_and_never_touches() -> None:
    truth = [t for m in played(script(Hover((0.0, 0.0), 15.0, 400.0))) for t in m.truth]
    assert not any(entry.touching for entry in truth)
    assert {entry.tip for entry in truth} == {-1}
    assert sum(entry.clearance_mm == 15.0 for entry in truth) * 5 == pytest.approx(400.0, abs=10.0)


def test_a_hand_comes_in_from_outside_the_picture_and_leaves_again() -> None:
    moments = played(script(Touch((0.0, 0.0), 60.0), start_ms=50.0))
    assert not moments[0].hands
    assert moments[11].hands
    assert not moments[11].truth
    assert not moments[-1].truth


def test_nothing_is_left_when_a_script_has_ended() -> None:
    part = script(Touch((0.0, 0.0), 60.0))
    assert part.at(part.end_ns) == Moment((), ())
    assert Script(CAMERA, AREA, []).end_ns == 0


def test_each_finger_of_an_open_hand_gets_a_number_of_its_own() -> None:
    five = Actor(GRIP, (Touch((0.0, 0.0), 200.0),), shape=open_hand)
    later = Actor(GRIP, (Touch((120.0, 0.0), 60.0),), start_ms=2000.0)
    tips = {t.tip for m in played(Script(CAMERA, AREA, [later, five])) for t in m.truth if t.touching}
    assert tips == {1, 2, 3, 4, 5, 6}


def test_improvised_hands_do_everything_within_their_half_of_the_area() -> None:
    actors = improvised(CAMERA, AREA, 30_000.0, np.random.default_rng(4))
    gestures = [gesture for actor in actors for gesture in actor.gestures]
    assert {type(gesture) for gesture in gestures} == {Touch, Drag, Hover}
    for actor in actors:
        sides = {t.x > 0.5 for m in played(Script(CAMERA, AREA, [actor]), 33) for t in m.truth if t.touching}
        assert len(sides) <= 1


def test_improvised_hands_never_jump() -> None:
    part = Script(CAMERA, AREA, improvised(CAMERA, AREA, 6_000.0, np.random.default_rng(5)))
    for actor_truth in zip(played(part, 4)[:-1], played(part, 4)[1:], strict=True):
        before, after = (
            {round(tip.at_mm[0] > 0): tip.at_mm for hand in moment.hands for tip in hand.fingertips}
            for moment in actor_truth
        )
        for half in before.keys() & after.keys():
            assert np.hypot(*np.subtract(before[half], after[half])) < 12.0


def test_the_same_seed_improvises_the_same_hands_and_another_seed_others() -> None:
    first, second, other = (improvised(CAMERA, AREA, 5_000.0, np.random.default_rng(seed)) for seed in (9, 9, 10))
    assert first == second
    assert first != other
