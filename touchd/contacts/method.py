"""What a contact method is, so that others can plug in theirs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias, runtime_checkable

from touchd.contacts.settings import BlobSettings
from touchd.geometry import AreaMap, SurfaceMap
from touchd.model import Contact, Image16, Mask, Shell, Surface, SurfaceRows, Unseen

# Where a live touch should be by now: x and y in mm of the area.
Expected: TypeAlias = tuple[float, float]
_ALL_SEEN = Unseen()


@dataclass(frozen=True, slots=True)
class Sighting:
    """What a method made of one picture.

    A contact that is not ``firm`` continues a touch but begins none. ``lifted_mm`` are places (x, y in mm of the area)
    where a finger is seen that surely does not touch, or where one touched that has lifted: a touch there need not be
    waited for. ``hovers`` are fingertips that are seen well and do not touch, none of them firm; ``height_mm`` is the
    gap below each. ``unseen``: of which of the expected touches it tells nothing that they were not found.
    """

    contacts: list[Contact]
    lifted_mm: list[tuple[float, float]] = field(default_factory=list)
    hovers: list[Contact] = field(default_factory=list)
    unseen: Unseen = _ALL_SEEN


class ContactMethod(Protocol):
    """Finds contacts over one surface. The same pictures and expectations in the same order give the same contacts."""

    def find(self, raw: Image16, expected: Sequence[Expected]) -> Sighting:
        """Return what one picture (H, W) uint16 shows, in any order.

        ``expected`` are the live touches: where to look again, and nothing to be echoed.
        """
        ...


@runtime_checkable
class FollowsSurface(Protocol):
    """What a method has that goes with a living surface; one that has not keeps to the surface that it was made for."""

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the empty surface to read differently in the pictures from now on.

        Called before each picture, for a few rows: the surface drifted there, was moved, or a thing has become part of
        it. Must be quick.
        """
        ...


@runtime_checkable
class FollowsArea(Protocol):
    """What a method has that can go on with the area elsewhere in the picture, after the camera was knocked."""

    def relocate(self, area: AreaMap) -> None:
        """Take the area to lie so from the next picture on; its size is as it was."""
        ...


@dataclass(frozen=True, slots=True)
class Place:
    """All that is known of a surface before the first touch: what a method makes its tables from."""

    surface: Surface
    surface_map: SurfaceMap
    shell: Shell
    area: AreaMap
    inside: Mask  # (H, W) the active area with a margin around it; contacts elsewhere do not matter
    blobs: BlobSettings  # what the config says under touch


class MakesMethod(Protocol):
    """What an entry point of the group ``touchd.methods`` must name; it may take a fraction of a second."""

    def __call__(self, place: Place) -> ContactMethod:
        """Return the method for one surface."""
        ...
