"""The table as a source of frames: hands in, raw depth frames out."""

from collections.abc import Sequence

import numpy as np

from touchd.geometry import kinect_v1_sensor
from touchd.model import Frame, Sensor, frozen_array
from touchd.table.render import DepthRenderer
from touchd.table.scene import Hand, TableCamera
from touchd.table.sensor_kinect import KinectModel, KinectV1

_UNIT, _FRAMES = 0, 1  # what is drawn from a seed: the particular sensor, and the noise of its frames


def table_sensor(camera: TableCamera, seed: int) -> Sensor:
    """Return the sensor that :class:`Table` sees through, without the work of making it."""
    return kinect_v1_sensor(intrinsics=camera.intrinsics, serial=f"table-{seed}")


class Table:
    """A table seen by one particular Kinect v1, drawn from ``seed``.

    A frame's noise follows from the seed and the frame's index alone, so that frames left out change no others.
    """

    def __init__(self, camera: TableCamera, seed: int, model: KinectModel | None = None) -> None:
        self.camera = camera
        self.sensor = table_sensor(camera, seed)
        self._seed = seed
        self._renderer = DepthRenderer(camera, self.sensor.size)
        unit = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_UNIT,)))
        self._kinect = KinectV1(self.sensor, self._renderer.table_mm, model or KinectModel(), unit)

    def render(self, hands: Sequence[Hand], t_ns: int, index: int) -> Frame:
        """Return the frame of the table with these hands over it; the arrays in it are read-only."""
        noise = np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(_FRAMES, index)))
        raw = self._kinect.read(self._renderer.render(hands), noise)
        return Frame(index=index, t_ns=t_ns, raw=frozen_array(raw))
