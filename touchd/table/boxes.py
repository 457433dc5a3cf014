"""Rectangles of pixels, so that work is done only where something is."""

from collections.abc import Iterable
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
