"""A problem as CasADi's solvers with a sense of stages want it: variables and rows stage by stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from rumo.bench.augmented import Augmented
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Transcription


@dataclass(frozen=True)
class Part:
    """Variables or rows (n,) with their limits (n,)."""

    values: Any
    lower: Array
    upper: Array

    def __len__(self) -> int:
        return len(self.lower)


def joined(parts: list[Part]) -> Part:
    """One below the other."""
    values = ca.vertcat(*(part.values for part in parts))
    return Part(values, np.hstack([part.lower for part in parts]), np.hstack([part.upper for part in parts]))


@dataclass(frozen=True)
class Stage:
    """What belongs to stage k: inputs with slack variables behind them, the next state, the gap before it, rows.

    The cost is the sum of `weights` times squared `residuals`, and of `price`, that of the slack variables.
    """

    inputs: Part
    following: Part
    gap: Part
    rows: Part
    residuals: Any
    weights: Array
    price: Any


@dataclass(frozen=True)
class Staged:
    """All stages, and what they depend on: the first state (nz,), guesses (nx, N) and references (ny, N).

    The first `decided` inputs of a stage are the problem's, slack variables follow.
    """

    stages: list[Stage]
    parameters: Any
    decided: int

    @property
    def variables(self) -> Part:
        """Of all stages, in their order."""
        return joined([part for stage in self.stages for part in (stage.inputs, stage.following)])

    @property
    def rows(self) -> Part:
        """Of all stages, in their order."""
        return joined([part for stage in self.stages for part in (stage.gap, stage.rows)])

    @property
    def statement(self) -> dict[str, Any]:
        """As CasADi's solvers take it."""
        cost = sum((ca.dot(ca.DM(s.weights), s.residuals**2) + s.price for s in self.stages), ca.SX(0))
        return {"x": self.variables.values, "p": self.parameters, "f": cost, "g": ca.densify(self.rows.values)}

    @property
    def sizes(self) -> dict[str, Any]:
        """For solvers that ask. The first state is no variable; an empty one, without inputs, ends the last stage."""
        return {
            "N": len(self.stages),
            "nx": [0, *(len(stage.following) for stage in self.stages)],
            "nu": [*(len(stage.inputs) for stage in self.stages), 0],
            "ng": [*(len(stage.rows) for stage in self.stages), 0],
        }

    def packed(self, x: Array, u: Array) -> Array:
        """All variables from states (N, nz) from the second on, and inputs (N, nu); slack variables are zero."""
        parts: list[Array] = []
        for k, stage in enumerate(self.stages[:-1]):
            parts += [u[k], np.zeros(len(stage.inputs) - self.decided), x[k]]
        return np.hstack([*parts, np.zeros(len(self.stages[-1].inputs))])

    def unpacked(self, variables: Array) -> tuple[Array, Array]:
        """States (N, nz) from the second on, and inputs (N, nu)."""
        states, inputs, position = list[Array](), list[Array](), 0
        for stage in self.stages[:-1]:
            inputs.append(variables[position : position + self.decided])
            position += len(stage.inputs)
            states.append(variables[position : position + len(stage.following)])
            position += len(stage.following)
        return np.array(states), np.array(inputs)


def staged(problem: Problem, augmented: Augmented, *, eliminated: bool) -> Staged:
    """A problem in stages; states hold the inputs already decided, and stage k decides u_{k+d}.

    The gap between two states is what a Newton step from the guess, `eliminated` by hand, gives less the next state; or
    the sparse equations of implicit Euler as they are.
    """
    N, nu = problem.horizon, len(problem.model.inputs)
    nx, nz = len(problem.model.states), augmented.x.numel()
    x, u, guess, end = augmented.x, augmented.u, augmented.guess, ca.SX.sym("end", nz)
    if eliminated:
        gaps = augmented.step - end
    else:
        gaps = ca.substitute(ca.vertcat(augmented.defect, augmented.decided - end[nx:]), guess, end[:nx])
    gap_of = ca.Function("gap", [x, u, guess, end], [gaps])
    seen = ca.Function("seen", [augmented.x], [augmented.outputs, ca.vertcat(ca.SX(0, 1), *augmented.rows)])
    imposed, scales = Transcription(problem).imposed, problem.input_scales
    moved = np.flatnonzero(np.isfinite(problem.move_lower) | np.isfinite(problem.move_upper))
    first, guesses = ca.SX.sym("x0", nz), ca.SX.sym("guess", nx, N)
    reference = ca.SX.sym("r", len(problem.outputs), N)

    def stage(k: int, x: Any) -> Stage:
        empty = following = gap = Part(ca.SX(0, 1), np.zeros(0), np.zeros(0))
        inputs, rows, residuals, weights, price = [empty], [empty], list[Any](), list[Array](), ca.SX(0)
        if k < N:
            interval = min(k + problem.delay, N - 1)  # beyond the horizon, the last
            u = ca.SX.sym(f"u{k}", nu)
            bounds = problem.numbers.input_lower[interval], problem.numbers.input_upper[interval]
            inputs.append(Part(u, *(bound / scales for bound in bounds)))
            move = u - x[nz - nu :]
            if moved.size:
                limits = problem.move_lower[moved], problem.move_upper[moved]
                rows.append(Part(move[moved.tolist()], *(limit / scales[moved] for limit in limits)))
            residuals.append(move)
            weights.append(problem.move_weights[interval] * scales**2)
            following = Part(ca.SX.sym(f"x{k + 1}", nz), np.full(nz, -np.inf), np.full(nz, np.inf))
            gap = Part(gap_of(x, u, guesses[:, k], following.values), np.zeros(nz), np.zeros(nz))
        if k > 0:
            outputs, values = seen(x)
            residuals.append(outputs - reference[:, k - 1])
            weights.append(problem.output_weights[k - 1])
            for j in np.flatnonzero(imposed[k - 1]).tolist():
                slack, penalty = ca.SX(0), problem.constraints[j].penalty
                if penalty is not None:
                    slack = ca.SX.sym(f"s{k}_{j}")
                    inputs.append(Part(slack, np.zeros(1), np.full(1, np.inf)))
                    price += penalty.l1 * slack + penalty.l2 * slack**2
                rows.append(Part(values[j] - slack, np.full(1, -np.inf), np.zeros(1)))
        return Stage(joined(inputs), following, gap, joined(rows), ca.vertcat(*residuals), np.hstack(weights), price)

    stages: list[Stage] = []
    for k in range(N + 1):
        stages.append(stage(k, stages[-1].following.values if stages else first))
    return Staged(stages, ca.vertcat(first, ca.vec(guesses), ca.vec(reference)), nu)
