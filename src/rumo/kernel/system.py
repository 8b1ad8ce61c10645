"""What the C core is told about a system that it integrates: plain arrays, no expressions."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from rumo.kernel.description import SIZES, members
from rumo.kernel.elimination import Positions
from rumo.kernel.factor import MOST_PRODUCTS, Block, blocks_of, factor
from rumo.kernel.tape import Tape
from rumo.signals import Array

MOST_DENSE = 1000
"""Variables of which the core takes a dense matrix."""
AS_FAST = 4.0
"""Products with dense matrices, made in vectors, in the time of one with sparse factors."""
SOLUTIONS = 6
"""With the factors of a step."""


class Ending(IntEnum):
    """How an integration ended, as `rumo_ending` has it."""

    ARRIVED = 0
    NO_VALUE = 1
    NO_ROOT = 2
    TOO_SHORT = 3
    TOO_MANY = 4

    @property
    def sentence(self) -> str:
        """For people."""
        return _SENTENCES[self]


_SENTENCES = {
    Ending.ARRIVED: "It arrived.",
    Ending.NO_VALUE: "The model has no finite value on the way.",
    Ending.NO_ROOT: "No algebraic variables were found.",
    Ending.TOO_SHORT: "Steps became too short.",
    Ending.TOO_MANY: "It took too many steps.",
}


@dataclass(frozen=True, eq=False)
class SystemProgram:
    """The right-hand side (f, g) of a system in semi-explicit form, and its Jacobian by (x, z).

    Attributes
    ----------
    states, algebraic, inputs, parameters : int
        Sizes.
    rates, jacobian : Tape
        Compute the rows of (f, g) that vary, and these with the nonzeros of the Jacobian that do.
    fixed : ndarray, shape (n + nonzeros,)
        Values of the constant ones, NaN for others.
    positions : (row, column) pairs
        Structural nonzeros, sorted by rows; those of states on the diagonal are always among them.
    """

    states: int
    algebraic: int
    inputs: int
    parameters: int
    rates: Tape
    jacobian: Tape
    fixed: Array
    positions: Positions


def describe_system(
    program: SystemProgram, scales: Array, guess: Array, tolerance: float, fixed_steps: int = 0
) -> dict[str, Any]:
    """All that `rumo_system` asks for, by its names.

    Parameters
    ----------
    program : SystemProgram
        The right-hand side.
    scales : ndarray, shape (n,)
        Sizes below which states and algebraic variables do not matter.
    guess : ndarray, shape (nz,)
        Of the algebraic variables.
    tolerance : float
        Relative, and absolute in units of the scales.
    fixed_steps : int
        How many equal steps there are, whatever their error; 0 for steps that are chosen by it.
    """
    n = program.states + program.algebraic
    sizes = dict.fromkeys(SIZES, 0) | {"horizon": 1, "substeps": 1, "slots": len(program.fixed)}
    sizes |= {name: getattr(program, name) for name in ("states", "algebraic", "inputs", "parameters")}
    description: dict[str, Any] = dict(sizes) | {"fixed": program.fixed, "fixed_steps": fixed_steps}
    for name in ("rates", "jacobian"):
        tape: Tape = getattr(program, name)
        description |= {f"{name}_code": tape.code, f"{name}_constants": tape.constants}
        description |= {f"{name}_length": len(tape.code), f"{name}_registers": tape.registers}
    places = np.array(program.positions, dtype=np.int32).reshape(-1, 2)
    description |= {"J_row": places[:, 0].copy(), "J_column": places[:, 1].copy(), "J_first": n, "J_count": len(places)}
    rows: list[dict[int, int]] = [{} for _ in range(n)]
    for e, (row, column) in enumerate(program.positions):
        rows[row][column] = n + e
    blocks = blocks_of(rows)
    tables = factor(blocks if _sparse(blocks, n) else [], rows)
    description |= tables | {
        "factor_unknowns": len(tables["factor_equation"]),
        "factor_blocks": len(tables["factor_size"]),
        "factor_outer": len(tables["factor_nonzero"]) - len(tables["factor_entry"]),
        "factor_inner": len(tables["factor_entry"]),
    }
    description |= {"scales": scales, "algebraic_guess": guess, "tolerance": np.array([tolerance])}
    for member in members("rumo_system"):
        if member.kind in ("ints", "doubles"):
            kind = np.int32 if member.kind == "ints" else np.float64
            description[member.name] = np.ascontiguousarray(description[member.name], dtype=kind)
    return description


def _sparse(blocks: list[Block], n: int) -> bool:
    """Whether sparse factors are faster than the inverse of a dense matrix."""
    products, fill = (sum(getattr(block, name) for block in blocks) for name in ("products", "fill"))
    if products > MOST_PRODUCTS:
        return False
    return AS_FAST * (products + SOLUTIONS * fill) < n**2 * (n + SOLUTIONS)


def can_integrate(program: SystemProgram) -> str:
    """Why the core cannot integrate a system; nothing if it can."""
    n = program.states + program.algebraic
    if n <= MOST_DENSE:
        return ""
    rows: list[dict[int, int]] = [{} for _ in range(n)]
    for e, (row, column) in enumerate(program.positions):
        rows[row][column] = n + e
    return "" if _sparse(blocks_of(rows), n) else f"its {n} variables depend on each other too closely"
