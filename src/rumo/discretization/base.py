"""What every discretisation scheme offers."""

from __future__ import annotations

from typing import Any, Protocol

from rumo.model import Model


class Discretization(Protocol):
    """A one-step scheme written as a residual: the next state z solves `phi(z, x, u, p) = 0`."""

    @property
    def order(self) -> int:
        """Order of the global error."""
        ...

    def residual(self, model: Model, z: Any, x: Any, u: Any, p: Any, step: float) -> Any:
        """Residual phi, shape (nx,), in the units of the state.

        Parameters
        ----------
        model : Model
            Gives the right-hand side `model.f(x, u, p)`.
        z, x : casadi expression, shape (nx,)
            Next and present state.
        u, p : casadi expression, shapes (nu,), (np_,)
            Input held over the step, parameters.
        step : float
            Step length [s].
        """
        ...
