"""The structure of a problem: expressions and sizes, on which everything else is built once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rumo.errors import ArgumentError
from rumo.grid import MoveBlocks
from rumo.model import Model
from rumo.signals import Array, Signals
from rumo.terms import BoundsLike, Constraint, as_limits


@dataclass(frozen=True, eq=False)
class Row:
    """A path constraint `expression <= limit` without its numbers.

    Attributes
    ----------
    bounded : str
        The state or algebraic variable that it bounds; empty for a constraint given by an expression.
    side : int
        1 for an upper bound or an expression, -1 for a lower bound.
    """

    name: str
    unit: str
    expression: Any
    bounded: str = ""
    side: int = 1


@dataclass(frozen=True, eq=False)
class Structure:
    """What a problem is made of, without its numbers.

    Attributes
    ----------
    shares : ndarray, shape (N,)
        Length of each interval over the sampling time.
    limited : ndarray of bool, shape (nu,)
        Inputs whose moves are bounded.
    """

    model: Model
    shares: Array
    delay: int
    blocks: MoveBlocks
    outputs: Signals
    output_rows: tuple[Any, ...]
    rows: tuple[Row, ...]
    limited: np.ndarray

    def __getstate__(self) -> dict[str, Any]:
        # Expressions pickle as a function of the model's symbols.
        packed = self.model.packed([*self.output_rows, *(row.expression for row in self.rows)])
        return vars(self) | {"output_rows": packed, "rows": [replace(row, expression=None) for row in self.rows]}

    def __setstate__(self, state: dict[str, Any]) -> None:
        model: Model = state["model"]
        expressions, ny = model.unpacked(state["output_rows"]), len(state["outputs"])
        rows = [replace(row, expression=each) for row, each in zip(state["rows"], expressions[ny:], strict=True)]
        vars(self).update(state | {"output_rows": tuple(expressions[:ny]), "rows": tuple(rows)})


def rows_of(
    model: Model, horizon: int, bounds: Mapping[str, BoundsLike], constraints: Mapping[str, Constraint]
) -> tuple[Row, ...]:
    """A row for each constraint, then for each side of the bounds of a state."""
    rows: list[Row] = []
    for name, constraint in constraints.items():
        argument = f"constraints[{name!r}]"
        expression = model.written(constraint.expression, argument)
        if not model.depends(expression):
            raise ArgumentError(
                argument,
                f"{expression}, which neither states nor inputs change",
                "an expression of states or inputs",
            )
        rows.append(Row(name, "1", expression))
    for name, bound in bounds.items():
        if name not in model.variables:
            continue
        lower, upper = as_limits(bound, f"bounds[{name!r}]", horizon)
        expression, unit = model.expression(name, "bounds"), model.unit(name)
        if np.isfinite(upper).any():
            rows.append(Row(f"{name}_upper", unit, expression, name))
        if np.isfinite(lower).any():
            rows.append(Row(f"{name}_lower", unit, -expression, name, -1))
    names = [row.name for row in rows]
    for name in constraints:
        if names.count(name) > 1:
            raise ArgumentError(f"constraints[{name!r}]", "a name that a state bound uses", "another name")
    return tuple(rows)


def limited_moves(model: Model, move_bounds: Mapping[str, BoundsLike]) -> np.ndarray:
    """Which inputs' moves are bounded (nu,)."""
    limits = {name: as_limits(value, f"move_bounds[{name!r}]", 1) for name, value in move_bounds.items()}
    return np.array([name in limits and bool(np.isfinite(limits[name]).any()) for name in model.inputs])
