"""Settings of the contact stage; ``config`` builds them from the YAML file."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BlobSettings:
    """How the shell's pixels become contacts.

    ``boxcar_px``: side of the low-pass window (odd). ``threshold``: share of that window that must lie in the shell
    for a new touch; ``keep_threshold``: the same for a touch that exists already (hysteresis). ``min_area_mm2`` and
    ``max_area_mm2``: contacts outside these limits are no fingers.
    """

    boxcar_px: int = 9
    threshold: float = 0.5
    keep_threshold: float = 0.4
    min_area_mm2: float = 20.0
    max_area_mm2: float = 1500.0
