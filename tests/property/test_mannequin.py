"""Hands put together from where their fingertips are: whatever they are like, only those that point come near."""

from dataclasses import replace
from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st
from touchd.table.mannequin import INDEX, LITTLE, MIDDLE, RING, THUMB, Build, Idle, fingertip_ways, mannequin
from touchd.table.scene import Capsule, Hand

BUILDS = st.builds(
    Build,
    scale=st.floats(0.72, 1.2),
    breadth=st.floats(0.85, 1.2),
    left=st.booleans(),
    palm_mm=st.floats(28.0, 92.0),
    reach=st.floats(0.2, 0.97),
    bow_mm=st.floats(-1.0, 5.0),
    palm_deg=st.floats(-3.0, 22.0),
    idle=st.sampled_from(Idle),
    elbow_deg=st.floats(-25.0, 25.0),
    rise_deg=st.floats(5.0, 30.0),
)
FINGERS = st.sampled_from([(INDEX,), (INDEX, MIDDLE, RING), (THUMB, INDEX), (THUMB, INDEX, MIDDLE, RING, LITTLE)])
HEADINGS_DEG = st.floats(-180.0, 180.0)
OFF_MM, FLAT_MM = 4.0, 45.0  # a finger may lie flat, and then is as low all along
JOINED_MM = 45.0


def parts_of(hand: Hand) -> list[Capsule]:
    return [solid for solid in hand.solids if isinstance(solid, Capsule)]


def undersides(hand: Hand) -> list[tuple[float, float, float]]:
    """Return where both ends of all parts are, with how high their undersides are."""
    parts = parts_of(hand)
    ends = [(part.a_mm, part.radius_a_mm) for part in parts] + [(part.b_mm, part.radius_b_mm) for part in parts]
    return [(x, y, z - radius) for (x, y, z), radius in ends]


def near(a: tuple[float, float, float], b: tuple[float, float, float]) -> bool:
    return hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < JOINED_MM


@given(build=BUILDS, fingers=FINGERS, clearance_mm=st.floats(0.0, 5.0), heading_deg=HEADINGS_DEG)
def test_each_fingertip_is_where_it_should_be_and_nothing_else_is_as_low(
    build: Build, fingers: tuple[int, ...], clearance_mm: float, heading_deg: float
) -> None:
    tips_mm = fingertip_ways(build, fingers, 1.0)
    hand = mannequin(build, tips_mm, clearance_mm, heading_deg)
    assert [(tip.at_mm, tip.clearance_mm) for tip in hand.fingertips] == [(at, clearance_mm) for at in tips_mm.values()]
    low = [(x, y, under) for x, y, under in undersides(hand) if under < clearance_mm + OFF_MM]
    for x, y, under in low:
        assert min(hypot(x - u, y - v) for u, v in tips_mm.values()) < FLAT_MM
        assert under > clearance_mm - 1e-6
    for u, v in tips_mm.values():
        assert any(hypot(x - u, y - v) < 1e-6 and abs(under - clearance_mm) < 1e-6 for x, y, under in low)


@given(build=BUILDS, fingers=FINGERS, heading_deg=HEADINGS_DEG)
def test_no_part_is_torn_off(build: Build, fingers: tuple[int, ...], heading_deg: float) -> None:
    hand = mannequin(build, fingertip_ways(build, fingers, 1.0), 0.0, heading_deg)
    ends = [(part.a_mm, part.b_mm) for part in parts_of(hand)]
    reached, left = {ends[0][0]}, list(range(len(ends)))
    while grown := [i for i in left if any(near(end, at) for end in ends[i] for at in reached)]:
        reached |= {end for i in grown for end in ends[i]}
        left = [i for i in left if i not in grown]
    assert not left


@given(build=BUILDS, fingers=FINGERS)
def test_a_left_hand_is_a_right_one_s_mirror_image(build: Build, fingers: tuple[int, ...]) -> None:
    right, left = (
        mannequin(own := replace(build, left=left, elbow_deg=0.0), in_place(own, fingers), 0.0, 0.0)
        for left in (False, True)
    )
    for part, mirrored in zip(parts_of(right), parts_of(left), strict=True):
        assert (-part.a_mm[0], *part.a_mm[1:]) == pytest.approx(mirrored.a_mm, abs=1e-9)
        assert (-part.b_mm[0], *part.b_mm[1:]) == pytest.approx(mirrored.b_mm, abs=1e-9)


def in_place(build: Build, fingers: tuple[int, ...]) -> dict[int, tuple[float, float]]:
    """Return where the fingertips of a hand that points up the picture are."""
    ways = fingertip_ways(build, fingers, 1.2)
    return {finger: (to_right, -forward) for finger, (forward, to_right) in ways.items()}


@given(build=BUILDS, heading_deg=HEADINGS_DEG)
def test_a_hand_that_points_up_the_picture_comes_from_below(build: Build, heading_deg: float) -> None:
    straight = replace(build, elbow_deg=0.0)
    arm = parts_of(mannequin(straight, {INDEX: (0.0, 0.0)}, 0.0, 0.0))[-1]
    assert arm.b_mm[1] > 500.0
    turned = parts_of(mannequin(straight, {INDEX: (0.0, 0.0)}, 0.0, heading_deg))[-1]
    assert hypot(*turned.b_mm[:2]) == pytest.approx(hypot(*arm.b_mm[:2]))
