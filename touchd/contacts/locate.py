"""From blobs in the picture to contacts on the surface, in area coordinates."""

import math

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
        """Return the contacts of the blobs whose size on the surface is a finger's, in the order of the blobs."""
        if not blobs:
            return []
        count = len(blobs)
        # Each centre, and one pixel further along the long axis to see which way it runs on the surface.
        seen = np.array([(b.u, b.v) for b in blobs] + [(b.u + b.axis[0], b.v + b.axis[1]) for b in blobs])
        readings = depth_mm(self._sensor, np.array([(b.surface_raw, b.seen_raw) for b in blobs]))
        drops = readings[:, 0] - readings[:, 1]
        feet, heights = self._surface.feet(seen, np.concatenate([drops, drops]))
        where = self._area.of_points(feet)
        on_table = where * np.array(self._area.size_mm)
        run = on_table[count:] - on_table[:count]
        areas = np.array([b.pixels for b in blobs]) * self._pixel_mm2(seen[:count], feet[:count])
        finger_sized = (areas >= self._settings.min_area_mm2) & (areas <= self._settings.max_area_mm2)
        usable = finger_sized & np.isfinite(where[:count]).all(axis=1)
        columns = np.column_stack(
            [where[:count], on_table[:count], heights[:count], areas, np.arctan2(run[:, 1], run[:, 0])]
        )
        return [
            Contact(x, y, x_mm, y_mm, height, area, _half_turn(angle), blob.peak >= self._settings.threshold)
            for blob, good, (x, y, x_mm, y_mm, height, area, angle) in zip(
                blobs, usable.tolist(), columns.tolist(), strict=True
            )
            if good
        ]

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
    return math.pi / 2 - (math.pi / 2 - angle) % math.pi
