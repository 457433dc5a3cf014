"""Arms that are none: what was taken for a second arm in a part of the picture that shows but one."""

from dataclasses import replace

import pytest
from touchd.hands.arm import Arm
from touchd.hands.claims import WayIn
from touchd.hands.limb import Limb
from touchd.hands.lookout import Lookout
from touchd.hands.needless import Needless
from touchd.hands.standing import Horizon, Place, Standing
from touchd.surface.coarse import CoarseHeights
from touchd.table.hands import HandPose, pointing_hand
from touchd.table.scene import Hand

from tabletop import tabletop

HALF_A_SECOND_NS = 500_000_000
TOP = tabletop(750.0)
LOOKOUT = Lookout(TOP.surface, TOP.surface_map, TOP.area_map)


def standing(*hands: Hand) -> Standing:
    heights = CoarseHeights(TOP.surface, TOP.surface_map)
    horizon = Horizon(LOOKOUT)
    found = horizon.find(heights.over(TOP.picture(hands, 40)), horizon.levels_mm)
    assert found is not None
    return found


def arm(key: int, tip: Place, label: int, door: Place) -> Arm:
    middle = 0.8 * tip[0] + 0.2 * door[0], 0.8 * tip[1] + 0.2 * door[1]
    elbow = 0.5 * (tip[0] + door[0]), 0.5 * (tip[1] + door[1])
    limb = Limb(door, elbow, middle, tip, 40.0)
    return Arm(key, 0, 0, limb, (label,), WayIn(door, 80.0, connected=True, led=True), limb.reach, middle, 0)


@pytest.fixture
def pictured() -> Standing:
    return standing(pointing_hand(HandPose((0.0, -60.0), clearance_mm=30.0)))


@pytest.fixture
def real(pictured: Standing) -> Arm:
    ((label, part),) = pictured.parts.items()
    columns, rows = pictured.places(label)
    end = int(rows.argmin())
    return arm(1, (float(columns[end]), float(rows[end])), label, part.doors[0])


def forgotten(arms: list[Arm], pictured: Standing) -> list[set[int]]:
    """Return which arms of that picture are needless at once, and when it has been so for more than half a second."""
    needless = Needless(LOOKOUT, LOOKOUT.px(105.0))
    labels = [list(one.labels) for one in arms]
    return [needless.among(arms, labels, pictured, t_ns) for t_ns in (0, HALF_A_SECOND_NS + 1)]


def moved(real: Arm, key: int, right_mm: float) -> Arm:
    (u, v), limb = real.limb.tip, real.limb
    return replace(real, key=key, limb=replace(limb, tip=(u + LOOKOUT.px(right_mm), v)))


def test_an_arm_whose_hand_is_where_nothing_stands_is_forgotten_half_a_second_later(
    real: Arm, pictured: Standing
) -> None:
    assert forgotten([real, moved(real, 2, 120.0)], pictured) == [set(), {2}]
    assert forgotten([moved(real, 1, 120.0), replace(real, key=2)], pictured) == [set(), {1}]


def test_of_two_where_one_is_seen_the_one_that_ends_there_stays(real: Arm, pictured: Standing) -> None:
    assert forgotten([moved(real, 1, 20.0), replace(real, key=2)], pictured) == [set(), {1}]


def test_of_two_that_end_in_one_place_of_a_part_like_no_single_arm_the_older_one_stays() -> None:
    # A second arm that crosses the first makes the part wider than any arm is.
    crossed = standing(
        pointing_hand(HandPose((0.0, -60.0), clearance_mm=30.0)),
        pointing_hand(HandPose((160.0, 60.0), clearance_mm=90.0, heading_deg=90.0)),
    )
    ((label, part),) = crossed.parts.items()
    door = min(part.doors, key=lambda place: -place[1])
    columns, rows = crossed.places(label)
    end = int(rows.argmin())
    older = arm(1, (float(columns[end]), float(rows[end])), label, door)
    assert forgotten([older, moved(older, 2, 20.0), moved(older, 3, 30.0)], crossed) == [set(), {2, 3}]


def test_where_no_hand_is_to_be_seen_not_all_are_forgotten(real: Arm, pictured: Standing) -> None:
    (_, later) = forgotten([moved(real, 1, 120.0), moved(real, 2, 150.0)], pictured)
    assert later in ({1}, {2})


def test_one_arm_alone_is_never_needless(real: Arm, pictured: Standing) -> None:
    assert forgotten([real], pictured) == forgotten([moved(real, 1, 120.0)], pictured) == [set(), set()]
