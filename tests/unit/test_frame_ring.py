from itertools import pairwise

import numpy as np
import pytest
from touchd.model import Frame
from touchd.sources.frame_ring import SLOTS, FrameRing, ReaderGone, RingWriter
from touchd.sources.synthetic_child import Order, Pace, play_as_taken, play_live
from touchd.table.show import frame_time_ns

PERIOD_NS = 33_333_333


def test_no_more_frames_wait_than_there_are_slots() -> None:
    ring = FrameRing((8, 4))
    writer = RingWriter(ring.ends)
    index = 0
    while writer.room:
        writer.put(Frame(index, 10 * index, np.full((4, 8), index, np.uint16)))
        index += 1
    frames = [ring.frame(ticket) for ticket in ring.wait()]
    assert [(frame.index, frame.t_ns, int(frame.raw[3, 7])) for frame in frames] == [
        (i, 10 * i, i) for i in range(SLOTS)
    ]
    writer.listen(0.0)
    assert writer.room
    ring.handed_over()
    ring.close()


def test_a_writer_notices_when_the_reader_has_gone() -> None:
    ring = FrameRing((8, 4))
    writer = RingWriter(ring.ends)
    ring.close()
    with pytest.raises(ReaderGone):
        writer.listen(None)
    with pytest.raises(ReaderGone):
        writer.put(Frame(0, 0, np.zeros((4, 8), np.uint16)))
    ring.handed_over()


class VirtualTaker:
    """Takes frames on a clock of its own, which stands still unless someone waits or renders."""

    def __init__(self, render_ns: int, frames: int, busy_ns: range = range(0)) -> None:
        self.now_ns = 5_000_000
        self.taken: list[tuple[int, int]] = []  # index, and when
        self._render_ns = render_ns
        self._frames = frames
        self._busy_ns = busy_ns

    @property
    def room(self) -> bool:
        return self.now_ns not in self._busy_ns

    def listen(self, timeout_s: float | None) -> None:
        assert timeout_s is not None
        self.now_ns += round(timeout_s * 1e9)

    def render(self, index: int) -> Frame:
        self.now_ns += self._render_ns
        return Frame(index, frame_time_ns(index), np.zeros((1, 1), np.uint16))

    def put(self, frame: Frame) -> None:
        assert self.room
        if len(self.taken) == self._frames:
            raise ReaderGone
        self.taken.append((frame.index, self.now_ns - 5_000_000))


def played_live(taker: VirtualTaker) -> list[tuple[int, int]]:
    with pytest.raises(ReaderGone):
        play_live(taker.render, taker, lambda: taker.now_ns)
    return taker.taken


def test_live_frames_come_when_they_are_due() -> None:
    taken = played_live(VirtualTaker(render_ns=8_000_000, frames=100))
    assert taken == [(index, frame_time_ns(index) + 8_000_000) for index in range(100)]


def test_a_renderer_that_is_too_slow_leaves_frames_out_and_never_falls_behind() -> None:
    taken = played_live(VirtualTaker(render_ns=100_000_000, frames=50))
    assert {after[0] - before[0] for before, after in pairwise(taken)} == {3}
    assert all(at_ns - frame_time_ns(index) <= 100_000_000 + PERIOD_NS for index, at_ns in taken)


def test_a_taker_that_is_busy_for_a_while_misses_just_the_frames_of_that_while() -> None:
    busy = range(1_005_000_000, 2_005_000_000)
    taken = played_live(VirtualTaker(render_ns=0, frames=60, busy_ns=busy))
    assert [index for index, _ in taken] == [*range(30), *range(60, 90)]


def test_frames_as_taken_wait_for_room_and_none_is_left_out() -> None:
    class Patient(VirtualTaker):
        waited = 0

        @property
        def room(self) -> bool:
            return self.waited > 2 * len(self.taken)

        def listen(self, timeout_s: float | None) -> None:
            self.waited += timeout_s is None

    taker = Patient(render_ns=0, frames=20)
    with pytest.raises(ReaderGone):
        play_as_taken(taker.render, taker)
    assert [index for index, _ in taker.taken] == list(range(20))


def test_an_order_survives_the_command_line() -> None:
    ring = FrameRing((8, 4))
    order = Order("ten", 5, 72, Pace.LIVE, ring.ends)
    assert Order.from_argument(order.as_argument()) == order
    ring.handed_over()
    ring.close()
