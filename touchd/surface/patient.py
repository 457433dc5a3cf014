"""Calibrating in a daemon's life: wait for an empty surface, for a while."""

import numpy as np

from touchd.model import Frame, Mask, Sensor, Surface
from touchd.surface.calibrate import Calibration
from touchd.surface.settings import CalibrationSettings

# A finger at 1.5 m covers about this share of the area; a still scene's outliers are far fewer.
_STILL_SHARE = 0.002
# A surface of which less is usable is no surface: the camera is covered, or looks elsewhere.
_LEAST_COVERAGE = 0.05


class PatientCalibration:
    """Calibrates on as many still frames in a row as the settings ask for; motion starts it anew.

    What does not move cannot be told from the surface: a hand that rests there all the time is learned with it.
    """

    def __init__(self, sensor: Sensor, settings: CalibrationSettings, made_from: str, inside: Mask) -> None:
        """``inside`` (H, W): the pixels that matter, those of the active area where it is known."""
        self._sensor = sensor
        self._settings = settings
        self._made_from = made_from
        self._inside = inside
        self._pixels = max(1, int(inside.sum()))
        self._job = Calibration(sensor, settings, made_from)
        self._since_ns: int | None = None
        self._late = False
        self._surface: Surface | None = None
        self._obstacle: str | None = None

    @property
    def surface(self) -> Surface | None:
        """The surface, once enough still frames came."""
        return self._surface

    @property
    def gave_up(self) -> bool:
        """Whether it has waited for longer than the settings allow. It goes on trying while it is given frames."""
        return self._late

    @property
    def why(self) -> str:
        """How far it is, or what it waits for."""
        return f"{self._job.why}; began anew because {self._obstacle}" if self._obstacle else self._job.why

    def take(self, frame: Frame) -> None:
        """Take in one frame. Raises CalibrationError for a picture of another size."""
        if self._since_ns is None:
            self._since_ns = frame.t_ns
        self._late = frame.t_ns - self._since_ns > self._settings.give_up_s * 1e9
        self._job.add(frame.raw)
        moving = int((self._job.moving & self._inside).sum()) / self._pixels
        if moving > _STILL_SHARE:
            self._begin_anew(f"something moved over {max(moving, 0.01):.0%} of the area")
            self._job.add(frame.raw)
        elif self._job.complete:
            self._finish()

    def _finish(self) -> None:
        surface = self._job.surface_so_far()
        coverage = int((surface.valid & self._inside).sum()) / self._pixels
        if coverage < _LEAST_COVERAGE:
            self._begin_anew("the camera sees next to nothing of the area; is it covered?")
        else:
            self._surface = surface

    def _begin_anew(self, obstacle: str) -> None:
        self._obstacle = obstacle
        self._job = Calibration(self._sensor, self._settings, self._made_from)


def everywhere(sensor: Sensor) -> Mask:
    """Return the mask (H, W) of all pixels, for an area that is not known yet."""
    width, height = sensor.size
    return np.ones((height, width), np.bool_)
