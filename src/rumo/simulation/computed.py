"""What a log says of a run beyond what was recorded: outputs, constraints, and the limits of each sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import casadi as ca
import numpy as np

from rumo.numbers import ProblemNumbers
from rumo.problem import Problem
from rumo.signals import Array


def outputs_and_constraints(problem: Problem) -> ca.Function:
    """`(x, u, p) -> y, G`: tracked outputs, and path constraints without their limits.

    NaN where they depend on algebraic variables.
    """
    model = problem.model
    expressions = [item.expression for item in problem.constraints]
    rows = [ca.vertcat(*problem.output_rows), ca.vertcat(ca.SX(0, 1), *expressions)]
    if len(model.algebraic):
        unknown = ca.SX(ca.DM.nan(len(model.algebraic)))
        rows = [ca.substitute(row, model.z, unknown) for row in rows]
    return ca.Function("now", [model.x, model.u, model.p], rows)


def completed(problem: Problem, columns: Mapping[str, Array], numbers: Sequence[ProblemNumbers]) -> dict[str, Array]:
    """Outputs and constraints along a run, from states and the inputs before them.

    Parameters
    ----------
    problem : Problem
        Of the controller.
    columns : mapping of str to ndarray
        What was recorded, by the names of a log.
    numbers : sequence of ProblemNumbers
        Of each sample.
    """
    evaluate = outputs_and_constraints(problem)
    parameters = columns["parameters"][:, 0].T
    estimated, _ = evaluate(columns["estimated"].T, _before(columns["applied"]), parameters)
    done = columns.get("actuated", columns["applied"])
    computed, constraints = evaluate(columns["true_states"].T, _before(done), parameters)
    true = columns["true_outputs"]
    return {
        "estimated_outputs": estimated.full().T,
        "true_constraints": constraints.full().T - of_each(numbers, lambda now: now.limits[0]),
        "true_outputs": np.where(np.isnan(true), computed.full().T, true),
    }


def _before(inputs: Array) -> Array:
    """Inputs of the sample before each (nu, K)."""
    return np.vstack([np.full((1, inputs.shape[1]), np.nan), inputs[:-1]]).T


def limits_at(problem: Problem, numbers: Sequence[ProblemNumbers]) -> dict[str, tuple[Array, Array]]:
    """Lower and upper bounds with the numbers of each sample: of the input that is computed, and of the states next.

    Arrays (K, nu) and (K, nx) under "input" and "state", infinite where there is no bound.
    """
    model, K = problem.model, len(numbers)
    shape = K, len(model.inputs)
    lower, upper = np.full((K, len(model.states)), -np.inf), np.full((K, len(model.states)), np.inf)
    limits = of_each(numbers, lambda now: now.limits[0]).reshape(K, len(problem.constraints))
    for item, limit in zip(problem.constraints, limits.T, strict=True):
        for i in range(len(model.states)):
            if ca.is_equal(item.expression, model.x[i]):
                upper[:, i] = np.minimum(upper[:, i], limit)
            elif ca.is_equal(item.expression, -model.x[i], 1):
                lower[:, i] = np.maximum(lower[:, i], -limit)
    least = of_each(numbers, lambda now: now.input_lower[problem.delay]).reshape(shape)
    most = of_each(numbers, lambda now: now.input_upper[problem.delay]).reshape(shape)
    return {"input": (least, most), "state": (lower, upper)}


def of_each(numbers: Sequence[ProblemNumbers], value: Callable[[ProblemNumbers], Array]) -> Array:
    """A value (K, n) of the numbers of each sample, most of which are those of the sample before."""
    values = {key: value(now) for key, now in {id(now): now for now in numbers}.items()}
    return np.array([values[id(now)] for now in numbers])
