"""Signals of a plant, computed from its state at each sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from rumo.interrupts import interruptible
from rumo.signals import Array


def fast(function: ca.Function) -> Callable[..., Array]:
    """A CasADi function of vectors, with one as its result, as a function of arrays (n,).

    Expressions are evaluated in buffers, see `Buffered`; what solves equations is called as ever.
    """
    if function.is_a("SXFunction") and function.sparsity_out(0).is_dense():
        return Buffered(function)

    def called(*arguments: Array) -> Array:
        with interruptible():  # solvers look for signals
            return function(*arguments).full().ravel()

    return called


class Buffered:
    """An expression of vectors, evaluated without the conversions of CasADi's own call.

    These take longer than most expressions do. Threads must not share one.

    Parameters
    ----------
    function : casadi.Function
        An expression, with one dense vector as its result.
    """

    def __init__(self, function: ca.Function) -> None:
        self._given = [np.zeros(function.size1_in(i)) for i in range(function.n_in())]
        self._result = np.zeros(function.size1_out(0))
        self._buffer: Any
        # CasADi keeps neither the buffer nor what it points to.
        self._buffer, self._evaluate = function.buffer()
        for i, own in enumerate(self._given):
            self._buffer.set_arg(i, own.data)
        self._buffer.set_res(0, self._result.data)

    def __call__(self, *arguments: Array) -> Array:
        """Its value (n,) at vectors, as many as the function has."""
        for own, values in zip(self._given, arguments, strict=True):
            own[:] = values
        self._evaluate()
        return self._result.copy()
