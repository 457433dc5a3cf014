"""A scenario as a show without end: the empty table first, then the scenario over and over with rests in between."""

from touchd.table.scenarios import scenario
from touchd.table.script import Moment

FRAMES_A_SECOND = 30
_EMPTY = Moment((), ())
_LOOPS_TO_REST = 3
_REST_FRAMES = 45
_GAP_FRAMES = 8  # between one loop's last hand and the next one's first


def frame_time_ns(index: int) -> int:
    """Return when a frame is due on the show's own clock."""
    return index * 1_000_000_000 // FRAMES_A_SECOND


def frame_index(t_ns: int) -> int:
    """Return the frame that is due last at a time on the show's own clock."""
    return t_ns * FRAMES_A_SECOND // 1_000_000_000


class Show:
    """What is over the table at each frame; it follows from scenario, seed and the frame's number."""

    def __init__(self, name: str, seed: int, empty_frames: int) -> None:
        """``empty_frames``: how many frames show the empty table before the first hand. UsageError: unknown name."""
        self._script = scenario(name, seed)
        self._empty_frames = empty_frames
        self.loop_frames = frame_index(self._script.end_ns) + 1 + _GAP_FRAMES

    def moment(self, index: int) -> Moment:
        """Return the hands of a frame, numbered from 0, and the truth about their fingertips."""
        played = index - self._empty_frames
        if played < 0:
            return _EMPTY
        in_act = played % (_LOOPS_TO_REST * self.loop_frames + _REST_FRAMES)
        if in_act >= _LOOPS_TO_REST * self.loop_frames:
            return _EMPTY
        return self._script.at(frame_time_ns(in_act % self.loop_frames))
