"""From blobs in the picture to contacts on the surface, in area coordinates."""

import math

from touchd.contacts.settings import BlobSettings
from touchd.contacts.shell import Blob
from touchd.geometry import AreaMap, Foot, SurfaceMap, depth_of
from touchd.model import Contact, Sensor


class Locator:
    """Puts blobs on the surface: the touch point is the foot of the blob's centre along the surface's local normal."""

    def __init__(self, sensor: Sensor, surface_map: SurfaceMap, area_map: AreaMap, settings: BlobSettings) -> None:
        self._sensor = sensor
        self._surface = surface_map
        self._area = area_map
        self._settings = settings

    def relocate(self, area_map: AreaMap) -> None:
        """Take the area to lie so from now on."""
        self._area = area_map

    def contacts(self, blobs: list[Blob]) -> list[Contact]:
        """Return the contacts of the blobs whose size on the surface is a finger's, in the order of the blobs."""
        located = (self._locate(blob) for blob in blobs)
        return [contact for contact in located if contact is not None]

    # One blob at a time in plain Python: for a handful of blobs numpy's calls cost more than the sums.
    def _locate(self, blob: Blob) -> Contact | None:
        settings = self._settings
        drop_mm = depth_of(self._sensor, blob.surface_raw) - depth_of(self._sensor, blob.seen_raw)
        foot = self._surface.foot(blob.u, blob.v, drop_mm)
        x, y = self._area.of_point(foot.x_mm, foot.y_mm, foot.z_mm)
        area_mm2 = blob.pixels * self._pixel_mm2(foot)
        if not (settings.min_area_mm2 <= area_mm2 <= settings.max_area_mm2 and math.isfinite(x) and math.isfinite(y)):
            return None
        width_mm, height_mm = self._area.size_mm
        return Contact(
            x=x,
            y=y,
            x_mm=x * width_mm,
            y_mm=y * height_mm,
            height_mm=foot.height_mm,
            area_mm2=area_mm2,
            angle=self._angle(blob),
            firm=blob.peak >= settings.threshold,
        )

    def _pixel_mm2(self, foot: Foot) -> float:
        """Return the size of one pixel's footprint on the surface: Z²/(fx·fy), over the slant's cosine."""
        k = self._area.intrinsics
        return foot.z_mm * foot.z_mm / (k.fx * k.fy) / max(foot.facing, 0.1)

    def _angle(self, blob: Blob) -> float:
        """Return the direction in the area of the blob's long axis; over one pixel the lens does not bend it."""
        width_mm, height_mm = self._area.size_mm
        here_x, here_y = self._area.of_ideal_pixel(blob.u, blob.v)
        there_x, there_y = self._area.of_ideal_pixel(blob.u + blob.axis[0], blob.v + blob.axis[1])
        return _half_turn(math.atan2((there_y - here_y) * height_mm, (there_x - here_x) * width_mm))


def _half_turn(angle: float) -> float:
    """Return the same undirected line's angle in (−π/2, π/2]."""
    return math.pi / 2 - (math.pi / 2 - angle) % math.pi
