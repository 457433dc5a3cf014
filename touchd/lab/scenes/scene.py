"""A lab scene: frames of hands over a surface, with the exact truth about their fingertips."""

from dataclasses import dataclass

from touchd.lab.scenes.play import Play
from touchd.lab.scenes.room import Stage
from touchd.lab.scenes.truth import TrueStack, TrueTip, TrueTouch, TruthFrame
from touchd.model import AreaCorners, Frame, Sensor
from touchd.table.render import DepthPicture
from touchd.table.scene import Area, Hand, TableCamera
from touchd.table.show import frame_time_ns


@dataclass(frozen=True, slots=True)
class LabScene:
    """A scene to run a touch method against; everything in it follows from its name, height and seed.

    ``camera`` is the real one, ``sensor`` what touchd is told of it: in some scenes without the lens's true constants.
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

    @property
    def touches(self) -> tuple[TrueTouch, ...]:
        """All touches of the scene; times as in its frames."""
        begin_ns = frame_time_ns(self.calibration_frames)
        return tuple(touch.later(begin_ns) for touch in self.play.touches)

    def frame(self, index: int) -> Frame:
        """Return the frame with this number; the same whichever were asked for before."""
        return self.stage.table.render(self._hands(index), frame_time_ns(index), index)

    def true_depth(self, index: int) -> DepthPicture:
        """Return what an ideal camera would have measured in a frame."""
        return self.stage.table.true_depth(self._hands(index))

    def truth(self, index: int) -> TruthFrame:
        """Return the truth about a frame, without rendering it."""
        begin_ns = frame_time_ns(self.calibration_frames)
        t_ns = frame_time_ns(index)
        tips: tuple[TrueTip, ...] = ()
        stacks: tuple[TrueStack, ...] = ()
        if t_ns >= begin_ns:
            tips = tuple(tip.later(begin_ns) for tip in self.play.tips(t_ns - begin_ns))
            stacks = self.play.stacks(t_ns - begin_ns)
        return TruthFrame(index, t_ns, tips, stacks)

    def _hands(self, index: int) -> tuple[Hand, ...]:
        played_ns = frame_time_ns(index) - frame_time_ns(self.calibration_frames)
        return self.play.hands(played_ns) if played_ns >= 0 else ()
