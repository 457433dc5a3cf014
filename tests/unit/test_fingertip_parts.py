"""The parts of the fingertip method: templates, places along outlines, and neighbours."""

import numpy as np
import pytest
from touchd.contacts.candidates import Outline, Walk, find_ends
from touchd.contacts.fit import Fitted, best_steps
from touchd.contacts.heights import HIGHEST_MM, Lay
from touchd.contacts.memory import Memory
from touchd.contacts.neighbours import close, distinct, owned_samples
from touchd.contacts.patch import UNKNOWNS, finger_height, make_bank, reading, seen_height
from touchd.contacts.tips import Guess
from touchd.geometry import kinect_v1_sensor

WALK = Walk(reaches=(12, 20), inset=5.0, lowest_mm=26.0)


def finger_outline() -> Outline:
    """A finger that points up in the picture, 15 px thick, its tip at (100, 40)."""
    left = [(93, v) for v in range(47, 150)]
    right = [(107, v) for v in range(149, 46, -1)]
    cap = [(round(100 + 7.5 * np.cos(a)), round(47.5 - 7.5 * np.sin(a))) for a in np.linspace(0.1, np.pi - 0.1, 25)]
    bottom = [(u, 150) for u in range(93, 108)]
    # As OpenCV walks around outer outlines in a picture.
    return Outline(np.array([*left, *bottom, *right, *cap], np.int32)[:, None], 0)


def test_a_finger_is_as_high_as_its_ball_over_the_tip_and_nothing_beside_it() -> None:
    along, across = np.array([0.0, 0.0, -7.0]), np.array([0.0, 7.0, 0.0])
    assert finger_height(along, across, radius_mm=6.0, pitch_rad=0.0).tolist() == [12.0, 0.0, 0.0]


def test_a_steeper_finger_rises_faster() -> None:
    behind = np.array([15.0])
    heights = [float(finger_height(behind, np.array([0.0]), 6.0, pitch)[0]) for pitch in (0.2, 0.6, 1.0)]
    assert heights == sorted(heights)


@pytest.mark.parametrize("lean", [-0.5, 0.0, 0.4])
def test_what_is_seen_at_an_angle_lies_on_the_finger_where_the_rays_meet_it(lean: float) -> None:
    radius, pitch = 6.5, 0.7
    along, across = (grid.ravel() for grid in np.meshgrid(np.linspace(-9.0, 20.0, 30), np.linspace(-8.0, 8.0, 9)))
    height = seen_height(along, across, radius, pitch, lean)
    seen = (height > 0.5) & (height < HIGHEST_MM)
    assert seen.sum() > 60
    above = height[seen] - radius  # the ball's centre, where the finger begins
    points = np.stack([along[seen] - lean * above, across[seen], above])
    way = np.maximum(points[0] * np.cos(pitch) + points[2] * np.sin(pitch), 0.0)
    off = points - np.stack([way * np.cos(pitch), np.zeros_like(way), way * np.sin(pitch)])
    # It grows thicker on the way back.
    assert np.linalg.norm(off, axis=0) == pytest.approx(radius + 0.03 * way, rel=0.03, abs=0.3)


def test_the_bank_holds_as_many_ways_of_looking_as_the_surface_needs() -> None:
    pixel, step = np.array([1.3], np.float32), np.array([1.6], np.float32)
    assert make_bank(kinect_v1_sensor(), pixel, step, 0.1).leans == (0.0,)
    assert make_bank(kinect_v1_sensor(), pixel, step, 0.3).leans == (-0.25, 0.0, 0.25)
    assert make_bank(kinect_v1_sensor(), pixel, step, 9.0).leans == (-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75)


def test_a_window_over_one_surface_reads_its_height() -> None:
    height = np.array([0.0, 5.0, 12.0], np.float32)
    np.testing.assert_allclose(reading(height, height**2, height**3, 8.0), height, atol=0.01)


def test_a_window_over_two_near_surfaces_reads_between_them_more_like_the_higher() -> None:
    share, height = np.full(1, 0.5, np.float32), np.full(1, 6.0, np.float32)
    read = reading(share * height, share * height**2, share * height**3, 16.0)
    assert 3.0 < float(read[0]) < 6.0


def test_the_bank_s_slopes_predict_its_heights() -> None:
    bank = make_bank(kinect_v1_sensor(), np.array([2.6], np.float32), np.array([6.5], np.float32), 0.3)
    assert bank.templates.shape == (len(bank.middles), 2 + UNKNOWNS, bank.places_mm.shape[2])
    # The clearances of one radius and pitch lie next to each other: 0 and 4 mm.
    assert bank.middles[:2, 1].tolist() == [0.0, 4.0]
    templates = bank.templates[:2] * bank.units
    low, high = (rows[0] / rows[1] for rows in templates)
    predicted = low + 4.0 * templates[0, 2 + 4] / templates[0, 1]
    np.testing.assert_allclose(predicted, high, atol=0.1)


def test_a_finger_s_outline_has_one_end_whose_back_leads_into_it() -> None:
    ends = find_ends([finger_outline()], np.full((200, 200), 40.0, np.float32), WALK)
    at_tip = np.hypot(ends.points[:, 0] - 100.0, ends.points[:, 1] - 40.0) < 6.0
    assert at_tip.any()
    np.testing.assert_allclose(ends.back[at_tip], [[0.0, 1.0]] * int(at_tip.sum()), atol=0.2)


def test_a_low_place_beside_higher_ones_is_a_candidate_without_being_an_end() -> None:
    heights = np.full((200, 200), 40.0, np.float32)
    heights[85:110, 85:101] = 13.0
    ends = find_ends([finger_outline()], heights, WALK)
    dips = ends.points[ends.rank < 0.0]
    assert np.any(np.hypot(dips[:, 0] - 93.0, dips[:, 1] - 97.0) < 12.0)


def test_dips_are_found_along_the_lowest_outlines_only_in_whatever_order_outlines_come() -> None:
    heights = np.full((200, 200), 40.0, np.float32)
    heights[85:110, 85:101] = 13.0
    low, high = finger_outline(), Outline(finger_outline().points + np.int32(1), 1)
    either, other = find_ends([low, high], heights, WALK), find_ends([high, low], heights, WALK)
    np.testing.assert_array_equal(either.points[either.rank < 0.0], other.points[other.rank < 0.0])
    dips = other.rank == -1.0
    assert dips.any()
    assert (other.level[dips] == 0).all()


def test_heights_in_whole_numbers_show_the_same_dips() -> None:
    heights = np.full((200, 200), 40, np.uint16)
    heights[85:110, 85:101] = 13
    whole = find_ends([finger_outline()], heights, WALK)
    exact = find_ends([finger_outline()], heights.astype(np.float32), WALK)
    dips = whole.points[whole.rank == -1.0]
    assert len(dips)
    assert all(np.hypot(*(exact.points[exact.rank == -1.0] - dip).T).min() < 12.0 for dip in dips)


def test_an_outline_too_short_to_be_walked_along_has_no_ends() -> None:
    speck = Outline(finger_outline().points[: 2 * min(WALK.reaches)], 0)
    ends = find_ends([speck], np.full((200, 200), 40.0, np.float32), WALK)
    assert (ends.points.shape, ends.back.shape, len(ends.rank), len(ends.level)) == ((0, 2), (0, 2), 0, 0)


def test_an_outline_shorter_than_its_repetition_is_walked_around_more_than_once() -> None:
    angles = np.linspace(0.0, 2 * np.pi, 26, endpoint=False)
    ring = np.stack([100 + 4.0 * np.cos(-angles), 100 + 4.0 * np.sin(-angles)], 1).round().astype(np.int32)[:, None]
    ends = find_ends([Outline(ring, 0)], np.full((200, 200), 13.0, np.float32), WALK)
    inwards = 100.0 - ends.points
    assert len(ends.rank)
    assert (np.sum(inwards * ends.back, axis=1) > 0.0).all()


def test_of_points_too_close_together_the_best_is_kept() -> None:
    points = [(0.0, 0.0), (3.0, 0.0), (20.0, 0.0)]
    assert close(points, 8.0)
    assert distinct(points, [0.5, 0.9, 0.1], 8.0) == [1, 2]
    assert not close([points[1], points[2]], 8.0)


LAY = Lay(0.77, 0.01, -0.02, 0.76, 0.05, -0.04, 0.066, -0.051, 1.3, 1.6)


def test_a_direction_on_the_surface_leads_to_the_picture_and_back() -> None:
    for angle in (-3.0, -1.2, 0.0, 0.4, 2.5):
        assert LAY.angle_of(*LAY.along(angle)) == pytest.approx(angle)


def a_guess(u: float, v: float, clearance_mm: float = 0.0) -> Guess:
    return Guess(u, v, 0.5, clearance_mm, shown=True, lay=LAY)


def test_a_fit_begins_where_that_of_the_same_finger_would_have_ended() -> None:
    memory = Memory()
    tip = memory.begin(a_guess(100.0, 80.0, 6.0))
    assert (tip.u, tip.v, tip.angle, tip.clearance_mm) == (100.0, 80.0, 0.5, 6.0)
    tip.u, tip.angle, tip.clearance_mm, tip.pitch_rad, tip.radius_mm = 102.0, 0.7, 1.0, 0.9, 8.0
    memory.keep([tip])
    again = memory.begin(a_guess(110.0, 81.0, 6.5))
    assert (again.u, again.v) == (112.0, 81.0)
    assert [again.angle, again.clearance_mm] == pytest.approx([0.7, 1.5])
    assert 0.85 < again.pitch_rad < 0.9
    assert 6.6 < again.radius_mm < 8.0
    assert again.pitch_trust > tip.pitch_trust
    assert memory.begin(a_guess(200.0, 80.0)).u == 200.0


def test_a_fit_that_could_not_be_solved_rests_where_it_is() -> None:
    tip = Memory().begin(a_guess(100.0, 80.0, 6.0))
    samples = np.ones((1, 3), np.float32)
    axes = [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
    fitted = Fitted(samples, samples, samples > 0.0, axes, steps=[[[0.0, 0.0]] * UNKNOWNS])
    assert fitted.at_rest([tip]) == [tip]


def test_equations_that_cannot_be_solved_lead_nowhere() -> None:
    side = UNKNOWNS + 1
    nothing, untrusted = np.zeros((1, side, side), np.float32), ((0.0,) * UNKNOWNS, (0.0,) * UNKNOWNS)
    assert best_steps(nothing, [untrusted]) == [[[0.0, 0.0]] * UNKNOWNS]


def test_of_two_fingers_side_by_side_each_owns_what_is_nearer_to_it() -> None:
    memory = Memory()
    one, other = memory.begin(a_guess(100.0, 100.0)), memory.begin(a_guess(100.0, 110.0))
    one.angle = other.angle = 0.0
    flat = np.array([[0.0, 0.0, 0.0], [-3.0, 6.0, 9.0], [1.0, 1.0, 1.0]], np.float32)  # 13 mm lie between the two
    assert owned_samples([one, other], np.stack([flat, flat])).tolist() == [[1.0, 1.0, 0.0], [1.0, 1.0, 1.0]]
    far = memory.begin(a_guess(300.0, 100.0))
    assert owned_samples([one, far], np.stack([flat, flat])).min() == 1.0


def test_one_finger_that_was_begun_twice_is_fitted_with_all_of_its_samples() -> None:
    memory = Memory()
    tip, behind = memory.begin(a_guess(100.0, 100.0)), memory.begin(a_guess(110.0, 101.0))
    tip.angle, behind.angle = 0.0, 0.1
    flat = np.array([[-5.0, 4.0, 12.0], [0.0, 2.0, -2.0], [1.0, 1.0, 1.0]], np.float32)
    assert owned_samples([tip, behind], np.stack([flat, flat])).min() == 1.0
