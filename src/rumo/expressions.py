"""What users write as functions of (x, u, p): called, and their mistakes explained."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from textwrap import shorten
from typing import Any

import casadi as ca

from rumo.checks import check_signature
from rumo.errors import ArgumentError, RumoError

COMPARISONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR)
BRANCH = "Write ca.if_else(x.v > 0, a, b) for a condition, ca.fmax(a, b) and ca.fmin(a, b), ca.logic_and(a, b)."
FUNCTION = "Write CasADi's functions of signals: ca.sin(x.v), not math.sin(x.v) or np.sin(x.v)."
ARGUMENTS = "a function of (x, u, p): states, inputs, parameters"
NUMBERS_ONLY = ("SX", "casadi", "NaN to integer", "dtype('O')", "NamedSymbols")
"""Parts of what Python, NumPy and CasADi say where a symbol should be a number."""


def called(function: Callable[..., Any], symbols: Sequence[Any], argument: str) -> Any:
    """What `function(x, u, p)` returns; a function that does not suit symbols raises, naming `argument`."""
    if not callable(function):
        raise ArgumentError(argument, repr(function), "a function (x, u, p) -> expression")
    check_signature(function, argument, 3, ARGUMENTS, "Write lambda x, u, p: ..., also where not all are used.")
    try:
        with warnings.catch_warnings():
            # NumPy's functions work on scalars, in some versions with a notice about vectors.
            warnings.filterwarnings("ignore", r"\s*casadi: a numpy function", FutureWarning)
            warnings.filterwarnings("ignore", "Implicit conversion of symbolic", RuntimeWarning)
            return function(*symbols)
    except RumoError:
        raise
    except Exception as error:  # CasADi raises bare ones too
        said = str(error).strip().partition("\n")[0]
        if "truth value" in said:
            got = "an expression of signals where Python needs true or false (if, and, or, not, max, min)"
            raise ArgumentError(argument, got, "one formula for all values", BRANCH) from error
        if any(part in said for part in NUMBERS_ONLY):
            got = f"an expression of signals where a number is needed ({said})"
            raise ArgumentError(argument, got, "CasADi's operations", FUNCTION) from error
        raise


def as_scalar(expression: Any, argument: str) -> Any:
    """`expression` as a 1 x 1 SX with a finite value; anything else raises, naming `argument`."""
    try:
        result = ca.SX(expression)
    except (NotImplementedError, TypeError, RuntimeError):  # what CasADi raises for text, lists, MX
        raise ArgumentError(argument, repr(expression), "a CasADi SX expression or a number") from None
    if result.shape != (1, 1):
        raise ArgumentError(argument, f"an expression of shape {result.shape}", "a scalar expression")
    if any(result.is_op(comparison) for comparison in COMPARISONS):
        raise ArgumentError(
            argument, f"the comparison {result}", "an expression with a value", "Write x - 1.0 for x <= 1.0."
        )
    function = ca.Function("expression", ca.symvar(result), [result])
    steps = range(function.n_instructions())
    constants = [function.instruction_constant(k) for k in steps if function.instruction_id(k) == ca.OP_CONST]
    if not all(map(math.isfinite, constants)):
        raise ArgumentError(
            argument,
            f"{shorten(str(result), 80)} with NaN or infinity in it",
            "finite numbers",
            "If it comes from math.sin(x.v): that takes numbers only. Write ca.sin(x.v).",
        )
    return result
