"""Settings of the surface stage; ``config`` builds them from the YAML file."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CalibrationSettings:
    """How the empty surface is learned.

    ``frames``: how many depth frames go into the histogram. ``min_share``: a histogram bin counts once it holds
    more than this share of a pixel's readings (the paper's "small threshold"). ``give_up_s``: for how long a
    daemon waits for a scene without motion; a replay does not wait.
    """

    frames: int = 300
    min_share: float = 0.01
    give_up_s: float = 60.0


@dataclass(frozen=True, slots=True)
class ShellSettings:
    """The layer above the surface in which contacts are looked for.

    ``near_mm``, ``far_mm``: heights of its lower and upper boundary above the surface; None: found from the
    sensor's step and noise. ``delta_raw``: the paper's literal thickness in raw steps; replaces ``far_mm``.
    """

    near_mm: float | None = None
    far_mm: float | None = None
    delta_raw: int | None = None


@dataclass(frozen=True, slots=True)
class LivingSettings:
    """Whether the surface lives: ``follow`` its drift, notice that it was moved, and take in what lies on it."""

    follow: bool = True
