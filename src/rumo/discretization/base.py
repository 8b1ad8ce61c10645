"""What every discretisation scheme offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from rumo.checks import whole_number
from rumo.model import Model


@dataclass(frozen=True)
class Discretization(ABC):
    """A one-step scheme written as a residual: the state at the end of a step makes it zero.

    Unknown are the state at the end, the algebraic variables there, and what the scheme has inside a step. The
    real-time iteration keeps all of them from sample to sample and improves them by one Newton step (Albersmeyer and
    Diehl, 2010).

    Parameters
    ----------
    substeps : int
        Equal steps in each interval of the horizon.

    Attributes
    ----------
    order : int
        Of the global error.
    a_stable, l_stable : bool
        Whether every decaying mode decays at any step length; whether the fastest vanish within one step.
    explicit : bool
        Whether the end follows from the beginning without solving for it.
    """

    substeps: int = 1
    order: ClassVar[int]
    a_stable: ClassVar[bool]
    l_stable: ClassVar[bool]
    explicit: ClassVar[bool] = False

    def __post_init__(self) -> None:
        whole_number(self.substeps, "substeps", 1)

    def inner(self, states: int, algebraic: int) -> Sequence[tuple[int, float]]:
        """What each inner unknown is a value of: the signal's position in (x, z), and the share of the step.

        A scheme has none unless it says so.
        """
        return ()

    @abstractmethod
    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """Residual, as many rows as there are unknowns: row i belongs to unknown i of (end, inner).

        Parameters
        ----------
        model : Model
            Gives `model.f(xz, u, p)` and, for algebraic variables, `model.g(xz, u, p)`.
        end : casadi expression, shape (nx + nz,)
            State and algebraic variables at the end of the step.
        inner : casadi expression
            As many as `inner()` tells.
        x : casadi expression, shape (nx,)
            State at the beginning of the step.
        u, p : casadi expression, shapes (nu,), (np_,)
            Input held over the step, parameters.
        step : casadi expression or float
            Its length [s].
        """
