"""The table as a source of frames: hands in, raw depth frames out."""

from collections.abc import Sequence

import numpy as np

from touchd.geometry import kinect_v1_sensor
from touchd.model import Frame, frozen_array
from touchd.table.render import DepthRenderer
from touchd.table.scene import Hand, TableCamera
from touchd.table.sensor_kinect import KinectModel, KinectV1


class Table:
    """A table seen by one particular Kinect v1, drawn from ``seed``.

    Every frame takes its noise from where the last one left the generator, so the frames of two tables are
    equal as long as the same pictures were asked of them in the same order.
    """

    def __init__(self, camera: TableCamera, seed: int, model: KinectModel | None = None) -> None:
        self.camera = camera
        self.sensor = kinect_v1_sensor(intrinsics=camera.intrinsics, serial=f"table-{seed}")
        self._renderer = DepthRenderer(camera, self.sensor.size)
        unit, self._rng = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
        self._kinect = KinectV1(self.sensor, self._renderer.table_mm, model or KinectModel(), unit)

    def render(self, hands: Sequence[Hand], t_ns: int, index: int) -> Frame:
        """Return the frame of the table with these hands over it; the arrays in it are read-only."""
        raw = self._kinect.read(self._renderer.render(hands), self._rng)
        return Frame(index=index, t_ns=t_ns, raw=frozen_array(raw))
