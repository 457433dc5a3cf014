"""Judging a fitted fingertip by its traits: does it touch, how high is it, and where exactly.

A small network of two hidden layers, learned from rendered hands by ``make judge`` (see ``touchd/lab/learn``). What
the fit alone cannot know is in it: how real fingers bend and broaden, how a sensor's outlines wobble, what curled
fingers, heels and things look like that a finger's model fits as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files

import numpy as np

from touchd.model import Floats

LEAK = np.float32(0.1)
# In what units a network answers.
CLEARANCE_MM, PLACE_MM = 10.0, 2.0


@dataclass(frozen=True, slots=True)
class Opinion:
    """What is said of a fingertip.

    ``odds``: the logarithm of its odds of touching, by this picture alone; ``finger_odds``: of being a fingertip at
    all, touching or not. ``clearance_mm``: the gap below it. ``along_mm``, ``across_mm``: how far from where it was
    fitted it touches, seen from the finger. ``impression`` (I,): what all this was said from.
    """

    odds: float
    finger_odds: float
    clearance_mm: float
    along_mm: float
    across_mm: float
    impression: Floats = field(compare=False)


Layer = tuple[Floats, Floats]  # weights (inputs, outputs), and what is added (outputs,)


class Judge:
    """Judges fingertips with a network's layers."""

    def __init__(self, layers: Sequence[Layer]) -> None:
        self._layers = layers

    def opinions(self, traits: Floats) -> list[Opinion]:
        """Return what is said of N fingertips by their traits (N, T)."""
        values = traits
        for weights, bias in self._layers[:-1]:
            values = values @ weights + bias
            values = np.maximum(values, LEAK * values)
        weights, bias = self._layers[-1]
        said: list[list[float]] = (values @ weights + bias).tolist()
        return [
            Opinion(odds, finger, CLEARANCE_MM * clearance, PLACE_MM * along, PLACE_MM * across, impression)
            for (odds, finger, clearance, along, across), impression in zip(said, values, strict=True)
        ]


def learned_judge() -> Judge:
    """Return the judge that comes with touchd."""
    return Judge(learned_layers())


def learned_layers() -> list[Layer]:
    """Return the layers of the judge that comes with touchd."""
    with files("touchd.contacts").joinpath("judge.npz").open("rb") as stored, np.load(stored) as arrays:
        count = len(arrays.files) // 2
        return [(arrays[f"weights{i}"].astype(np.float32), arrays[f"bias{i}"].astype(np.float32)) for i in range(count)]
