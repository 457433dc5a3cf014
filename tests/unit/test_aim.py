"""People aim where their eye sees: touches are told an offset along the finger away, by the side of the table."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from touchd.contacts.aim import EyeOffsets, aimed, heading
from touchd.contacts.method import Sighting
from touchd.model import AreaCorners, Contact, Cursor
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings
from touchd.surface.settings import CalibrationSettings
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Area, Hand, TableCamera, area_corners_px
from touchd.table.table import Table
from touchd.tracking.settings import TrackingSettings
from touchd.tracking.tracker import Tracker

AREA_MM = (500.0, 350.0)
FRAME_NS = 33_333_333
UP, DOWN, RIGHT, LEFT = (0.0, -1.0), (0.0, 1.0), (1.0, 0.0), (-1.0, 0.0)
SIDES = EyeOffsets(bottom=3.0, top=-2.0, left=5.0, right=1.0)


def seen(towards: tuple[float, float] | None, firm: bool = True) -> Contact:
    return Contact(0.5, 0.4, 250.0, 140.0, 2.0, 100.0, 0.0, firm, towards=towards)


@pytest.mark.parametrize(
    ("towards", "place_mm"),
    [(UP, (250.0, 137.0)), (DOWN, (250.0, 138.0)), (RIGHT, (255.0, 140.0)), (LEFT, (249.0, 140.0))],
)
def test_a_finger_from_each_side_is_told_as_far_ahead_as_people_there_aim(
    towards: tuple[float, float], place_mm: tuple[float, float]
) -> None:
    sighting = aimed(Sighting([seen(towards)], hovers=[seen(towards, firm=False)]), SIDES, AREA_MM)
    for contact in (*sighting.contacts, *sighting.hovers):
        assert (contact.x_mm, contact.y_mm) == place_mm
        assert (contact.x, contact.y) == pytest.approx((place_mm[0] / AREA_MM[0], place_mm[1] / AREA_MM[1]))
        assert contact.aim_mm == (place_mm[0] - 250.0, place_mm[1] - 140.0)


def test_a_contact_of_unknown_direction_stays_where_it_is() -> None:
    sighting = Sighting([seen(None)])
    assert aimed(sighting, SIDES, AREA_MM) == sighting


@given(st.floats(-math.pi, math.pi), st.floats(1e-6, 1e-3))
def test_a_finger_that_turns_makes_no_jump(angle: float, step: float) -> None:
    one, other = (SIDES.along_mm((math.cos(a), math.sin(a))) for a in (angle, angle + step))
    assert abs(one - other) < 20.0 * step


def test_the_eye_s_offset_does_not_move_where_a_touch_is_looked_for_again() -> None:
    tracker = Tracker(TrackingSettings(), AREA_MM)
    (contact,) = aimed(Sighting([seen(UP)]), SIDES, AREA_MM).contacts
    (cursor,) = tracker.step([contact], FRAME_NS)
    assert cursor.y * AREA_MM[1] == pytest.approx(137.0)
    assert tracker.expected_mm(2 * FRAME_NS) == [(250.0, 140.0)]


@given(
    direction=st.floats(-3.1, 3.1),
    pitch_rad=st.floats(0.1, 1.2),
    lean=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)
def test_the_direction_is_that_of_the_finger_also_where_the_camera_sees_it_from_the_side(
    direction: float, pitch_rad: float, lean: tuple[float, float]
) -> None:
    back = np.array([math.cos(direction), math.sin(direction)])
    shown = math.cos(pitch_rad) * back + math.sin(pitch_rad) * np.array(lean)
    assume(math.cos(pitch_rad) > 1.2 * math.sin(pitch_rad) * math.hypot(*lean))  # else a finger hides its own end
    found = heading(math.atan2(shown[1], shown[0]), pitch_rad, lean)
    assert math.cos(found - direction) == pytest.approx(1.0, abs=1e-6)


def test_what_no_finger_can_look_like_still_has_a_direction() -> None:
    assert math.isfinite(heading(0.0, 1.5, (-0.9, 0.9)))


CAMERA = TableCamera(height_mm=750.0, tilt_deg=6.0)
AREA = Area(centre_mm=(0.0, 0.0), size_mm=AREA_MM)
EMPTY_FRAMES = 12


def touches(heading_deg: float, eye: EyeOffsets | None) -> Cursor:
    """Return the touch of a rendered finger with that heading: 0 points up the picture, 90 to the right."""
    table = Table(CAMERA, seed=5)
    a, b, c, d = ((float(u), float(v)) for u, v in area_corners_px(CAMERA, AREA))
    settings = PipelineSettings(
        calibration=CalibrationSettings(frames=EMPTY_FRAMES), area=AreaCorners((a, b, c, d), AREA_MM), eye=eye
    )
    pipeline = Pipeline(table.sensor, settings, "a test")
    pipeline.calibrate()
    hand = pointing_hand(HandPose(AREA.at(0.9, 0.2), heading_deg=heading_deg))
    scenes: list[list[Hand]] = [[]] * EMPTY_FRAMES + [[hand]] * 4
    told = [pipeline.step(table.render(scene, i * FRAME_NS, i)) for i, scene in enumerate(scenes)][-1]
    (cursor,) = told.cursors
    return cursor


@pytest.mark.parametrize("heading_deg", [0.0, 70.0, 180.0, -100.0])
def test_a_rendered_finger_s_direction_is_known_and_its_touch_is_told_ahead(heading_deg: float) -> None:
    plain, told = touches(heading_deg, None), touches(heading_deg, EyeOffsets(4.0, 4.0, 4.0, 4.0))
    turned = math.radians(heading_deg)
    ahead = math.sin(turned), -math.cos(turned)
    assert plain.towards is not None
    assert plain.towards == pytest.approx(ahead, abs=0.15)
    moved_mm = (told.x - plain.x) * AREA_MM[0], (told.y - plain.y) * AREA_MM[1]
    assert moved_mm == pytest.approx((4.0 * ahead[0], 4.0 * ahead[1]), abs=0.7)
