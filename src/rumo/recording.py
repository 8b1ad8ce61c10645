"""From a CasADi function to a tape that the C core runs."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from rumo.kernel.tape import OPERATIONS, Tape
from rumo.problem import Problem

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
    model = problem.model
    arguments = model.xz, model.u, model.p
    rows = [*problem.output_rows, *(constraint.row for constraint in problem.constraints)]
    function = ca.Function("model", arguments, [ca.vertcat(model.f(*arguments), model.g(*arguments), *rows)])
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
