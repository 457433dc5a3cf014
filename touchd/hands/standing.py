"""What stands above the surface in one coarse picture: connected parts, and where they come in over the border."""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from touchd.hands.lookout import Lookout
from touchd.model import CoarsePicture, Floats, Mask

Labels: TypeAlias = NDArray[np.uint16]
Indices: TypeAlias = NDArray[np.signedinteger]
Bytes: TypeAlias = NDArray[np.uint8]
Place: TypeAlias = tuple[float, float]  # column and row in the coarse picture

_LEVEL_MM, _LEVEL_STEPS = 5.0, 0.15  # the picture is averaged over 3 x 3 before
_NOTHING_MM = np.float32(1e9)  # is higher
_LEAST_MM2, _LEAST_PX = 250.0, 4
_BORDER_PX = 2  # what is so near to the border comes in over it
_RUN_GAP_PX = 4  # longer gaps on the border lie between two that come in
_SPECK, _REACH = np.ones((3, 3), np.uint8), np.ones((7, 7), np.uint8)  # smaller, pixels without readings are noise


@dataclass(frozen=True, slots=True)
class Part:
    """What is connected. ``doors`` are where it comes in over the border, none for an island."""

    label: int
    pixels: int
    doors: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class Standing:
    """All that stands above the surface. ``labels`` (rows, columns) tell which part a pixel belongs to, 0 for none.

    Labels that ``parts`` does not have are of what is too small to count. ``heights_mm`` are the picture's, averaged
    over 3 x 3. ``above`` is 255 where there is a label, else 0; ``columns``, ``rows`` and ``whose`` (N,) list those
    pixels and their labels.
    """

    labels: Labels
    count: int  # all labels are below
    parts: dict[int, Part]
    heights_mm: Floats
    picture: CoarsePicture
    above: Bytes
    columns: Indices
    rows: Indices
    whose: Labels
    border: "Border"

    def places(self, label: int) -> tuple[Floats, Floats]:
        """Return the columns and the rows (N,) of a part's pixels."""
        own = (self.whose == label).nonzero()[0]
        return self.columns[own].astype(np.float32), self.rows[own].astype(np.float32)

    def heights(self, label: int) -> Floats:
        """Return the heights (N,) in mm of a part's pixels, in the order of their places."""
        own = (self.whose == label).nonzero()[0]
        heights: Floats = self.heights_mm[self.rows[own], self.columns[own]]
        return heights

    def centre(self, label: int) -> Place:
        """Return where the middle of a part is."""
        columns, rows = self.places(label)
        return float(columns.mean()), float(rows.mean())

    def dark_doors(self, label: int) -> tuple[Place, ...]:
        """Return where what leads to a part but gives no readings, such as a dark sleeve, comes in over the border."""
        dark = cv2.dilate(cv2.erode((self.border.known & ~self.picture.readings).view(np.uint8), _SPECK), _REACH)
        _, labels = cv2.connectedComponents(dark, None, 8, cv2.CV_16U)
        columns, rows = self.places(label)
        near = np.bincount(labels[rows.astype(np.intp), columns.astype(np.intp)])
        near[0] = 0
        return tuple(self.border.doors(np.asarray(labels, np.uint16)).get(int(near.argmax()), ()))


class Horizon:
    """Finds what stands above one surface.

    ``levels_mm`` (rows, columns): what is higher is not the empty surface.
    """

    def __init__(self, lookout: Lookout) -> None:
        self.level_mm = _LEVEL_MM + _LEVEL_STEPS * lookout.step_mm
        self.levels_mm: Floats = np.where(lookout.table, np.float32(self.level_mm), _NOTHING_MM)
        self._least_px = max(_LEAST_PX, round(_LEAST_MM2 / lookout.pixel_mm**2))
        self._table = lookout.table.astype(np.float32)
        self._smooth = np.empty(lookout.shape, np.float32)
        self._border = Border(lookout.table, lookout.known)

    def find(self, picture: CoarsePicture, levels_mm: Floats) -> Standing | None:
        """Return what stands higher than levels (rows, columns), None where nothing does."""
        smooth = cv2.blur(np.multiply(picture.heights_mm, self._table, out=self._smooth), (3, 3), dst=self._smooth)
        above = cv2.compare(smooth, levels_mm, cv2.CMP_GT)
        if cv2.countNonZero(above) < self._least_px:
            return None
        # Statistics of the parts would cost as much again as all of this.
        count, found = cv2.connectedComponents(above, None, 8, cv2.CV_16U)
        labels = np.asarray(found, np.uint16)
        places = np.asarray(cv2.findNonZero(above), np.int32).reshape(-1, 2)
        columns, rows = places[:, 0], places[:, 1]
        whose = labels.take(rows * labels.shape[1] + columns)
        sizes = np.bincount(whose, minlength=count).tolist()
        big = [label for label, size in enumerate(sizes) if size >= self._least_px]
        if not big:
            return None
        doors = self._border.doors(labels)
        parts = {label: Part(label, sizes[label], tuple(doors.get(label, ()))) for label in big}
        solid = np.asarray(above, np.uint8)
        return Standing(labels, count, parts, self._smooth, picture, solid, columns, rows, whose, self._border)


class Border:
    """The border of where the surface is seen, followed around it."""

    def __init__(self, table: Mask, known: Mask) -> None:
        """``table`` (rows, columns): where that is; ``known``: without the blind spots in it."""
        self.known = known
        outlines, _ = cv2.findContours(table.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        largest = max(outlines, key=cv2.contourArea, default=np.zeros((0, 1, 2), np.int32))
        places = np.reshape(largest, (-1, 2))
        steps = np.array([(u, v) for u in (-_BORDER_PX, 0, _BORDER_PX) for v in (-_BORDER_PX, 0, _BORDER_PX)])
        near = places[None] + steps[:, None]
        rows, columns = table.shape
        u, v = np.clip(near[..., 0], 0, columns - 1), np.clip(near[..., 1], 0, rows - 1)
        self._pixels = np.asarray(v * columns + u, np.intp)  # (9, N) of the flat picture
        self._places = [(float(u), float(v)) for u, v in places.tolist()]

    def doors(self, labels: Labels) -> dict[int, list[Place]]:
        """Return by label the middles of the runs along the border."""
        around = labels.take(self._pixels).max(axis=0)
        at = np.flatnonzero(around)
        if not at.size:
            return {}
        runs: list[list[int]] = []  # label, first and last place on the border
        for place, label in zip(at.tolist(), around[at].tolist(), strict=True):
            if runs and runs[-1][0] == label and place - runs[-1][2] <= _RUN_GAP_PX:
                runs[-1][2] = place
            else:
                runs.append([label, place, place])
        length = len(around)
        if len(runs) > 1 and runs[0][0] == runs[-1][0] and runs[0][1] + length - runs[-1][2] <= _RUN_GAP_PX:
            runs[0][1] = runs.pop()[1] - length
        doors: dict[int, list[Place]] = {}
        for label, first, last in runs:
            doors.setdefault(label, []).append(self._places[(first + last) // 2 % length])
        return doors
