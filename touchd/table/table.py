"""The table as a source of frames: hands in, raw depth frames out."""

from collections.abc import Sequence
from typing import Protocol, TypeAlias

import numpy as np

from touchd.geometry import KINECT_SIZE, kinect_v1_sensor
from touchd.model import Frame, Image16, Sensor, frozen_array
from touchd.table.misreading import TRUE_READING, Misreading
from touchd.table.relief import FLAT_TABLE, Ground
from touchd.table.render import DepthPicture, DepthRenderer
from touchd.table.scene import Hand, TableCamera
from touchd.table.sensor_kinect import KinectModel, KinectV1
from touchd.table.sensor_stereo import Stereo, StereoModel, stereo_sensor

_UNIT, _FRAMES = 0, 1  # what is drawn from a seed: the particular sensor, and the noise of its frames

SensorModel: TypeAlias = KinectModel | StereoModel
_KINECT = KinectModel()


class _Reader(Protocol):
    """A sensor: true depth in, raw picture out."""

    def read(self, picture: DepthPicture, rng: np.random.Generator, wrong: Misreading) -> Image16:
        """Return the raw picture of true depth, with new noise."""


def table_sensor(camera: TableCamera, seed: int, model: SensorModel = _KINECT) -> Sensor:
    """Return the sensor that :class:`Table` sees through, without the work of making it."""
    if isinstance(model, StereoModel):
        return stereo_sensor(camera.intrinsics, KINECT_SIZE, model)
    return kinect_v1_sensor(intrinsics=camera.intrinsics, serial=f"table-{seed}")


class Table:
    """A table seen by one particular sensor, drawn from ``seed``: a Kinect v1 or a stereo camera.

    A frame's noise follows from the seed and the frame's index alone, so that frames left out change no others.
    """

    def __init__(
        self, camera: TableCamera, seed: int, model: SensorModel | None = None, ground: Ground = FLAT_TABLE
    ) -> None:
        self.camera = camera
        self.sensor = table_sensor(camera, seed, model or _KINECT)
        self._seed = seed
        self._renderer = DepthRenderer(camera, self.sensor.size, ground)
        unit = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_UNIT,)))
        self._reader: _Reader = (
            Stereo(self.sensor, self._renderer.empty, model, unit)
            if isinstance(model, StereoModel)
            else KinectV1(self.sensor, self._renderer.empty, model or _KINECT, unit)
        )

    def render(self, hands: Sequence[Hand], t_ns: int, index: int, wrong: Misreading = TRUE_READING) -> Frame:
        """Return the frame of the table with these hands over it; the arrays in it are read-only."""
        return Frame(index=index, t_ns=t_ns, raw=frozen_array(self.read(self.true_depth(hands), index, wrong)))

    def true_depth(self, hands: Sequence[Hand]) -> DepthPicture:
        """Return what an ideal camera would measure."""
        return self._renderer.render(hands)

    def read(self, picture: DepthPicture, index: int, wrong: Misreading = TRUE_READING) -> Image16:
        """Return what the sensor reads of true depth in the frame with this index."""
        noise = np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(_FRAMES, index)))
        return self._reader.read(picture, noise, wrong)
