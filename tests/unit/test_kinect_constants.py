import struct
from math import nan

import pytest
from touchd.geometry import ZeroPlane, kinect_v1_sensor
from touchd.sources.kinect.constants import device_constants

SHIFT = struct.pack("<HH", 0, 200)
REMEDY = "the usual ones are used, so check a known distance and set area.size_mm if it is off"


def fixed(emitter: float = 7.5, reference: float = 120.0, pixel_size: float = 0.1042, size: int = 322) -> bytes:
    reply = bytearray(size)
    struct.pack_into("<ffff", reply, 94, emitter, 2.3, reference, pixel_size)
    return bytes(reply)


@pytest.mark.parametrize("size", [322, 334])
def test_the_camera_s_own_constants_are_taken_from_its_replies(size: int) -> None:
    constants = device_constants(fixed(7.4, 119.0, 0.105, size), struct.pack("<HH", 0xFFFF, 201))
    plane = constants.zero_plane
    assert (plane.emitter_distance_cm, plane.reference_distance_cm) == pytest.approx((7.4, 119.0))
    assert plane.reference_pixel_size_mm == pytest.approx(0.105)
    assert plane.const_shift == 201.0
    assert constants.doubts == ()


def test_usual_constants_give_the_usual_depth() -> None:
    sensor = kinect_v1_sensor(device_constants(fixed(), SHIFT).zero_plane)
    assert float(sensor.to_mm[700]) == pytest.approx(345489 / (1089.41 - 700), rel=1e-4)


@pytest.mark.parametrize(
    ("reply", "why"),
    [
        (fixed(emitter=nan), "it gives nan as its emitter distance in cm, usually 7.5"),
        (fixed(reference=0.0), "it gives 0 as its reference distance in cm, usually 120"),
        (fixed(reference=float("inf")), "it gives inf as its reference distance in cm, usually 120"),
        (fixed(pixel_size=-0.1042), "it gives -0.1042 as its reference pixel size in mm, usually 0.1042"),
        (fixed(emitter=75.0), "it gives 75 as its emitter distance in cm, usually 7.5"),
        (bytes(109), "its fixed parameters have 109 bytes where at least 110 are needed"),
    ],
)
def test_distances_that_cannot_be_right_are_replaced_by_the_usual_ones_and_it_is_said(reply: bytes, why: str) -> None:
    constants = device_constants(reply, struct.pack("<HH", 0, 210))
    assert constants.zero_plane == ZeroPlane(const_shift=210.0)
    assert constants.doubts == (f"the Kinect's own distances cannot be right: {why}; {REMEDY}",)


@pytest.mark.parametrize(
    ("reply", "why"),
    [
        (struct.pack("<HH", 200, 0), "it gives 0 as its constant shift, usually 200"),
        (b"\x00\x00\xc8", "its algorithm parameters have 3 bytes where at least 4 are needed"),
    ],
)
def test_a_shift_that_cannot_be_right_is_replaced_by_the_usual_one_and_it_is_said(reply: bytes, why: str) -> None:
    constants = device_constants(fixed(emitter=7.0), reply)
    assert constants.zero_plane.emitter_distance_cm == pytest.approx(7.0)
    assert constants.zero_plane.const_shift == 200.0
    assert constants.doubts == (f"the Kinect's own shift cannot be right: {why}; {REMEDY}",)
