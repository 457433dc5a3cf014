"""An arm with its hand, as it is followed from picture to picture."""

from dataclasses import dataclass

from touchd.hands.claims import WayIn
from touchd.hands.limb import Limb
from touchd.hands.standing import Place


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm as it was last seen; ``key`` tells it from all others.

    ``labels``: the parts of the last picture that it is, or shares; empty if it is missed.

    ``longest``: how far it has reached in so far, in px. ``calm_at``: where its hand has been since ``calm_ns``; of one
    that nothing leads to, the middle of all of it.
    """

    key: int
    born_ns: int
    seen_ns: int
    limb: Limb
    labels: tuple[int, ...]
    way: WayIn
    longest: float
    calm_at: Place
    calm_ns: int
