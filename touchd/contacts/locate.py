"""From blobs in the picture to contacts on the surface, in area coordinates."""

import numpy as np

from touchd.contacts.settings import BlobSettings
from touchd.contacts.shell import Blob
from touchd.geometry import AreaMap, Doubles, SurfaceMap, depth_mm
from touchd.model import Contact, Sensor


class Locator:
    """Puts blobs on the surface: the touch point is the foot of the blob's centre along the surface's local normal."""

    def __init__(self, sensor: Sensor, surface_map: SurfaceMap, area_map: AreaMap, settings: BlobSettings) -> None:
        self._sensor = sensor
        self._surface = surface_map
        self._area = area_map
        self._settings = settings

    def contacts(self, blobs: list[Blob]) -> list[Contact]:
        """Return the contacts of the blobs whose size on the surface is a finger's, ordered by where they are."""
        if not blobs:
            return []
        centres = np.array([(b.u, b.v) for b in blobs])
        # One pixel along the long axis, to see which way it runs on the surface.
        along = centres + np.array([b.axis for b in blobs])
        readings = depth_mm(self._sensor, np.array([(b.surface_raw, b.seen_raw) for b in blobs]))
        drops = readings[:, 0] - readings[:, 1]
        feet, heights = self._surface.feet(np.concatenate([centres, along]), np.concatenate([drops, drops]))
        where = self._area.of_points(feet)
        on_table = where * np.array(self._area.size_mm)
        count = len(blobs)
        run = on_table[count:] - on_table[:count]
        areas = np.array([b.pixels for b in blobs]) * self._pixel_mm2(centres, feet[:count])
        least, most = self._settings.min_area_mm2, self._settings.max_area_mm2
        contacts = [
            Contact(
                x=float(where[i, 0]),
                y=float(where[i, 1]),
                x_mm=float(on_table[i, 0]),
                y_mm=float(on_table[i, 1]),
                height_mm=float(heights[i]),
                area_mm2=float(areas[i]),
                angle=_half_turn(float(np.arctan2(run[i, 1], run[i, 0]))),
                firm=blob.peak >= self._settings.threshold,
            )
            for i, blob in enumerate(blobs)
            if least <= areas[i] <= most and np.all(np.isfinite(where[i]))
        ]
        return sorted(contacts, key=lambda c: (c.x_mm, c.y_mm))

    def _pixel_mm2(self, pixels: Doubles, feet: Doubles) -> Doubles:
        """Return the size of one pixel's footprint on the surface: Z²/(fx·fy), over the slant's cosine."""
        k = self._area.intrinsics
        height, width = self._surface.depth.shape
        u = np.clip(np.rint(pixels[:, 0]).astype(int), 0, width - 1)
        v = np.clip(np.rint(pixels[:, 1]).astype(int), 0, height - 1)
        facing = np.abs(np.sum(self._surface.normals[v, u] * self._surface.rays[v, u], axis=1))
        footprint: Doubles = feet[:, 2] ** 2 / (k.fx * k.fy) / np.maximum(facing, 0.1)
        return footprint


def _half_turn(angle: float) -> float:
    """Return the same undirected line's angle in (−π/2, π/2]."""
    turned = (angle + np.pi / 2) % np.pi - np.pi / 2
    return float(np.pi / 2 if turned == -np.pi / 2 else turned)
