"""Many fingertips at once: still scenes with a given number of touches, for benchmarks."""

from math import ceil

from touchd.table.hands import HandPose, open_hand, pointing_hand
from touchd.table.scene import Area, Hand

_BREADTH_MM = 150.0  # that an open hand needs beside its neighbour, at scale 1
_REACH_MM = 130.0  # that its fingertips span along its arm
_SMALLEST = 0.6  # a small child's hand
_FINGERS = 5


def contact_scene(count: int, area: Area) -> list[Hand]:
    """Return hands with ``count`` touching fingertips in all, spread over the area, none over another.

    As many as possible have all five fingers down, the rest point with one. They reach in from the viewer's
    side and, from three hands on, from the far side too. ValueError where the area is too small for so many.
    """
    open_hands, pointing_hands = divmod(count, _FINGERS)
    shapes = [open_hand] * open_hands + [pointing_hand] * pointing_hands
    if not shapes:
        return []
    rows = 1 if len(shapes) <= 2 else 2
    columns = ceil(len(shapes) / rows)
    width_mm, height_mm = area.size_mm
    scale = min(1.0, width_mm / columns / _BREADTH_MM, height_mm / rows / _REACH_MM)
    if scale < _SMALLEST:
        raise ValueError(
            f"contact_scene: {count} fingertips need an area of at least "
            f"{columns * _BREADTH_MM * _SMALLEST:.0f} x {rows * _REACH_MM * _SMALLEST:.0f} mm, "
            f"but it is {width_mm:.0f} x {height_mm:.0f} mm: ask for fewer or give a larger area"
        )
    hands: list[Hand] = []
    for i, shape in enumerate(shapes):
        row, column = divmod(i, columns)
        towards = 0.25 if rows == 2 else 0.0
        y = 0.5 + (towards if row == 0 else -towards)
        place = area.at((column + 0.5) / columns, y)
        hands.append(shape(HandPose(place, heading_deg=0.0 if row == 0 else 180.0, scale=scale)))
    return hands
