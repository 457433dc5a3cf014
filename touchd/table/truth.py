"""What really happened in a frame: where the fingertips were, in area coordinates, and which touched."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from touchd.table.scene import Area, Fingertip, TableCamera

HOVERING = -1


@dataclass(frozen=True, slots=True)
class TipTruth:
    """A fingertip in view.

    ``tip`` counts touching episodes from 1, each with its way down and up, and is -1 for a tip that only
    hovers. ``x``, ``y`` are the touch point's area coordinates, ``clearance_mm`` the gap between fingertip
    and table.
    """

    tip: int
    x: float
    y: float
    clearance_mm: float
    touching: bool

    def as_json(self) -> dict[str, Any]:
        """Return the entry of a truth file, one list of which stands for a frame."""
        return {
            "tip": self.tip,
            "x": self.x,
            "y": self.y,
            "clearance_mm": self.clearance_mm,
            "touching": self.touching,
        }


def tip_truth(area: Area, fingertip: Fingertip, tip: int) -> TipTruth:
    """Return the truth about a fingertip over the flat table.

    A plane's rectangle and the four-corner homography of its undistorted picture agree everywhere, so that
    area coordinates are plain shares of the rectangle.
    """
    (x_mm, y_mm), (centre_x_mm, centre_y_mm) = fingertip.at_mm, area.centre_mm
    width_mm, height_mm = area.size_mm
    return TipTruth(
        tip=tip,
        x=(x_mm - centre_x_mm) / width_mm + 0.5,
        y=(y_mm - centre_y_mm) / height_mm + 0.5,
        clearance_mm=fingertip.clearance_mm,
        touching=fingertip.clearance_mm == 0.0,
    )


def in_view(camera: TableCamera, size: tuple[int, int], fingertip: Fingertip) -> bool:
    """Return whether the table under a fingertip lies in a picture of this size (width, height)."""
    pixel = camera.pixels(np.array([*fingertip.at_mm, 0.0]))
    return bool(np.all((pixel >= 0.0) & (pixel <= np.array(size) - 1.0)))
