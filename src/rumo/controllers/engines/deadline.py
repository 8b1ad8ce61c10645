"""A clock for IPOPT: it asks after each iteration whether the time is over."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter

import casadi as ca
import numpy as np


class Deadline(ca.Callback):
    """Ends a solution at a time that may be another one for each: IPOPT's own `max_wall_time` is stated once for all.

    Parameters
    ----------
    sizes : mapping of str to int
        Of what CasADi hands over, by its names: x, f, g, lam_x, lam_g, lam_p.

    Attributes
    ----------
    end : float
        By `time.perf_counter` [s].
    """

    def __init__(self, sizes: Mapping[str, int]) -> None:
        super().__init__()
        self._sizes = sizes
        self.end = np.inf
        self.construct("deadline", {})

    def get_n_in(self) -> int:
        """As many as solvers return."""
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        """Whether to stop."""
        return 1

    def get_name_in(self, i: int) -> str:
        """As solvers name what they return."""
        return ca.nlpsol_out(i)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """All dense."""
        return ca.Sparsity.dense(self._sizes[ca.nlpsol_out(i)], 1)

    def eval(self, arg: object) -> list[float]:
        """1 to stop."""
        return [float(perf_counter() > self.end)]
