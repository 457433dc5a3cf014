"""How much memory this process holds, and giving back what it no longer needs."""

import ctypes
import os
from pathlib import Path

_M_ARENA_MAX = -8  # from glibc's malloc.h


def resident_bytes() -> int | None:
    """Return the memory that this process has in RAM, from Linux's /proc; None elsewhere."""
    try:
        pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")


def give_back() -> None:
    """Return freed memory to the system, where the C library can (glibc's malloc_trim).

    Learning a surface takes tens of MB for a moment, which malloc would keep for ever.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def share_one_heap() -> None:
    """Have all threads take memory from one heap, where the C library (glibc) would give each one its own.

    What is free at the end of another thread's heap is not given back by :func:`give_back`: up to 25 MB after learning
    a surface. Call it before the first thread starts.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_ARENA_MAX, 1)
