"""Implicit Euler, the paper's scheme."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from rumo.model import Model


@dataclass(frozen=True)
class ImplicitEuler:
    """`z = x + f(z, u, p) dt`: first order, A-stable and L-stable.

    Source: the paper's equation (discrete-vector-field-detail); Hairer and Wanner (1996), ch. IV.3.
    """

    order: ClassVar[int] = 1

    def residual(self, model: Model, z: Any, x: Any, u: Any, p: Any, step: float) -> Any:
        """Phi = F(z, x, u) - z with `F = x + f(z, u, p) dt`."""
        return x + step * model.f(z, u, p) - z
