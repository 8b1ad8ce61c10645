"""A second look at what seems bad: with all digits that there are, and knowing which are lacking."""

from __future__ import annotations

import numpy as np

from soak.solutions import Solutions
from soak.stacked import solve_closely

NEIGHBOURS = 8
"""Guesses of other last digits, where derivatives are evaluated too."""


class ClosestSolutions(Solutions):
    """With all digits of what intervals do to states that hardly move, but those that derivatives have lost."""

    solve_intervals = staticmethod(solve_closely)

    def _linearise(self) -> None:
        super()._linearise()
        rng = np.random.default_rng(0)
        for _ in range(NEIGHBOURS):
            guess = (a * (1.0 + 1e-15 * rng.standard_normal(a.shape)) for a in (self.w_g, self.x_g[:, :-1], self.u_g))
            _, A, B, _ = self._linearised(*guess)
            apart = np.abs(A - self.A), np.abs(B - self.B)
            self.blurred = [np.fmax(most, now) for most, now in zip(self.blurred, apart, strict=True)]
