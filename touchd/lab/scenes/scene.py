"""A lab scene: frames of hands over a surface, with the exact truth about their fingertips."""

from dataclasses import dataclass

from touchd.lab.scenes.play import Play
from touchd.lab.scenes.room import Stage
from touchd.lab.scenes.truth import TrueTouch, TruthFrame
from touchd.lab.scenes.upsets import NO_UPSETS, Upsets
from touchd.model import AreaCorners, Frame, Sensor
from touchd.table.render import DepthPicture
from touchd.table.scene import Area, Hand, TableCamera
from touchd.table.show import frame_time_ns


@dataclass(frozen=True, slots=True)
class LabScene:
    """A scene to run a touch method against; everything in it follows from its name, height and seed.

    ``camera`` is the real one, ``sensor`` what touchd is told of it: in some scenes without the lens's true constants.
    One that gets knocked is another one from then on: :meth:`camera_at`. The truth stays where it was on the table.
    ``corners`` are the area's as seen through the real lens. The first ``calibration_frames`` show the empty surface;
    ``frames`` come after them. Indices count from the first of the calibration's.
    """

    name: str
    height_mm: float
    seed: int
    camera: TableCamera
    area: Area
    corners: AreaCorners
    sensor: Sensor
    calibration_frames: int
    frames: int
    play: Play
    stage: Stage
    upsets: Upsets = NO_UPSETS

    @property
    def touches(self) -> tuple[TrueTouch, ...]:
        """All touches of the scene; times as in its frames."""
        begin_ns = frame_time_ns(self.calibration_frames)
        return tuple(touch.later(begin_ns) for touch in self.play.touches)

    def frame(self, index: int) -> Frame:
        """Return the frame with this number; the same whichever were asked for before."""
        t_ns, table = self._played_ns(index), self.stage.table_at(self._played_ns(index))
        return table.render(self._hands(index), frame_time_ns(index), index, self.stage.misreading_at(t_ns))

    def camera_at(self, index: int) -> TableCamera:
        """Return the camera as it stands in a frame."""
        return self.stage.camera_at(self._played_ns(index))

    def true_depth(self, index: int) -> DepthPicture:
        """Return what an ideal camera would have measured in a frame."""
        return self.stage.table_at(self._played_ns(index)).true_depth(self._hands(index))

    def empty_depth(self, index: int) -> DepthPicture:
        """Return the same without hands and things."""
        return self.stage.table_at(self._played_ns(index)).true_depth(())

    def truth(self, index: int) -> TruthFrame:
        """Return the truth about a frame, without rendering it."""
        t_ns, played_ns = frame_time_ns(index), self._played_ns(index)
        if played_ns < 0:
            return TruthFrame(index, t_ns, ())
        tips = tuple(tip.later(t_ns - played_ns) for tip in self.play.tips(played_ns))
        things = self.play.things(played_ns)
        return TruthFrame(index, t_ns, tips, self.play.stacks(played_ns), things, self.upsets.at(played_ns))

    def _hands(self, index: int) -> tuple[Hand, ...]:
        played_ns = self._played_ns(index)
        return self.play.hands(played_ns) if played_ns >= 0 else ()

    def _played_ns(self, index: int) -> int:
        """Return a frame's time on the scene's clock; below 0 while the surface is learned."""
        return frame_time_ns(index) - frame_time_ns(self.calibration_frames)
