"""What rivals have in common: a guess that is shifted, and a solver of CasADi that starts from it."""

from __future__ import annotations

from typing import Any

import numpy as np

from rumo.bench.augmented import augment
from rumo.bench.rivals.staged import staged
from rumo.problem import Problem
from rumo.signals import Array

QUIET = dict.fromkeys(("print_time", "error_on_fail", "show_eval_warnings", "calc_lam_p"), False)
"""Options of CasADi's solvers."""


class Rival:
    """A problem in stages, solved sample by sample.

    Parameters
    ----------
    problem : Problem
        What to solve.
    eliminated : bool
        See `staged`.

    Attributes
    ----------
    applied : ndarray, shape (max(delay, 1), nu)
        Inputs already decided, oldest first, as in `rumo.Controller.applied`.
    """

    _solver: Any

    def __init__(self, problem: Problem, *, eliminated: bool) -> None:
        self.problem = problem
        self.applied: Array = np.zeros((max(problem.delay, 1), len(problem.model.inputs)))
        self._augmented = augment(problem)
        self._staged = staged(problem, self._augmented, eliminated=eliminated)
        variables, rows = self._staged.variables, self._staged.rows
        self._limits = {"lbx": variables.lower, "ubx": variables.upper, "lbg": rows.lower, "ubg": rows.upper}
        self.reset()

    def reset(self) -> None:
        """Forget everything; before the first sample the safe inputs were applied."""
        safe = self.problem.safe_input / self.problem.input_scales
        self._decided = np.tile(safe, (self._augmented.memory, 1))
        self._guess: Array | None = None
        self._multipliers: dict[str, Array] = {}

    def prepare(self) -> None:
        """Shift the guess by a sample."""
        if self._guess is None:
            return
        nx, nu = len(self.problem.model.states), self._decided.shape[1]
        x, u = self._staged.unpacked(self._guess)
        u = np.vstack([u[1:], u[-1]])
        x = np.vstack([x[1:], 2.0 * x[-1] - x[-2]])
        x[-1, nx:] = np.r_[x[-2, nx + nu :], u[-1]]
        self._guess = self._staged.packed(x, u)

    def feedback(self, x: Array, reference: Array) -> Array:
        """Command (nu,) for a state x (nx,) and a reference (N + 1, ny) of the problem's outputs, from now on."""
        scales, N = self.problem.input_scales, self.problem.horizon
        self._decided[-len(self.applied) :] = self.applied / scales
        first = np.r_[x, self._decided.ravel()]
        begin = self._guess
        if begin is None:
            begin = self._staged.packed(np.tile(first, (N, 1)), np.tile(self._decided[-1], (N, 1)))
        guess = self._staged.unpacked(begin)[0][:, : len(x)]
        given = np.r_[first, guess.ravel(), reference[1:].ravel()]
        result = self._solver(x0=begin, p=given, **self._limits, **self._multipliers)
        self._guess = solution = result["x"].full().ravel()
        self._multipliers = {f"{name}0": result[name].full().ravel() for name in ("lam_x", "lam_g")}
        command = self._staged.unpacked(solution)[1][0]
        self._decided = np.vstack([self._decided[1:], command])
        return command * scales
