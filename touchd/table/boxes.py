"""Rectangles of pixels, so that work is done only where something is."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of pixels: columns left..right - 1 and rows top..bottom - 1."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def empty(self) -> bool:
        """Whether there is no pixel in it."""
        return self.left >= self.right or self.top >= self.bottom

    @property
    def window(self) -> tuple[slice, slice]:
        """The box as an index of a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def grown(self, left: int, around: int, size: tuple[int, int]) -> "Box":
        """Return a box wider by ``left`` on the left, by ``around`` on all sides, cut to the picture."""
        return Box(
            max(self.left - left - around, 0),
            max(self.top - around, 0),
            min(self.right + around, size[0]),
            min(self.bottom + around, size[1]),
        )

    def joined(self, other: "Box") -> "Box":
        """Return the smallest box around both."""
        return Box(
            min(self.left, other.left),
            min(self.top, other.top),
            max(self.right, other.right),
            max(self.bottom, other.bottom),
        )

    def meets(self, other: "Box") -> bool:
        """Whether the two share a pixel."""
        return (
            self.left < other.right and other.left < self.right and self.top < other.bottom and other.top < self.bottom
        )

    def shrunk_to(self, inner: "Box") -> tuple[slice, slice]:
        """Return a box within this one as an index of this one's own picture."""
        top, left = inner.top - self.top, inner.left - self.left
        return slice(top, top + inner.bottom - inner.top), slice(left, left + inner.right - inner.left)

    @property
    def area(self) -> int:
        """How many pixels it has."""
        return (self.right - self.left) * (self.bottom - self.top)


def banded(boxes: Sequence[Box], rows: int) -> list[Box]:
    """Return boxes that cover the given ones, do not meet, and lie each in one band of so many rows.

    They follow what lies slantwise more closely than one box around it.
    """
    bands: dict[int, list[Box]] = {}
    for box in boxes:
        for band in range(box.top // rows, (box.bottom - 1) // rows + 1):
            part = Box(box.left, max(box.top, band * rows), box.right, min(box.bottom, (band + 1) * rows))
            bands.setdefault(band, []).append(part)
    return [box for band in sorted(bands) for box in apart(bands[band])]


def apart(boxes: Iterable[Box]) -> list[Box]:
    """Return boxes that cover the given ones and do not meet: those that meet are joined."""
    separate: list[Box] = []
    for given in boxes:
        box = given
        while meeting := [other for other in separate if other.meets(box)]:
            for other in meeting:
                separate.remove(other)
                box = box.joined(other)
        separate.append(box)
    return separate
