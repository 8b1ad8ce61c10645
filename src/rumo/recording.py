"""From CasADi functions to tapes that the C core runs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from typing import Any

import casadi as ca
import numpy as np

from rumo.kernel.description import MATRICES, VECTORS, StageProgram
from rumo.kernel.optimise import optimised
from rumo.kernel.system import SystemProgram
from rumo.kernel.tape import OPERATIONS, Tape
from rumo.model import Model
from rumo.nominal import newton_matrices
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Transcription

OF_ENDS = ("y", "Cx", "Cu", "G", "D", "E")
"""Terms that only the end of an interval has."""

_NAMES = {
    "constant": "OP_CONST",
    "input": "OP_INPUT",
    "output": "OP_OUTPUT",
    "pow": "OP_POW",
} | {name: f"OP_{name.upper()}" for name in OPERATIONS if name not in ("constant", "input", "output", "pow")}

_CODES = {getattr(ca, casadi_name): OPERATIONS.index(name) for name, casadi_name in _NAMES.items()} | {
    ca.OP_CONSTPOW: OPERATIONS.index("pow"),
    ca.OP_LIFT: OPERATIONS.index("assign"),
}


def missing_operation(problem: Problem) -> str | None:
    """An operation of a problem's model, outputs or constraints that the core lacks; None if it has them all."""
    rows = [*problem.output_rows, *(constraint.expression for constraint in problem.constraints)]
    return missing_in_model(problem.model, *rows)


def missing_in_model(model: Model, *others: Any) -> str | None:
    """An operation of a model and of other expressions that the core lacks; None if it has them all."""
    arguments = model.xz, model.u, model.p
    function = ca.Function("model", arguments, [ca.vertcat(model.f(*arguments), model.g(*arguments), *others)])
    for i in range(function.n_instructions()):
        if function.instruction_id(i) not in _CODES:
            return next(
                name for name in dir(ca) if name.startswith("OP_") and getattr(ca, name) == function.instruction_id(i)
            )
    return None


def record(function: Any) -> Tape:
    """The instructions of an SX function with one dense vector of outputs."""
    code, constants = np.zeros((function.n_instructions(), 4), dtype=np.int32), np.zeros(function.n_instructions())
    for i in range(len(code)):
        operation = _CODES[function.instruction_id(i)]
        name = OPERATIONS[operation]
        if name == "input":
            row = (function.instruction_output(i)[0], *function.instruction_input(i))
        elif name == "output":
            row = (function.instruction_output(i)[1], function.instruction_input(i)[0], 0)
        elif name == "constant":
            row = (function.instruction_output(i)[0], 0, 0)
            constants[i] = function.instruction_constant(i)
        else:
            operands = function.instruction_input(i)
            row = (function.instruction_output(i)[0], operands[0], operands[1] if len(operands) > 1 else operands[0])
        code[i] = (operation, *row)
    return Tape(code, constants, max(function.sz_w(), 1))


def stage_program(transcription: Transcription) -> StageProgram:
    """The linearised substep for the C core, whose operations must be known to it."""
    entries: list[Any] = []
    first: dict[str, int] = {}
    positions: dict[str, list[tuple[int, int]]] = {}
    inside: list[bool] = []
    for name in (*VECTORS, *MATRICES):
        first[name], term = len(entries), transcription.terms[name]
        if name in VECTORS:
            entries += ca.vertsplit(ca.densify(term))
        else:
            # CasADi sorts nonzeros by columns; those of the transpose are sorted by rows.
            transposed = ca.sparsify(term.T)
            columns, rows = transposed.sparsity().get_triplet()
            positions[name] = list(zip(rows, columns, strict=True))
            entries += transposed.nonzeros()
        inside += [name not in OF_ENDS] * (len(entries) - len(inside))
    fixed = _constants(entries)
    varying = np.isnan(fixed)

    def tape(slots: np.ndarray) -> Tape:
        return _tape(transcription.arguments, entries, slots)

    alone = transcription.discretization.substeps == 1
    inner = None if alone else tape(np.flatnonzero(varying & inside))
    samples = cache(partial(newton_matrices, transcription))
    return StageProgram(tape(np.flatnonzero(varying)), inner, fixed, first, positions, samples)


def system_program(model: Model) -> SystemProgram:
    """The right-hand side of a model for the C core, whose operations must be known to it."""
    nx, nz = len(model.states), len(model.algebraic)
    arguments = [ca.SX(0, 1), model.x, model.u, model.p, model.z]
    right = ca.vertcat(model.f(model.xz, model.u, model.p), model.g(model.xz, model.u, model.p))
    transposed = ca.sparsify(ca.jacobian(right, model.xz).T)  # by rows: see stage_program
    columns, rows = transposed.sparsity().get_triplet()
    nonzeros = dict(zip(zip(rows, columns, strict=True), transposed.nonzeros(), strict=True))
    nonzeros |= {(i, i): ca.SX(0.0) for i in range(nx) if (i, i) not in nonzeros}
    positions = sorted(nonzeros)
    entries = [*ca.vertsplit(ca.densify(right)), *(nonzeros[place] for place in positions)]
    fixed = _constants(entries)
    varying = np.isnan(fixed)
    rates = _tape(arguments, entries, np.flatnonzero(varying[: nx + nz]))
    jacobian = _tape(arguments, entries, np.flatnonzero(varying))
    return SystemProgram(nx, nz, len(model.inputs), len(model.parameters), rates, jacobian, fixed, positions)


def _constants(entries: Sequence[Any]) -> Array:
    """Values of those that are constant, NaN for those that a tape computes."""
    fixed = np.array([float(entry) if entry.is_constant() else np.nan for entry in entries])
    fixed[np.isinf(fixed)] = np.nan  # the tape computes it, and all that it computes is checked
    return fixed


def _tape(arguments: Sequence[Any], entries: Sequence[Any], slots: np.ndarray) -> Tape:
    """A tape that computes some of the entries into their slots."""
    program = record(
        ca.Function("stage", arguments, [ca.cse(ca.vertcat(ca.SX(0, 1), *(entries[slot] for slot in slots)))])
    )
    written = program.code[:, 0] == OPERATIONS.index("output")
    program.code[written, 1] = slots[program.code[written, 1]]
    return optimised(program)
