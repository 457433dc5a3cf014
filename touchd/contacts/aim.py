"""Where people aim: they see their fingertip from above and behind, and do not touch where they mean to.

The difference is a constant along the finger that differs with the side of the table that one stands at. ``touchd align
--eye`` measures it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, sin, sqrt

from touchd.contacts.method import Sighting
from touchd.model import Contact


@dataclass(frozen=True, slots=True)
class EyeOffsets:
    """How far ahead of the touch, along the finger, people mean to be, in mm, by the side of the area they reach from.

    Negative where they mean a place short of the touch. ``bottom`` is the side of the area's lower edge, where y is 1.
    """

    bottom: float = 0.0
    top: float = 0.0
    left: float = 0.0
    right: float = 0.0

    def along_mm(self, towards: tuple[float, float]) -> float:
        """Return the offset of a finger that points so (length 1): between two sides, a mean of theirs."""
        x, y = towards
        sideways = self.left if x > 0.0 else self.right
        upright = self.top if y > 0.0 else self.bottom
        return x * x * sideways + y * y * upright


def heading(seen_angle: float, pitch_rad: float, lean: tuple[float, float]) -> float:
    """Return the angle on the surface of the way back along a finger that is seen at ``seen_angle`` in the picture.

    Where the camera does not look straight down, what is higher by 1 mm is seen ``lean`` (x, y in mm on the surface)
    farther out, so that a finger that rises by ``pitch_rad`` seems turned: for its true direction d and the seen one s,
    both of length 1, k·s = cos(pitch)·d + sin(pitch)·lean with some k > 0.
    """
    x, y = sin(pitch_rad) * lean[0], sin(pitch_rad) * lean[1]
    along = x * cos(seen_angle) + y * sin(seen_angle)
    k = along + sqrt(max(0.0, along * along - x * x - y * y + cos(pitch_rad) ** 2))
    return atan2(k * sin(seen_angle) - y, k * cos(seen_angle) - x)


def aimed(sighting: Sighting, offsets: EyeOffsets, area_mm: tuple[float, float]) -> Sighting:
    """Return what was seen with every fingertip where its owner means it to be; those of unknown direction stay.

    ``area_mm``: the area's width and height.
    """
    return replace(
        sighting,
        contacts=_moved(sighting.contacts, offsets, area_mm),
        hovers=_moved(sighting.hovers, offsets, area_mm),
    )


def _moved(contacts: Sequence[Contact], offsets: EyeOffsets, area_mm: tuple[float, float]) -> list[Contact]:
    return [
        contact if contact.towards is None else _ahead(contact, contact.towards, offsets, area_mm)
        for contact in contacts
    ]


def _ahead(
    contact: Contact, towards: tuple[float, float], offsets: EyeOffsets, area_mm: tuple[float, float]
) -> Contact:
    along_mm = offsets.along_mm(towards)
    aim_x, aim_y = along_mm * towards[0], along_mm * towards[1]
    return replace(
        contact,
        x=contact.x + aim_x / area_mm[0],
        y=contact.y + aim_y / area_mm[1],
        x_mm=contact.x_mm + aim_x,
        y_mm=contact.y_mm + aim_y,
        aim_mm=(aim_x, aim_y),
    )
