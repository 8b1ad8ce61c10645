"""Models whose state holds the inputs already decided: how others are told of delay and moves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from rumo.problem import Problem
from rumo.signals import Array


@dataclass(frozen=True)
class Augmented:
    """The model with `memory` decided inputs, in units of their ranges, appended to its state.

    Attributes
    ----------
    x, xdot, u, guess
        Symbols: the augmented state (nz,), its slope and the input decided; the model's next state (nx,).
    residual
        Of the implicit differential equation in x, xdot and u (nz,).
    defect
        What `guess` lacks of satisfying implicit Euler's equations (nx,).
    decided
        The inputs of the next augmented state (memory * nu,).
    outputs, rows
        What is tracked (ny,), and path constraints less their limits, of x.
    memory : int
        Number of inputs in the state.
    """

    x: Any
    xdot: Any
    u: Any
    guess: Any
    residual: Any
    defect: Any
    decided: Any
    outputs: Any
    rows: list[Any]
    memory: int

    @cached_property
    def _inverse(self) -> Any:
        return _inverse(ca.jacobian(self.defect, self.guess))

    @property
    def step(self) -> Any:
        """The next state (nz,): one Newton step of implicit Euler from the guess, eliminated by hand."""
        return ca.vertcat(self.guess - self._inverse @ self.defect, self.decided)

    @property
    def jacobian(self) -> Any:
        """The derivatives of `step` by (u, x) before the Newton step."""
        ux = ca.vertcat(self.u, self.x)
        return ca.vertcat(-self._inverse @ ca.jacobian(self.defect, ux), ca.jacobian(self.decided, ux))


def augment(problem: Problem) -> Augmented:
    """A problem's model, with as many inputs appended as have been decided."""
    model, d, dt = problem.model, problem.delay, problem.sampling_time
    nx, nu, p = len(model.states), len(model.inputs), ca.DM(problem.parameters[0])
    expressions = ca.vertcat(*problem.output_rows, *(item.expression - item.limits[0] for item in problem.constraints))
    # Outputs and constraints at stage i may depend on u_{i-1}, as moves without delay do.
    past = d == 0 or ca.depends_on(expressions, model.u)
    memory = d + 1 if past else d
    x, xdot = (ca.SX.sym(name, nx + memory * nu) for name in ("x", "xdot"))
    u, guess, scale = ca.SX.sym("u", nu), ca.SX.sym("guess", nx), ca.DM(problem.input_scales)

    def held(inputs: Any) -> Any:
        return scale * inputs[(memory - d) * nu :][:nu]

    # The inputs decided at the beginning of the step and the new one; at its end each has moved up.
    inputs = ca.vertcat(x[nx:] - dt * xdot[nx:], u)
    residual = ca.vertcat(xdot[:nx] - model.f(x[:nx], held(inputs), p), (x[nx:] - inputs[nu:]) / dt)
    inputs = ca.vertcat(x[nx:], u)
    defect = guess - x[:nx] - dt * model.f(guess, held(inputs), p)

    previous = scale * x[nx : nx + nu] if past else ca.DM.zeros(nu)
    values = ca.Function("values", [model.x, model.u, model.p], [expressions])(x[:nx], previous, p)
    ny = len(problem.output_rows)
    rows = ca.vertsplit(values)[ny:]
    return Augmented(x, xdot, u, guess, residual, defect, inputs[nu:], values[:ny], rows, memory)


def _inverse(matrix: Any) -> Any:
    """Symbolic Gauss-Jordan elimination, skipping structural zeros; no pivoting."""
    n = matrix.shape[0]
    rows = [ca.horzcat(matrix[i, :], ca.SX.eye(n)[i, :]) for i in range(n)]
    for k in range(n):
        rows[k] = ca.sparsify(rows[k] / rows[k][k])
        for i in range(n):
            if i != k and rows[i].sparsity().has_nz(0, k):
                rows[i] = ca.sparsify(rows[i] - rows[i][k] * rows[k])
    return ca.vertcat(*rows)[:, n:]


def constant(expression: Any) -> Array:
    """The numbers of a constant expression."""
    return np.array(ca.evalf(expression))
