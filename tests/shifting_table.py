"""How a Kinect may read a table differently, as it warms up or is knocked: added before readings are rounded."""

import numpy as np
from touchd.model import Floats
from touchd.table.misreading import Misreading

SHAPE = (480, 640)


def off_by(raw: Floats | float) -> Misreading:
    """Return readings that are farther by so many raw steps, a number or (H, W)."""
    return Misreading(off=np.broadcast_to(np.asarray(raw, np.float32), SHAPE))


def gradient(raw: float) -> Floats:
    """Return a shift that grows by so many raw steps from left to right, and is 0 in the middle."""
    across = np.linspace(-0.5 * raw, 0.5 * raw, SHAPE[1], dtype=np.float32)
    return np.broadcast_to(across, SHAPE)


def uneven(raw: float) -> Floats:
    """Return a drift of so many raw steps, which is a third more in one corner than in the opposite one."""
    y, x = np.mgrid[-1.0 : 1.0 : SHAPE[0] * 1j, -1.0 : 1.0 : SHAPE[1] * 1j]
    drift: Floats = (raw * (1.0 + 0.1 * x + 0.06 * y + 0.05 * x * x)).astype(np.float32)
    return drift
