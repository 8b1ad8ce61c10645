"""From a problem and a scheme to stage functions and their exact derivatives: the only place that differentiates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from rumo.checks import checked
from rumo.discretization import Discretization, ImplicitEuler
from rumo.errors import ArgumentError
from rumo.influence import influenced
from rumo.problem import Problem
from rumo.signals import Array

NEWTON_ITERATIONS = 30
NEWTON_TOLERANCE = 1e-12
VECTORS = ("y", "G", "defect")


@dataclass(frozen=True)
class Stages:
    """The horizon linearised about a guess; index k stands for stage i = k + 1, the step from x_k to x_{k+1}.

    The nw unknowns w_i of an interval are the state x_i, the algebraic variables z_i, and what the scheme has inside;
    `phi(w_i, x_{i-1}, u_{i-1}) = 0` are its equations.

    Attributes
    ----------
    defect : ndarray, shape (N, nw)
        phi, what the guess lacks of satisfying the discrete dynamics.
    A0, M, B : ndarray, shapes (N, nw, nx), (N, nw, nw), (N, nw, nu)
        Derivatives of phi by x_{i-1}, by w_i with the sign changed, and by u_{i-1}.
    y, Cx, Cu : ndarray, shapes (N, ny), (N, ny, nx + nz), (N, ny, nu)
        Tracked outputs at (x_i, z_i, u_{i-1}) and their derivatives.
    G, D, E : ndarray, shapes (N, nc), (N, nc, nx + nz), (N, nc, nu)
        Path constraints G(x_i, z_i, u_{i-1}) less their limits, and their derivatives.
    """

    defect: Array
    A0: Array
    M: Array
    B: Array
    y: Array
    Cx: Array
    Cu: Array
    G: Array
    D: Array
    E: Array

    @property
    def finite(self) -> bool:
        """Whether every number is finite."""
        return all(np.isfinite(array).all() for array in vars(self).values())


class Transcription:
    """Stage functions of a problem under a discretisation scheme; both RTI and NLP are built on it.

    Parameters
    ----------
    problem : Problem
        What is to be solved.
    discretization : Discretization, optional
        The problem's if not given; implicit Euler if it has none.

    Attributes
    ----------
    interval : casadi.Function
        `(w, x, u, p) -> phi`, the equations of an interval, shapes (nw,), (nx,), (nu,), (np_,), (nw,).
    outputs, constraints : casadi.Function
        `(xz, u, p) -> y` (ny,) and `(xz, u, p) -> G` (nc,); xz are states and algebraic variables.
    terms, arguments : dict and list of casadi expression
        All terms of a linearised substep by the names of `Stages`, and the symbols that they are expressions of: state
        at the end, x, u, p, other unknowns.
    inner_signals, inner_nodes : ndarray, shape (nw - nx,)
        What each unknown but the state at the end is a value of, as a position in xz, and at which share of the
        interval.
    imposed : ndarray of bool, shape (N, nc)
        Whether some free input can influence a constraint at a stage, by the structure of the derivatives;
        where none can, the constraint is reported but not imposed.

    Raises
    ------
    ArgumentError
        If an explicit scheme is to solve algebraic equations.
    """

    def __init__(self, problem: Problem, discretization: Discretization | None = None) -> None:
        self.problem = checked(problem, "problem", Problem)
        scheme = self.discretization = checked(
            discretization or problem.discretization or ImplicitEuler(),
            "discretization",
            Discretization,
            "Write rumo.ImplicitEuler().",
        )
        model = problem.model
        nx, nz = len(model.states), len(model.algebraic)
        if scheme.explicit and nz:
            raise ArgumentError(
                "discretization",
                f"{type(scheme).__name__}, which is explicit",
                "an implicit scheme for a model with algebraic variables",
                "Write rumo.ImplicitEuler().",
            )
        inner = list(scheme.inner(nx, nz))
        end, e = ca.SX.sym("end", nx + nz), ca.SX.sym("e", len(inner))
        w, x, u, p = ca.vertcat(end, e), model.x, model.u, model.p
        # On a non-uniform grid, the length of a step is one more parameter.
        length = problem.sampling_time if problem.uniform else ca.SX.sym("length")
        given = p if problem.uniform else ca.vertcat(p, length)
        phi = scheme.residual(model, end, e, x, u, p, length / scheme.substeps)
        y = ca.vertcat(*problem.output_rows)
        G = ca.vertcat(ca.SX(0, 1), *(constraint.expression for constraint in problem.constraints))
        self.outputs = ca.Function("outputs", [model.xz, u, given], [y], ["x", "u", "p"], ["y"])
        self.constraints = ca.Function("constraints", [model.xz, u, given], [G], ["x", "u", "p"], ["G"])
        self._substep = ca.Function("substep", [w, x, u, given], [phi])
        self.interval = self._interval()
        self.inner_signals, self.inner_nodes = self._inner(inner)

        self.terms = self._linearised(phi, w, x, u, given)
        self.arguments = [end[:nx], x, u, given, ca.vertcat(end[nx:, 0], e)]
        self.imposed = influenced(self.terms, problem.horizon, problem.delay, scheme.substeps)
        self._path = self.constraints.map(problem.horizon)

    @cached_property
    def _of_interval(self) -> tuple[list[Any], dict[str, Any]]:
        """Symbols and all terms of an interval; the C core, which puts substeps together itself, does without."""
        symbol: Any = ca.MX if self.interval.is_a("MXFunction") else ca.SX
        arguments = [symbol.sym(name, self.interval.size1_in(i)) for i, name in enumerate(("w", "x", "u", "p"))]
        return arguments, self._linearised(self.interval(*arguments), *arguments)

    @cached_property
    def _stages(self) -> Any:
        """All terms of all stages, packed."""
        arguments, terms = self._of_interval
        packed = ca.densify(ca.vertcat(*(ca.vec(ca.densify(term)) for term in terms.values())))
        return ca.Function("stage", arguments, [packed]).map(self.problem.horizon)

    @cached_property
    def _newton(self) -> Any:
        """phi, A0, M and B of an interval."""
        arguments, terms = self._of_interval
        return ca.Function("newton", arguments, [terms[name] for name in ("defect", "A0", "M", "B")])

    @property
    def unknowns(self) -> int:
        """Number nw of unknowns in an interval."""
        return self.interval.size1_in(0)

    def renumbered(self, problem: Problem) -> Transcription:
        """The same stage functions for a problem that differs in numbers alone, see `Problem.changed`."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), problem=problem)
        return other

    def given(self, parameters: Array) -> Array:
        """What stage functions take for p: a model's parameters (N, np_) and, on a non-uniform grid, lengths (N, 1)."""
        return parameters if self.problem.uniform else np.column_stack([parameters, self.problem.steps])

    def linearize(self, x: Array, u: Array, inner: Array, parameters: Array) -> Stages:
        """Linearise all stages about a guess.

        Parameters
        ----------
        x : ndarray, shape (N + 1, nx)
            Guess x_g of the states.
        u : ndarray, shape (N, nu)
            Guess u_g of the inputs.
        inner : ndarray, shape (N, nw - nx)
            Guess of the intervals' other unknowns.
        parameters : ndarray, shape (N, np_)
            Of the model, on each interval.
        """
        unknowns = np.hstack([x[1:], inner])
        packed = self._stages(unknowns.T, x[:-1].T, u.T, self.given(parameters).T).full().T
        arrays: dict[str, Array] = {}
        start = 0
        for name, term in self._of_interval[1].items():
            shape = term.shape[:1] if name in VECTORS else term.shape
            size = int(np.prod(shape))
            block = packed[:, start : start + size]
            # CasADi stores matrices by columns.
            arrays[name] = block.reshape(len(packed), *shape[::-1]).transpose(0, *range(len(shape), 0, -1))
            start += size
        arrays["G"] = arrays["G"] - self.problem.numbers.limits
        return Stages(**arrays)

    def inner_between(self, begin: Array, end: Array) -> Array:
        """A guess (n, nw - nx) of the other unknowns of intervals from states (n, nx) to states (n, nx)."""
        nx = begin.shape[-1]
        states = self.inner_signals < nx
        guess = np.empty((*begin.shape[:-1], len(self.inner_signals)))
        signals, share = self.inner_signals[states], self.inner_nodes[states]
        guess[..., states] = (1.0 - share) * begin[..., signals] + share * end[..., signals]
        guess[..., ~states] = self.problem.model.algebraic_guess[self.inner_signals[~states] - nx]
        return guess

    def path_constraints(self, x: Array, u: Array, inner: Array, parameters: Array) -> Array:
        """Path constraints less their limits (N, nc) along states (N + 1, nx), inputs (N, nu) and other unknowns."""
        algebraic = inner[:, : len(self.problem.model.algebraic)]
        values = self._path(np.hstack([x[1:], algebraic]).T, u.T, self.given(parameters).T).full().T
        return values - self.problem.numbers.limits

    def advance(self, x: Array, u: Array, p: Array | None = None) -> tuple[Array, Array]:
        """The unknowns w (nw,) of an interval that begins at x (nx,) with input u (nu,), and their derivatives by x.

        By Newton's method from a guess at rest; p is a row of `given()`, the first interval's if left out.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the linearised equations are singular or give no finite numbers, or Newton's method does not converge.
        """
        w, sensitivity = np.r_[x, self.inner_between(x, x)], np.zeros((self.unknowns, len(x)))
        given = self.given(self.problem.parameters)[0] if p is None else p
        for _ in range(NEWTON_ITERATIONS):
            phi, A0, M, _ = (value.full() for value in self._newton(w, x, u, given))
            solved = np.linalg.solve(M, np.hstack([A0, phi]))
            sensitivity, correction = solved[:, :-1], solved[:, -1]
            w = w + correction
            if not np.isfinite(w).all():
                raise np.linalg.LinAlgError("Newton's method left the finite numbers")
            if (np.abs(correction) <= NEWTON_TOLERANCE * (1.0 + np.abs(w).max())).all():
                return w, sensitivity
        raise np.linalg.LinAlgError(f"Newton's method has not converged after {NEWTON_ITERATIONS} iterations")

    def response(self, x: Array, u: Array, p: Array | None = None) -> tuple[Array, Array, Array]:
        """The unknowns w of an interval as `advance` gives them, and their derivatives by x (nw, nx) and u (nw, nu)."""
        w, by_x = self.advance(x, u, p)
        given = self.given(self.problem.parameters)[0] if p is None else p
        _, _, M, B = (value.full() for value in self._newton(w, x, u, given))
        return w, by_x, np.linalg.solve(M, B)

    def sensitivity(self, begin: Array, u: Array, end: Array, inner: Array) -> Array:
        """How the state at the end of the first interval depends on that at its beginning, A (nx, nx), at a trajectory.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the linearised equations are singular.
        """
        given = self.given(self.problem.parameters)[0]
        _, A0, M, _ = (value.full() for value in self._newton(np.r_[end, inner], begin, u, given))
        return np.linalg.solve(M, A0)[: len(begin)]

    def _interval(self) -> Any:
        """All substeps of an interval; its unknowns are those of the last substep, then those of the ones before."""
        substep, m = self._substep, self.discretization.substeps
        nw, nx, nu, np_ = (substep.size1_in(i) for i in range(4))
        if m == 1:
            return substep
        if self.discretization.explicit:
            # There may be thousands: a loop, not an expression.
            w, x, u, p = (ca.MX.sym(name, size) for name, size in (("w", nw), ("x", nx), ("u", nu), ("p", np_)))
            F = ca.Function("F", [x, u, p], [substep(ca.DM.zeros(nw), x, u, p)])
            end = F.fold(m)(x, ca.repmat(u, 1, m), ca.repmat(p, 1, m))
            return ca.Function("interval", [w, x, u, p], [end - w])
        w, x, u, p = (ca.SX.sym(name, size) for name, size in (("w", m * nw), ("x", nx), ("u", nu), ("p", np_)))
        last, *before = ca.vertsplit(w, nw)
        start, rows = x, []
        for unknowns in (*before, last):
            rows.append(substep(unknowns, start, u, p))
            start = unknowns[:nx]
        return ca.Function("interval", [w, x, u, p], [ca.vertcat(rows[-1], *rows[:-1])])

    def _inner(self, inner: Sequence[tuple[int, float]]) -> tuple[np.ndarray, Array]:
        """Signals and nodes of the unknowns of an interval but the state at its end."""
        m, nx, nz = self.discretization.substeps, len(self.problem.model.states), len(self.problem.model.algebraic)
        table: list[tuple[int, float]] = []
        for j in (m - 1, *range(m - 1)) if not self.discretization.explicit else ():
            ends = range(nx if j == m - 1 else 0, nx + nz)
            table += [(signal, 1.0 * (j + 1) / m) for signal in ends]
            table += [(signal, (j + node) / m) for signal, node in inner]
        signals, nodes = np.array(table, dtype=float).reshape(-1, 2).T
        return signals.astype(np.int32), nodes

    def _linearised(self, phi: Any, w: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """All terms of a step with the equations phi."""
        xz = w[: len(self.problem.model.variables)]
        y, G = self.outputs(xz, u, p), self.constraints(xz, u, p)
        return {
            "defect": phi,
            "A0": ca.jacobian(phi, x),
            "M": -ca.jacobian(phi, w),
            "B": ca.jacobian(phi, u),
            "y": y,
            "Cx": ca.jacobian(y, xz),
            "Cu": ca.jacobian(y, u),
            "G": G,
            "D": ca.jacobian(G, xz),
            "E": ca.jacobian(G, u),
        }
