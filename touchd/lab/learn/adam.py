"""Stochastic gradient descent."""

import numpy as np

from touchd.model import Floats

_BETAS = (0.9, 0.999)


class Adam:
    """D. P. Kingma, J. Ba, "Adam: A Method for Stochastic Optimization", ICLR 2015, with decoupled weight decay."""

    def __init__(self, parameters: list[Floats], decay: float) -> None:
        self._parameters = parameters
        self._decay = decay
        self._first = [np.zeros_like(p) for p in parameters]
        self._second = [np.zeros_like(p) for p in parameters]
        self._steps = 0

    def step(self, gradients: list[Floats], rate: float, decayed: int) -> None:
        """Move all parameters against their gradients; the first ``decayed`` of them also shrink."""
        self._steps += 1
        unbiased = [1.0 - beta**self._steps for beta in _BETAS]
        for i, gradient in enumerate(gradients):
            self._first[i] += (1.0 - _BETAS[0]) * (gradient - self._first[i])
            self._second[i] += (1.0 - _BETAS[1]) * (gradient * gradient - self._second[i])
            way = self._first[i] / unbiased[0] / (np.sqrt(self._second[i] / unbiased[1]) + 1e-8)
            if i < decayed:
                way += self._decay * self._parameters[i]
            self._parameters[i] -= rate * way
