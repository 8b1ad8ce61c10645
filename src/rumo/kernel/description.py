"""What the C core is told about a problem: plain arrays, no expressions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.kernel.elimination import Positions, eliminate
from rumo.kernel.tape import Tape
from rumo.signals import Array

VECTORS = ("y", "G", "defect")
MATRICES = ("A0", "M", "B", "Cx", "Cu", "D", "E")


@dataclass(frozen=True)
class StageProgram:
    """The terms of a linearised stage, M = I - A1 for the implicit part: how each nonzero is computed.

    Attributes
    ----------
    tape : Tape
        Computes the terms that vary from (z, x, u, p).
    fixed : ndarray, shape (slots,)
        Values of the constant terms, NaN for those that the tape computes.
    first : mapping of str to int
        Slot of the first nonzero of each of `VECTORS` and `MATRICES`.
    positions : mapping of str to (row, column) pairs
        Structural nonzeros of each of `MATRICES`, sorted by rows.
    """

    tape: Tape
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
    tape : Tape
        The model.
    values : dict
        Everything, by the names of `rumo_problem`.
    """

    sizes: tuple[int, ...]
    tape: Tape
    values: dict[str, Any]


SIZES = ("horizon", "states", "inputs", "outputs", "constraints", "parameters", "delay", "slots")


def describe(stage: StageProgram, sizes: Mapping[str, int], values: Mapping[str, Array]) -> Description:
    """All that `rumo_problem` asks for, by its names.

    Parameters
    ----------
    stage : StageProgram
        The model.
    sizes : mapping of str to int
        horizon, states, inputs, outputs, constraints, parameters, delay.
    values : mapping of str to ndarray
        Weights, limits and scales.
    """
    description: dict[str, Any] = dict(sizes)
    description |= {"slots": len(stage.fixed), "registers": stage.tape.registers}
    description |= {"code": stage.tape.code, "constants": stage.tape.constants, "fixed": stage.fixed}
    for name in MATRICES:
        places = np.array(stage.positions[name], dtype=np.int32).reshape(-1, 2)
        description[f"{name}_row"], description[f"{name}_column"] = places[:, 0].copy(), places[:, 1].copy()
        description[f"{name}_first"] = stage.first[name]
    description |= {f"{name}_first": stage.first[name] for name in ("y", "G")}
    description |= eliminate(stage.first, stage.positions, sizes["states"], sizes["inputs"])
    for name, array in values.items():
        kind = np.int32 if array.dtype.kind in "bi" else np.float64
        description[name] = np.ascontiguousarray(array, dtype=kind)
    return Description(tuple(description[name] for name in SIZES), stage.tape, description)
