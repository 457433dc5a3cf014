"""Other ways to model the empty surface, as yardsticks beside the paper's histogram; all else is `method: shell`."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from touchd.lab.baselines.mean_sigma import mean_less_sigmas
from touchd.lab.baselines.plane import plane_through
from touchd.lab.baselines.snapshot import single_snapshot
from touchd.model import Frame, Surface

Baseline: TypeAlias = Callable[[Surface, Frame], Surface]

# Each is given the surface as calibration found it and the first frame, and returns the surface as it would see it.
BASELINES: Mapping[str, Baseline] = MappingProxyType(
    {"plane": plane_through, "mean-sigma": mean_less_sigmas, "snapshot": single_snapshot}
)

__all__ = ["BASELINES", "Baseline"]
