"""What the C core is told about a problem: plain arrays, no expressions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.kernel._core import TABLES
from rumo.kernel.elimination import Equations, Positions, compose, eliminate, nothing_eliminated
from rumo.kernel.factor import factor
from rumo.kernel.tape import Tape
from rumo.signals import Array

VECTORS = ("y", "G", "defect")
MATRICES = ("A0", "M", "B", "Cx", "Cu", "D", "E")


@dataclass(frozen=True, eq=False)
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
    samples : callable
        M (points, nw, nw) at some points where the model may be: asked for only where it decides an order of pivots.
    """

    tape: Tape
    inner_tape: Tape | None
    fixed: Array
    first: Mapping[str, int]
    positions: Mapping[str, Positions]
    samples: Callable[[], Array]


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
        Everything, by the names of `members("rumo_problem")`.
    """

    sizes: tuple[int, ...]
    tape: Tape
    inner_tape: Tape
    values: dict[str, Any]


@dataclass(frozen=True)
class Member:
    """A member of a struct of the core, as its tables have it.

    Attributes
    ----------
    name : str
        What a description calls it: its own name after that of the part it belongs to, `tape_code` for `tape.code`.
    kind : str
        "count", "real", "ints" or "doubles".
    rows, columns : str
        Shape of an array, in C, in terms of the sizes s and of the members t of its part.
    """

    name: str
    kind: str
    rows: str
    columns: str


def members(struct: str, prefix: str = "") -> Iterator[Member]:
    """The members of a struct and of its parts, in the order of `rumo_tables.h`."""
    for name, kind, rows, columns, _ in TABLES[struct]:
        if kind in TABLES:
            yield from members(kind, part_prefix(prefix, name))
        else:
            yield Member(prefix + name, kind, rows, columns)


def part_prefix(prefix: str, part: str) -> str:
    """With what the names of a part's members begin: sizes, numbers and bounds have names of their own."""
    return prefix if part in ("sizes", "numbers", "bounds") else f"{prefix}{part}_"


SIZES = tuple(member.name for member in members("rumo_sizes"))
BOUNDS = tuple(member.name for member in members("rumo_bounds"))
"""What holds for the inputs whatever happens."""
NUMBERS = tuple(member.name for member in members("rumo_numbers"))
"""What may change between two samples."""


def describe(
    stage: StageProgram, sizes: Mapping[str, int], values: Mapping[str, Array], maps: bool = False
) -> Description:
    """All that `rumo_problem` asks for, by its names.

    Parameters
    ----------
    stage : StageProgram
        The model.
    sizes : mapping of str to int
        All of `SIZES` but slots, and `shift_same_rows`.
    values : mapping of str to ndarray
        Weights, limits, scales, and where intervals are after a sample; see `as_numbers`. Limits of constraints are 0
        where not given.
    maps : bool
        Whether there must be maps of the stages: else wide models, which are condensed then, have equations instead.
    """
    description: dict[str, Any] = dict(sizes)
    description |= {"slots": len(stage.fixed), "fixed": stage.fixed}
    inner_tape = stage.inner_tape or Tape.empty()
    for part, tape in (("tape", stage.tape), ("inner_tape", inner_tape)):
        description |= {f"{part}_code": tape.code, f"{part}_constants": tape.constants}
        description |= {f"{part}_length": len(tape.code), f"{part}_registers": tape.registers}
    for name in MATRICES:
        places = np.array(stage.positions[name], dtype=np.int32).reshape(-1, 2)
        description[f"{name}_row"], description[f"{name}_column"] = places[:, 0].copy(), places[:, 1].copy()
        description |= {f"{name}_first": stage.first[name], f"{name}_count": len(places)}
    description |= {f"{name}_first": stage.first[name] for name in VECTORS}
    rows, nx = sizes["states"] + sizes["algebraic"], sizes["states"]
    unknowns = rows + sizes["inner"]
    equations = Equations(stage.first, stage.positions, unknowns, nx, sizes["inputs"])
    wide = not (maps or sizes["explicit_scheme"]) and equations.wide(rows, sizes["blocks"] * sizes["inputs"])
    elimination = nothing_eliminated(unknowns) if wide else eliminate(equations, stage.samples)
    description["condensing"] = int(wide or sizes["condensing"])
    places = list(zip(elimination["elimination_row"].tolist(), elimination["elimination_column"].tolist(), strict=True))
    composition = compose(places if sizes["substeps"] > 1 else [], nx, rows)
    factors = factor(equations.blocks if wide or any(equations.sparse) else [], equations.left)
    description |= elimination | composition | factors
    description |= {
        "elimination_blocks": len(elimination["elimination_size"]),
        "elimination_entries": len(elimination["elimination_row"]),
        "composition_entries": len(composition["composition_row"]),
        "factor_unknowns": len(factors["factor_equation"]),
        "factor_blocks": len(factors["factor_size"]),
        "factor_outer": len(factors["factor_nonzero"]) - len(factors["factor_entry"]),
        "factor_inner": len(factors["factor_entry"]),
    }
    numbers = {"constraint_limits": np.zeros(sizes["constraints"])}
    numbers |= {name: values[name] for name in NUMBERS if name in values}
    description |= nothing_known(sizes) | {"output_states": np.full(sizes["outputs"], -1)}
    description |= dict(values) | as_numbers(sizes, numbers)
    for member in members("rumo_problem"):
        if member.kind in ("ints", "doubles"):
            kind = np.int32 if member.kind == "ints" else np.float64
            description[member.name] = np.ascontiguousarray(description[member.name], dtype=kind)
    return Description(tuple(int(description[name]) for name in SIZES), stage.tape, inner_tape, description)


def nothing_known(sizes: Mapping[str, int]) -> dict[str, Array]:
    """Members of `rumo_sensors` that say nothing."""
    values = {"turn": 0.0, "noise": 0.0, "resolution": 0.0, "age": 0, "lead": 0.0, "lowest": -np.inf, "highest": np.inf}
    return {f"sensors_{name}": np.full(sizes["states"], value) for name, value in values.items()}


def as_numbers(sizes: Mapping[str, int], values: Mapping[str, Array]) -> dict[str, Array]:
    """Members of `rumo_numbers` as the core wants them: bounds (nu,) and limits (nc,) hold on all intervals."""
    widths = {"input_lower": "inputs", "input_upper": "inputs", "constraint_limits": "constraints"}
    numbers = {name: np.asarray(array, dtype=float) for name, array in values.items()}
    for name in widths.keys() & numbers.keys():
        numbers[name] = np.broadcast_to(numbers[name], (sizes["horizon"], sizes[widths[name]]))
    return {name: np.ascontiguousarray(array) for name, array in numbers.items()}
