"""Where a step linearises, or starts from, and what it comes to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.kernel import Trajectory as Parts
from rumo.signals import Array


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Inputs (N, nu), states (N + 1, nx) and the intervals' other unknowns (N, nw - nx) over a horizon.

    One that is `resting` is a mere beginning, such as a state that stays where it is: no plan stands behind it. It is
    `still` if nobody has thought of more than that state.
    """

    u: Array
    x: Array
    inner: Array
    resting: bool = False
    still: bool = False

    @property
    def parts(self) -> Parts:
        """Its arrays, for the guard."""
        return Parts(self.u, self.x, self.inner)

    @property
    def finite(self) -> bool:
        """Whether every number is finite."""
        return all(np.isfinite(array).all() for array in (self.u, self.x, self.inner))
