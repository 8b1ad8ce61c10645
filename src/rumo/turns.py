"""Which functions a full turn of an angle leaves as they are, by their expression graphs."""

from __future__ import annotations

from typing import Any

import casadi as ca

CIRCULAR = (ca.OP_SIN, ca.OP_COS, ca.OP_TAN)


def unturned(function: Any, argument: int, element: int) -> bool:
    """Whether 2 pi more in one element of an argument changes nothing, whatever the other numbers.

    Each node of the graph is followed as `g + n x`, with g of period 2 pi in the element x and a whole number n: sums
    add those numbers, whole factors multiply them, and sine, cosine and tangent forget them. What else is done with a
    node whose number is not 0 is taken for a change.

    Parameters
    ----------
    function : casadi.Function
        Of SX expressions.
    argument, element : int
        Where x stands.
    """
    turns: dict[int, int | None] = {}  # by place in the work vector; None is no such number
    constants: dict[int, float] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        inputs, outputs = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            if turns[inputs[0]] != 0:
                return False
            continue
        place = outputs[0]
        value = None
        if operation == ca.OP_INPUT:
            n: int | None = int(tuple(inputs) == (argument, element))
        elif operation == ca.OP_CONST:
            n, value = 0, function.instruction_constant(k)
        else:
            n = _after(operation, [turns[i] for i in inputs], [constants.get(i) for i in inputs])
        turns[place] = n
        constants.pop(place, None)
        if value is not None:
            constants[place] = value
    return True


def _after(operation: int, turns: list[int | None], values: list[float | None]) -> int | None:
    """The whole number of an operation's result."""
    known = [n for n in turns if n is not None]
    if len(known) < len(turns):
        return None
    if not any(known) or operation in CIRCULAR:
        return 0
    if operation == ca.OP_ADD:
        return known[0] + known[1]
    if operation == ca.OP_SUB:
        return known[0] - known[1]
    if operation == ca.OP_NEG:
        return -known[0]
    if operation == ca.OP_TWICE:
        return 2 * known[0]
    if operation == ca.OP_ASSIGN:
        return known[0]
    if operation == ca.OP_MUL:
        for factor, other in ((0, 1), (1, 0)):
            value = values[factor]
            if value is not None and value.is_integer():
                return int(value) * known[other]
    return None
