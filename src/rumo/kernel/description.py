"""What the C core is told about a problem: plain arrays, no expressions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.kernel.elimination import Positions, compose, eliminate
from rumo.kernel.tape import Tape
from rumo.signals import Array

VECTORS = ("y", "G", "defect")
MATRICES = ("A0", "M", "B", "Cx", "Cu", "D", "E")


@dataclass(frozen=True)
class StageProgram:
    """The terms of a linearised substep: how each nonzero is computed.

    Attributes
    ----------
    tape : Tape
        Computes the terms that vary from (state at the end, x, u, p, other unknowns).
    inner_tape : Tape or None
        The same for substeps that do not end an interval, without outputs and constraints; None if there are none.
    fixed : ndarray, shape (slots,)
        Values of the constant terms, NaN for those that the tape computes.
    first : mapping of str to int
        Slot of the first nonzero of each of `VECTORS` and `MATRICES`.
    positions : mapping of str to (row, column) pairs
        Structural nonzeros of each of `MATRICES`, sorted by rows.
    """

    tape: Tape
    inner_tape: Tape | None
    fixed: Array
    first: Mapping[str, int]
    positions: Mapping[str, Positions]


@dataclass(frozen=True)
class Description:
    """What the C core needs to know.

    Attributes
    ----------
    sizes : tuple of int
        The members of `rumo_sizes`.
    tape, inner_tape : Tape
        The model at substeps that end an interval, and at those that do not.
    values : dict
        Everything, by the names of `rumo_problem`.
    """

    sizes: tuple[int, ...]
    tape: Tape
    inner_tape: Tape
    values: dict[str, Any]


SIZES = (
    "horizon",
    "states",
    "algebraic",
    "inputs",
    "outputs",
    "constraints",
    "parameters",
    "delay",
    "inner",
    "substeps",
    "explicit_scheme",
    "blocks",
    "slots",
)


def describe(stage: StageProgram, sizes: Mapping[str, int], values: Mapping[str, Array]) -> Description:
    """All that `rumo_problem` asks for, by its names.

    Parameters
    ----------
    stage : StageProgram
        The model.
    sizes : mapping of str to int
        All of `SIZES` but slots.
    values : mapping of str to ndarray
        Weights, limits and scales.
    """
    description: dict[str, Any] = dict(sizes)
    description |= {"slots": len(stage.fixed), "fixed": stage.fixed}
    inner_tape = stage.inner_tape or Tape.empty()
    for prefix, tape in (("", stage.tape), ("inner_", inner_tape)):
        description |= {f"{prefix}code": tape.code, f"{prefix}constants": tape.constants}
        description[f"{prefix}registers"] = tape.registers
    for name in MATRICES:
        places = np.array(stage.positions[name], dtype=np.int32).reshape(-1, 2)
        description[f"{name}_row"], description[f"{name}_column"] = places[:, 0].copy(), places[:, 1].copy()
        description[f"{name}_first"] = stage.first[name]
    description |= {f"{name}_first": stage.first[name] for name in VECTORS}
    rows, nx = sizes["states"] + sizes["algebraic"], sizes["states"]
    elimination = eliminate(stage.first, stage.positions, rows + sizes["inner"], nx, sizes["inputs"])
    places = list(zip(elimination["result_row"].tolist(), elimination["result_column"].tolist(), strict=True))
    description |= elimination | compose(places if sizes["substeps"] > 1 else [], nx, rows)
    for name, array in values.items():
        kind = np.int32 if array.dtype.kind in "bi" else np.float64
        description[name] = np.ascontiguousarray(array, dtype=kind)
    return Description(tuple(int(description[name]) for name in SIZES), stage.tape, inner_tape, description)
