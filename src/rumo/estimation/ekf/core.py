"""A step of the filter in the C core."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from rumo.controllers.engines.described import core_problem
from rumo.estimation.ekf.augmented import AugmentedModel
from rumo.estimation.ekf.engine import FilterNumbers
from rumo.kernel import Filter
from rumo.recording import missing_operation
from rumo.signals import Array


def can_compute(model: AugmentedModel) -> str:
    """Why the core cannot compute a filter's steps; nothing if it can."""
    operation = missing_operation(model.transcription.problem)
    if operation:
        return f"the core lacks {operation}"
    return "a measurement depends on algebraic variables" if model.sees_algebraic else ""


class CoreFilter:
    """See `FilterEngine`; the factors are U above the diagonal and D on it, with P = U D U'."""

    backend = "portable"

    def __init__(self, model: AugmentedModel, numbers: FilterNumbers) -> None:
        self._description = _described(model)
        self._n, self._m = model.size, len(numbers.noise)
        self.retune(numbers)

    def retune(self, numbers: FilterNumbers) -> None:
        """See `FilterEngine.retune`."""
        told = {
            "noise": numbers.noise,
            "process": numbers.process,
            "floor": numbers.floor,
            "turns": numbers.turn,
            "width": np.array([numbers.width]),
            "patience": numbers.patience,
        }
        self._filter = Filter(self._description, told)

    def start(self, x: Array, variances: Array) -> Array:
        """See `FilterEngine.start`."""
        return np.concatenate([x, np.diag(variances).ravel(), np.zeros(self._m)])

    def covariance(self, belief: Array) -> Array:
        """See `FilterEngine.covariance`."""
        P = np.empty((self._n, self._n))
        self._filter.covariance(belief, P)
        return P

    def advance(self, belief: Array, applied: Array, parameters: Array, measured: Array) -> tuple[Array, Array]:
        """See `FilterEngine.advance`."""
        after, report = np.empty(len(belief)), np.empty(3 * self._m + 2)
        if not self._filter.advance(belief, applied, parameters, measured, after, report):
            raise np.linalg.LinAlgError("the filter left the finite numbers")
        return after, report

    def linearise(self, x: Array, applied: Array, parameters: Array) -> tuple[Array, Array, Array, Array]:
        """See `FilterEngine.linearise`."""
        n, m = self._n, self._m
        after, A, y, H = x.copy(), np.empty((n, n)), np.empty(m), np.empty((m, n))
        if not self._filter.linearise(after, applied, parameters, A, y, H):
            raise np.linalg.LinAlgError("the model has no finite value")
        return after, A, y, H


@lru_cache(maxsize=8)
def _described(model: AugmentedModel) -> dict[str, Any]:
    """What the core is told of a model; its own maps of a step are wanted, however wide the model."""
    return core_problem(model.transcription, "riccati").values
