"""A model as a straight-line program, and the same program as C."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.signals import Array

OPERATIONS = (
    "constant",
    "input",
    "output",
    "assign",
    "add",
    "sub",
    "mul",
    "div",
    "neg",
    "inv",
    "sq",
    "twice",
    "sqrt",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "exp",
    "expm1",
    "log",
    "log1p",
    "pow",
    "hypot",
    "erf",
    "fabs",
    "sign",
    "copysign",
    "floor",
    "ceil",
    "fmod",
    "fmin",
    "fmax",
    "lt",
    "le",
    "eq",
    "ne",
    "not",
    "and",
    "or",
    "if_else_zero",
)
"""Operations in the order of `rumo_operation` in rumo_core.h."""

_C = {
    "assign": "{a}",
    "add": "{a} + {b}",
    "sub": "{a} - {b}",
    "mul": "{a} * {b}",
    "div": "{a} / {b}",
    "neg": "-{a}",
    "inv": "1.0 / {a}",
    "sq": "{a} * {a}",
    "twice": "2.0 * {a}",
    "sin": "sine({a})",
    "cos": "cosine({a})",
    "tan": "tangent({a})",
    "atan": "arctangent({a})",
    "sign": "{a} > 0.0 ? 1.0 : {a} < 0.0 ? -1.0 : {a}",
    "lt": "{a} < {b} ? 1.0 : 0.0",
    "le": "{a} <= {b} ? 1.0 : 0.0",
    "eq": "{a} == {b} ? 1.0 : 0.0",
    "ne": "{a} != {b} ? 1.0 : 0.0",
    "not": "{a} == 0.0 ? 1.0 : 0.0",
    "and": "{a} != 0.0 && {b} != 0.0 ? 1.0 : 0.0",
    "or": "{a} != 0.0 || {b} != 0.0 ? 1.0 : 0.0",
    "if_else_zero": "{a} != 0.0 ? {b} : 0.0",
}
"""Operations that are not a function of the C library of the same name."""

_OF_TWO = ("atan2", "pow", "hypot", "copysign", "fmod", "fmin", "fmax")


@dataclass(frozen=True)
class Tape:
    """A program that computes the terms of one stage.

    Attributes
    ----------
    code : ndarray of int32, shape (length, 4)
        Operation, result, a, b: see rumo_core.h.
    constants : ndarray, shape (length,)
        Values of the constants among the instructions.
    registers : int
        Numbers alive at a time.
    """

    code: np.ndarray
    constants: Array
    registers: int

    def source(self, horizon: int) -> str:
        """The function `evaluate` of tape.c in C, for all stages, written so that it becomes vector instructions."""
        lines: list[str] = []
        for (operation, result, a, b), constant in zip(self.code.tolist(), self.constants.tolist(), strict=True):
            name = OPERATIONS[operation]
            if name == "output":
                lines.append(f"terms[{result} * LANES_ALL + k] = r{a};")
                continue
            if name == "constant":
                value = constant.hex() if np.isfinite(constant) else f"({constant!r})".replace("inf", "INFINITY")
                lines.append(f"r{result} = {value.replace('nan', 'NAN')};")
            elif name == "input":
                lines.append(f"r{result} = {'zxup'[a]}[{b} * {'zxup'[a]}_stride + k];")
            else:
                form = _C.get(name, f"{name}({{a}}, {{b}})" if name in _OF_TWO else f"{name}({{a}})")
                lines.append(f"r{result} = {form.format(a=f'r{a}', b=f'r{b}')};")
        registers = ", ".join(f"r{i}" for i in range(self.registers))
        body = "\n        ".join(lines)
        return f"""\
static void evaluate(const rumo_tape *tape, const guess_lanes *in, int lanes, double *unused, double *restrict terms) {{
    enum {{ LANES_ALL = ({horizon} + LANES - 1) / LANES * LANES }};
    const double *restrict z = in->z, *restrict x = in->x, *restrict u = in->u, *restrict p = in->p;
    const ptrdiff_t z_stride = in->z_stride, x_stride = in->x_stride, u_stride = in->u_stride, p_stride = in->p_stride;
    (void)tape, (void)lanes, (void)unused, (void)u, (void)p, (void)u_stride, (void)p_stride;
    for (int k = 0; k < LANES_ALL; ++k) {{
        double {registers};
        {body}
    }}
}}
"""
