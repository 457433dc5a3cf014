"""The parts of the fingertip method: templates, places along outlines, neighbours, and the decision."""

import numpy as np
import pytest
from touchd.contacts.candidates import Outline, Walk, find_ends
from touchd.contacts.decide import Fit, verdict
from touchd.contacts.neighbours import distinct
from touchd.contacts.patch import UNKNOWNS, finger_height, make_bank, reading
from touchd.geometry import kinect_v1_sensor

WALK = Walk(reaches=(12, 20), inset=5.0, lowest_mm=26.0)
GOOD = Fit(pitch_rad=0.6, clearance_mm=0.0, misfit=0.9, core=1.0, seen=0.9)


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


def test_a_window_over_one_surface_reads_its_height() -> None:
    height = np.array([0.0, 5.0, 12.0], np.float32)
    np.testing.assert_allclose(reading(height, height**2, height**3, 8.0), height, atol=0.01)


def test_a_window_over_two_near_surfaces_reads_between_them_more_like_the_higher() -> None:
    share, height = np.full(1, 0.5, np.float32), np.full(1, 6.0, np.float32)
    read = reading(share * height, share * height**2, share * height**3, 16.0)
    assert 3.0 < float(read[0]) < 6.0


def test_the_bank_s_slopes_predict_its_heights() -> None:
    bank = make_bank(kinect_v1_sensor(), np.array([2.6], np.float32), np.array([6.5], np.float32))
    assert bank.slopes.shape == (len(bank.heights_mm), UNKNOWNS, bank.along_mm.shape[1])
    # The clearances of one radius and pitch lie next to each other: 0 and 4 mm.
    predicted = bank.heights_mm[0] + 4.0 * bank.slopes[0, 4] / bank.weights[0]
    np.testing.assert_allclose(predicted, bank.heights_mm[1], atol=0.1)


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
    points = np.array([[0.0, 0.0], [3.0, 0.0], [20.0, 0.0]], np.float32)
    assert distinct(points, np.array([0.5, 0.9, 0.1], np.float32), apart_px=8.0) == [1, 2]


@pytest.mark.parametrize(("step_mm", "on_mm", "off_mm"), [(1.6, 5.2, 8.9), (6.5, 10.6, 22.6)])
def test_a_touch_begins_lower_than_it_ends(step_mm: float, on_mm: float, off_mm: float) -> None:
    def said(clearance_mm: float) -> tuple[bool, bool, bool]:
        answer = verdict(Fit(0.6, clearance_mm, 0.5, 0.6, 0.9), step_mm)
        return answer.firm, answer.kept, answer.lifted

    assert said(on_mm - 0.3) == (True, True, False)
    assert said(on_mm + 0.3) == (False, True, False)
    assert said(off_mm + 0.5) == (False, False, True)


@pytest.mark.parametrize(
    "doubtful",
    [
        Fit(pitch_rad=0.6, clearance_mm=0.0, misfit=2.5, core=1.0, seen=0.9),
        Fit(pitch_rad=1.3, clearance_mm=4.0, misfit=0.9, core=1.0, seen=0.9),
        Fit(pitch_rad=0.6, clearance_mm=0.0, misfit=0.9, core=4.0, seen=0.9),
        Fit(pitch_rad=0.6, clearance_mm=0.0, misfit=0.9, core=1.0, seen=0.2),
    ],
)
def test_a_poor_fit_neither_begins_nor_ends_a_touch(doubtful: Fit) -> None:
    assert verdict(GOOD, 1.6).firm
    answer = verdict(doubtful, 1.6)
    assert (answer.firm, answer.kept, answer.lifted) == (False, False, False)
