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
    "fmin": "minimum({a}, {b})",
    "fmax": "maximum({a}, {b})",
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

_ANGLES = ("sin", "cos", "tan")
"""Those of angles, whose functions in C are made for angles up to a limit: see elementary.h."""

_OF_TWO = ("atan2", "pow", "hypot", "copysign", "fmod")


@dataclass(frozen=True, eq=False)
class Tape:
    """A program that computes the terms of one substep.

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

    @classmethod
    def empty(cls) -> Tape:
        """A program without instructions."""
        return cls(np.zeros((0, 4), dtype=np.int32), np.zeros(0), 0)

    def source(self, name: str, horizon: int) -> str:
        """A function like `evaluate` of tape.c in C, for all stages, written so that it becomes vector instructions."""
        angles = any(OPERATIONS[operation] in _ANGLES for operation in self.code[:, 0].tolist())
        if not angles:
            return self._function(name, horizon, "static", "sum == 0.0")
        far = self._function(f"{name}_far", horizon, "RARE static", "sum == 0.0", far=True)
        otherwise = f"sum == 0.0 || {name}_far(tape, in, lanes, unused, terms)"
        return far + self._function(name, horizon, "static", otherwise)

    def _function(self, name: str, horizon: int, kind: str, result: str, *, far: bool = False) -> str:
        """The function, for angles of any size or for those that are not far, which it adds up to a `sum` of 0."""
        lines: list[str] = []
        outputs = 0
        for (operation, register, a, b), constant in zip(self.code.tolist(), self.constants.tolist(), strict=True):
            what = OPERATIONS[operation]
            if what == "output":
                lines.append(f"terms[{register} * LANES_ALL + k] = r{a};")
                lines.append(f"odd{outputs % 4} += 0.0 * r{a};")  # sums that do not wait for each other
                outputs += 1
                continue
            if what == "constant":
                value = constant.hex() if np.isfinite(constant) else f"({constant!r})".replace("inf", "INFINITY")
                lines.append(f"r{register} = {value.replace('nan', 'NAN')};")
            elif what == "input":
                lines.append(f"r{register} = {'zxupe'[a]}[{b} * {'zxupe'[a]}_stride + k];")
            elif far and what in _ANGLES:
                lines.append(f"r{register} = {what}(r{a});")
            else:
                if what in _ANGLES:
                    lines.append(f"odd{a % 4} += is_far(r{a});")
                form = _C.get(what, f"{what}({{a}}, {{b}})" if what in _OF_TWO else f"{what}({{a}})")
                lines.append(f"r{register} = {form.format(a=f'r{a}', b=f'r{b}')};")
        lines.insert(0, "double odd0 = 0.0, odd1 = 0.0, odd2 = 0.0, odd3 = 0.0;")
        if self.registers:
            lines.insert(0, f"double {', '.join(f'r{i}' for i in range(self.registers))};")
        lines.append("odd[k] = (odd0 + odd1) + (odd2 + odd3);")
        arguments = "\n    ".join(
            f"const double *restrict {symbol} = in->first[{i}];\n    const ptrdiff_t {symbol}_stride = in->stride[{i}];"
            for i, symbol in enumerate("zxupe")
        )
        unused = ", ".join(f"(void){symbol}, (void){symbol}_stride" for symbol in "zxupe")
        body = "\n        ".join(lines)
        return f"""\
{kind} int {name}(const rumo_tape *tape, const guess_lanes *in, int lanes, double *unused, double *restrict terms) {{
    enum {{ LANES_ALL = ({horizon} + LANES - 1) / LANES * LANES }};
    {arguments}
    double odd[LANES_ALL], sum = 0.0;
    (void)tape, (void)lanes, (void)unused, (void)terms, {unused};
    for (int k = 0; k < LANES_ALL; ++k) {{
        {body}
    }}
    for (int k = 0; k < LANES_ALL; ++k) sum += odd[k];
    return {result};
}}
"""
