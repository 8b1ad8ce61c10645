"""What an integrator is told, and what it does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from rumo.model import Model
from rumo.signals import Array


@dataclass(frozen=True, eq=False)
class Integrated:
    """What is integrated, and how exactly.

    Attributes
    ----------
    model : Model
        The system.
    sampling_time : float
        Over which inputs are held, if nothing else is said [s].
    tolerance : float
        Relative, and absolute in units of the scales, see `Plant`.
    scales : ndarray, shape (nx + nz,)
        Sizes below which variables do not matter.
    """

    model: Model
    sampling_time: float
    tolerance: float
    scales: Array


class Integration(Protocol):
    """From one state to another. It remembers where the algebraic variables were."""

    def reset(self) -> None:
        """Forget all that was integrated before."""
        ...

    def advance(self, x: Array, u: Array, p: Array, duration: float) -> Array:
        """State (nx,) a duration [s] after x (nx,), inputs u (nu,) and parameters p (np_,) held.

        Raises
        ------
        PlantError
            If the integration fails or ends in a state that is not finite.
        """
        ...

    @property
    def algebraic(self) -> Array:
        """Algebraic variables (nz,) where it ended; they are looked for near these next."""
        ...

    def seek(self, z: Array) -> None:
        """Look for the algebraic variables near z (nz,) next."""
        ...

    def another(self) -> Integration:
        """The same, with a memory of its own, reset."""
        ...
