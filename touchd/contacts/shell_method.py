"""The paper's method as a contact method: blobs in the shell, put on the surface."""

from collections.abc import Sequence

from touchd.contacts.locate import Locator
from touchd.contacts.method import Expected, Place, Sighting
from touchd.contacts.shell import ShellFinder
from touchd.geometry import AreaMap
from touchd.model import Image16, SurfaceRows


class ShellMethod:
    """Finds what lies in the shell over one surface."""

    def __init__(self, place: Place) -> None:
        self._finder = ShellFinder(place.surface, place.shell, place.blobs, place.inside)
        self._locator = Locator(place.surface.sensor, place.surface_map, place.area, place.blobs)

    def find(self, raw: Image16, expected: Sequence[Expected]) -> Sighting:  # noqa: ARG002
        """Return the contacts in one picture (H, W) uint16."""
        return Sighting(self._locator.contacts(self._finder.find(raw)))

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the surface to read differently from now on."""
        self._finder.follow(now)

    def relocate(self, area: AreaMap) -> None:
        """Take the area to lie so from now on."""
        self._locator.relocate(area)
