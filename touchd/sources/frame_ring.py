"""Frames handed from a child process to its parent through a few slots of shared memory.

The memory has no name, and two pipes tell which slots are filled and which are free again. So nothing is left behind
however the processes end, and each sees the other's end at once: as the end of its pipe.
"""

import mmap
import os
import select
import struct
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchd.model import Frame, frozen_array

SLOTS = 4
_TICKET = struct.Struct("=qqq")


class ReaderGone(Exception):
    """Nobody takes frames any more: the parent closed the ring or has ended."""


@dataclass(frozen=True, slots=True)
class RingEnds:
    """What the child needs to fill the ring: file descriptors to inherit, and the pictures' size in px."""

    memory: int
    filled: int
    freed: int
    width: int
    height: int

    @property
    def descriptors(self) -> tuple[int, int, int]:
        """The file descriptors."""
        return self.memory, self.filled, self.freed


@dataclass(frozen=True, slots=True)
class Ticket:
    """A filled slot and what it holds."""

    slot: int
    index: int
    t_ns: int


class FrameRing:
    """The parent's end: makes the ring, takes frames. Close it, in the end, from the thread that waits."""

    def __init__(self, size: tuple[int, int]) -> None:
        """``size``: the pictures' width and height. Raises OSError where the system has no room."""
        width, height = size
        memory = os.memfd_create("touchd-frames")
        os.ftruncate(memory, SLOTS * width * height * 2)
        self._filled, filled = os.pipe()
        freed, self._freed = os.pipe()
        self.ends = RingEnds(memory, filled, freed, width, height)
        self._memory = _mapped(self.ends, mmap.PROT_READ)
        self._pictures = _pictures(self.ends, self._memory)

    def handed_over(self) -> None:
        """Let go of the child's ends once the child has them, so that its end can be seen."""
        for descriptor in self.ends.descriptors:
            os.close(descriptor)

    def wait(self) -> list[Ticket]:
        """Return the filled slots, oldest first, waiting for one; none if the child has ended."""
        data = os.read(self._filled, SLOTS * _TICKET.size)
        return [Ticket(*fields) for fields in _TICKET.iter_unpack(data)]

    def frame(self, ticket: Ticket) -> Frame:
        """Return a filled slot's frame, and free the slot."""
        raw = frozen_array(self._pictures[ticket.slot].copy())
        self.free(ticket)
        return Frame(ticket.index, ticket.t_ns, raw)

    def free(self, ticket: Ticket) -> None:
        """Let the child fill a slot anew."""
        with suppress(BrokenPipeError):  # the child has ended, which the next wait tells
            os.write(self._freed, bytes([ticket.slot]))

    def close(self) -> None:
        """Let go of the ring; a child that is still there finds nobody to take its frames."""
        del self._pictures
        self._memory.close()
        os.close(self._filled)
        os.close(self._freed)


class RingWriter:
    """The child's end."""

    def __init__(self, ends: RingEnds) -> None:
        self._ends = ends
        self._pictures = _pictures(ends, _mapped(ends, mmap.PROT_READ | mmap.PROT_WRITE))
        self._free = list(range(SLOTS))

    @property
    def room(self) -> bool:
        """Whether a slot is free, as far as the parent was heard."""
        return bool(self._free)

    def listen(self, timeout_s: float | None) -> None:
        """Hear from the parent which slots are free, waiting so long at most (None: for ever). Raises ReaderGone."""
        if not select.select([self._ends.freed], [], [], timeout_s)[0]:
            return
        slots = os.read(self._ends.freed, SLOTS)
        if not slots:
            raise ReaderGone
        self._free.extend(slots)

    def put(self, frame: Frame) -> None:
        """Hand a frame over; there must be room. Raises ReaderGone."""
        slot = self._free.pop(0)
        self._pictures[slot] = frame.raw
        try:
            os.write(self._ends.filled, _TICKET.pack(slot, frame.index, frame.t_ns))
        except BrokenPipeError as error:
            raise ReaderGone from error


def _mapped(ends: RingEnds, protection: int) -> mmap.mmap:
    return mmap.mmap(ends.memory, SLOTS * ends.width * ends.height * 2, prot=protection)


def _pictures(ends: RingEnds, memory: mmap.mmap) -> NDArray[np.uint16]:
    """Return the slots (SLOTS, H, W); the memory is kept for as long as the array."""
    return np.frombuffer(memory, np.uint16).reshape(SLOTS, ends.height, ends.width)
