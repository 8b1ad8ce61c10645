"""From a problem and a scheme to stage functions and their exact derivatives: the only place that differentiates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from rumo.discretization import Discretization, ImplicitEuler
from rumo.kernel.description import MATRICES, VECTORS, StageProgram
from rumo.kernel.tape import OPERATIONS
from rumo.problem import Problem
from rumo.recording import record
from rumo.signals import Array


@dataclass(frozen=True)
class Stages:
    """The horizon linearised about a guess; index k stands for stage i = k + 1, the step from x_k to x_{k+1}.

    Attributes
    ----------
    defect : ndarray, shape (N, nx)
        `F_g - x_g`, what the guess lacks of satisfying the discrete dynamics.
    A0, A1, B : ndarray, shapes (N, nx, nx), (N, nx, nx), (N, nx, nu)
        Derivatives of F(x_i, x_{i-1}, u_{i-1}): by x_{i-1}, by x_i, by u_{i-1}.
    y, Cx, Cu : ndarray, shapes (N, ny), (N, ny, nx), (N, ny, nu)
        Tracked outputs at (x_i, u_{i-1}) and their derivatives.
    G, D, E : ndarray, shapes (N, nc), (N, nc, nx), (N, nc, nu)
        Path constraints G(x_i, u_{i-1}) and their derivatives.
    """

    defect: Array
    A0: Array
    A1: Array
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
        Implicit Euler if not given.

    Attributes
    ----------
    residual, outputs, constraints : casadi.Function
        `(z, x, u, p) -> phi` (nx,), `(x, u, p) -> y` (ny,) and `(x, u, p) -> G` (nc,).
    imposed : ndarray of bool, shape (N, nc)
        Whether some free input can influence a constraint at a stage, by the structure of the derivatives;
        where none can, the constraint is reported but not imposed.
    """

    def __init__(self, problem: Problem, discretization: Discretization | None = None) -> None:
        self.problem = problem
        self.discretization = discretization or ImplicitEuler()
        model = problem.model
        z, x, u, p = ca.SX.sym("z", len(model.states)), model.x, model.u, model.p

        phi = self.discretization.residual(model, z, x, u, p, problem.sampling_time)
        y = ca.vertcat(*problem.output_rows)
        G = ca.vertcat(*(constraint.row for constraint in problem.constraints)) if problem.constraints else ca.SX(0, 1)
        self.residual = ca.Function("residual", [z, x, u, p], [phi], ["z", "x", "u", "p"], ["phi"])
        self.outputs = ca.Function("outputs", [x, u, p], [y], ["x", "u", "p"], ["y"])
        self.constraints = ca.Function("constraints", [x, u, p], [G], ["x", "u", "p"], ["G"])

        y_z, G_z = self.outputs(z, u, p), self.constraints(z, u, p)
        A1 = ca.SX.eye(z.numel()) + ca.jacobian(phi, z)
        terms = {
            "defect": phi,
            "A0": ca.jacobian(phi, x),
            "A1": A1,
            "B": ca.jacobian(phi, u),
            "y": y_z,
            "Cx": ca.jacobian(y_z, z),
            "Cu": ca.jacobian(y_z, u),
            "G": G_z,
            "D": ca.jacobian(G_z, z),
            "E": ca.jacobian(G_z, u),
        }
        vectors = ("defect", "y", "G")
        self._shapes = {name: term.shape[:1] if name in vectors else term.shape for name, term in terms.items()}
        packed = ca.densify(ca.vertcat(*(ca.vec(ca.densify(term)) for term in terms.values())))
        stage = ca.Function("stage", [z, x, u, p], [packed])
        self._stages = stage.map(problem.horizon)
        self._path = self.constraints.map(problem.horizon)
        self._parameters = np.tile(problem.parameters[:, None], problem.horizon)
        self._step = ca.Function("step", [z, x, u, p], [phi, terms["A0"], terms["A1"]])
        self.imposed = self._influenced(terms)
        self._arguments, self._terms = (z, x, u, p), terms

    def program(self) -> StageProgram:
        """The linearised stage for the C core, whose operations must be known to it."""
        terms = self._terms | {"M": ca.SX.eye(len(self.problem.model.states)) - self._terms["A1"]}
        entries: list[Any] = []
        first: dict[str, int] = {}
        positions: dict[str, list[tuple[int, int]]] = {}
        for name in VECTORS:
            first[name] = len(entries)
            entries += ca.vertsplit(ca.densify(terms[name]))
        for name in MATRICES:
            # CasADi sorts nonzeros by columns; those of the transpose are sorted by rows.
            transposed = ca.sparsify(terms[name].T)
            columns, rows = transposed.sparsity().get_triplet()
            first[name], positions[name] = len(entries), list(zip(rows, columns, strict=True))
            entries += transposed.nonzeros()
        fixed = np.array([float(entry) if entry.is_constant() else np.nan for entry in entries])
        varying = ca.vertcat(*(entry for entry, value in zip(entries, fixed, strict=True) if np.isnan(value)))
        tape = record(ca.Function("stage", list(self._arguments), [ca.cse(varying)]))
        slots = np.flatnonzero(np.isnan(fixed))
        outputs = tape.code[:, 0] == OPERATIONS.index("output")
        tape.code[outputs, 1] = slots[tape.code[outputs, 1]]
        return StageProgram(tape, fixed, first, positions)

    def linearize(self, x: Array, u: Array) -> Stages:
        """Linearise all stages about a guess.

        Parameters
        ----------
        x : ndarray, shape (N + 1, nx)
            Guess x_g of the states.
        u : ndarray, shape (N, nu)
            Guess u_g of the inputs.
        """
        packed = self._stages(x[1:].T, x[:-1].T, u.T, self._parameters).full().T
        arrays: dict[str, Array] = {}
        start = 0
        for name, shape in self._shapes.items():
            size = int(np.prod(shape))
            block = packed[:, start : start + size]
            # CasADi stores matrices by columns.
            arrays[name] = block.reshape(len(packed), *shape[::-1]).transpose(0, *range(len(shape), 0, -1))
            start += size
        return Stages(**arrays)

    def path_constraints(self, x: Array, u: Array) -> Array:
        """Values (N, nc) of the path constraints along states (N + 1, nx) and inputs (N, nu)."""
        return self._path(x[1:].T, u.T, self._parameters).full().T

    def step(self, z: Array, x: Array, u: Array) -> tuple[Array, Array, Array]:
        """Residual (nx,) of a single step from x to z with input u, and its derivatives A0, A1 (nx, nx)."""
        phi, A0, A1 = self._step(z, x, u, self.problem.parameters)
        return phi.full().ravel(), A0.full(), A1.full()

    def _influenced(self, terms: dict[str, Any]) -> Any:
        """Propagate by sparsity patterns which states depend on a free input, stage by stage."""
        pattern = {
            name: np.asarray(ca.DM(terms[name].sparsity(), 1).full() != 0.0) for name in ("A0", "A1", "B", "D", "E")
        }
        # x_i depends on everything that reaches it through (I - A1)^-1 = I + A1 + A1^2 + ...
        nx = len(pattern["A1"])
        closure = np.eye(nx, dtype=bool) | pattern["A1"]
        for _ in range(nx.bit_length()):
            closure = closure @ closure
        imposed = np.zeros((self.problem.horizon, len(self.problem.constraints)), dtype=bool)
        influenced = np.zeros(nx, dtype=bool)
        for k in range(self.problem.horizon):
            free = k >= self.problem.delay
            source = pattern["A0"] @ influenced | (pattern["B"].any(axis=1) if free else False)
            influenced = closure @ source
            imposed[k] = pattern["D"] @ influenced | (pattern["E"].any(axis=1) if free else False)
        return imposed
