"""How much memory this process holds, and giving back what it no longer needs."""

import ctypes
import os
from pathlib import Path


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
