"""Models whose state holds the inputs already decided: how acados is told of delay and moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from rumo.problem import Problem
from rumo.signals import Array


@dataclass(frozen=True)
class Augmented:
    """The model with `memory` decided inputs, in units of their ranges, appended to its state.

    `residual` of x, xdot and u is the implicit differential equation; `step`, with its `jacobian` by (u, x), is one
    Newton step of implicit Euler from the `guess` of the model's next state.
    """

    x: Any
    xdot: Any
    u: Any
    guess: Any
    residual: Any
    step: Any
    jacobian: Any
    outputs: Any
    rows: list[Any]
    memory: int


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
    ux = ca.vertcat(u, x)
    defect = guess - x[:nx] - dt * model.f(guess, held(inputs), p)
    inverse = _inverse(ca.jacobian(defect, guess))
    step = ca.vertcat(guess - inverse @ defect, inputs[nu:])
    jacobian = ca.vertcat(-inverse @ ca.jacobian(defect, ux), ca.jacobian(inputs[nu:], ux))

    previous = scale * x[nx : nx + nu] if past else ca.DM.zeros(nu)
    values = ca.Function("values", [model.x, model.u, model.p], [expressions])(x[:nx], previous, p)
    ny = len(problem.output_rows)
    rows = ca.vertsplit(values)[ny:]
    return Augmented(x, xdot, u, guess, residual, step, jacobian, values[:ny], rows, memory)


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
