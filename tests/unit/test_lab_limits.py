import pytest
from touchd.errors import UsageError
from touchd.lab.limits import HIDDEN_MM, limits, lowest_seen_mm
from touchd.lab.scenes import lab_scene


def test_fingers_that_touch_targets_are_seen_as_low_as_a_finger_is_thick() -> None:
    scene = lab_scene("targets", 750.0, 3)
    seen = lowest_seen_mm(scene)
    assert len(seen) == len(scene.touches)
    assert all(2.0 <= height <= HIDDEN_MM for height in seen)


def test_the_table_has_a_row_for_each_scene_with_touches_at_each_height() -> None:
    head, columns, *rows = limits("passing,hover", "750,1500", "3")
    assert head.startswith("simulated, ideal camera, seeds 3: ")
    assert columns.split()[:2] == ["height", "touches"]
    assert [row.split()[:3] for row in rows] == [["passing", "0.75", "m"], ["passing", "1.5", "m"]]


def test_a_scene_that_is_none_is_refused() -> None:
    with pytest.raises(UsageError, match="--scenes: there is no lab scene 'dance'; choose from targets"):
        list(limits("dance", "750", "1"))
