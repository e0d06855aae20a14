"""What rounding alone can do to a computation: the spread of results when every operation is disturbed a little.

Stochastic arithmetic (J. Vignes, A stochastic arithmetic for reliable scientific computation, Mathematics and Computers
in Simulation 35, 1993): the same formula is evaluated several times with each result off by some units in the last
place. Ill-conditioned points, and those at a kink, get the tolerance that they need, and no others do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clfractal.formulas.backends import NumpyBackend

_EXACT = frozenset(("neg", "abs", "sign", "min", "max", "clamp", "floor", "where", "not", "and", "or"))
_TRUTH = frozenset(("lt", "le", "gt", "ge", "eq", "ne"))
_EXPONENT_LAST = frozenset(("pow", "cpow_re", "cpow_im"))


class NoisyBackend:
    """NumPy with every result (and every constant that is no short fraction) off by up to `noise`, relatively."""

    def __init__(self, noise: float, seed: int) -> None:
        self.noise = noise
        self.random = np.random.default_rng(seed)
        self.plain = NumpyBackend()

    def call(self, function: str, arguments: list[Any]) -> Any:
        """The function's value, disturbed."""
        kept = len(arguments) - 1 if function in _EXPONENT_LAST else -1
        inputs = [
            self._disturbed(a) if type(a) is float and i != kept and np.float32(a) != a else a
            for i, a in enumerate(arguments)
        ]
        value = self.plain.call(function, inputs)
        return value if function in _EXACT | _TRUTH else self._disturbed(value)

    def _disturbed(self, value: Any) -> Any:
        return value * (1.0 + self.noise * self.random.uniform(-1.0, 1.0, np.shape(value)))


def spread(evaluate: Callable[[NoisyBackend], Any], noise: float, runs: int = 8) -> Any:
    """The largest difference between any two of some disturbed evaluations (infinite where one is no number)."""
    with np.errstate(all="ignore"):
        results = np.stack([np.asarray(evaluate(NoisyBackend(noise, seed))) for seed in range(runs)])
        width = results.max(axis=0) - results.min(axis=0)
    return np.where(np.isnan(width), np.inf, width)
