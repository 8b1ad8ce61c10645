"""Numbers of a problem as mappings of mappings, and a problem with others."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from rumo.problem import Problem
from rumo.signals import Array
from rumo.terms import Bounds, Penalty

Numbers = dict[str, dict[str, Any]]


def numbers_of(problem: Problem) -> Numbers:
    """Numbers of a problem as `Problem.changed` names them; a list where stages or intervals differ."""
    numbers, model = problem.numbers, problem.model
    outputs, inputs = tuple(problem.outputs), tuple(model.inputs)
    rows = list(enumerate(problem.rows))
    limited = [i for i in range(len(inputs)) if np.isfinite([numbers.move_lower[i], numbers.move_upper[i]]).any()]
    return {
        "weights": {
            **{name: _number(numbers.tracking[:, i]) for i, name in enumerate(outputs)},
            **{name: _number(numbers.moving[:, i]) for i, name in enumerate(inputs)},
        },
        "ranges": dict(
            zip((*outputs, *inputs), [*numbers.ranges.tolist(), *numbers.input_scales.tolist()], strict=True)
        ),
        "bounds": _bounds(problem),
        "move_bounds": {
            inputs[i]: {"lower": float(numbers.move_lower[i]), "upper": float(numbers.move_upper[i])} for i in limited
        },
        "limits": {row.name: _number(numbers.limits[:, j]) for j, row in rows if not row.bounded},
        "penalties": {
            row.name: {"l1": float(numbers.prices[0, j]), "l2": float(numbers.prices[1, j])} for j, row in rows
        },
        "safe_input": dict(zip(inputs, numbers.safe_input.tolist(), strict=True)),
        "parameters": {name: _number(numbers.parameters[:, i]) for i, name in enumerate(model.parameters)},
    }


def _bounds(problem: Problem) -> dict[str, Any]:
    """Of inputs, and of states that have any."""
    numbers, found = problem.numbers, dict[str, Any]()
    for i, name in enumerate(problem.model.inputs):
        found[name] = {"lower": _number(numbers.input_lower[:, i]), "upper": _number(numbers.input_upper[:, i])}
    for j, row in enumerate(problem.rows):
        if row.bounded:
            side = "upper" if row.side > 0 else "lower"
            found.setdefault(row.bounded, {})[side] = _number(row.side * numbers.limits[:, j])
    return found


def renumbered(problem: Problem, changes: Mapping[str, Mapping[str, Any]]) -> Problem:
    """A problem with other numbers, the same object for the same changes: controllers are made once for each.

    Parameters
    ----------
    problem : Problem
        Whose other numbers stay.
    changes : mapping of str to mapping
        As `numbers_of` has them.

    Raises
    ------
    ArgumentError
        On any value that cannot work.
    """
    changes = {argument: items for argument, items in changes.items() if items}
    return _renumbered(problem, _frozen(changes)) if changes else problem


@lru_cache(maxsize=64)
def _renumbered(problem: Problem, changes: Any) -> Problem:
    known = {argument: dict(items) for argument, items in changes}
    for argument, kind in (("bounds", _as_bounds), ("move_bounds", _as_bounds), ("penalties", _as_penalty)):
        if argument in known:
            known[argument] = {name: kind(dict(value)) for name, value in known[argument].items()}
    return problem.changed(**known)


def _as_bounds(sides: Mapping[str, Any]) -> Bounds:
    return Bounds(sides.get("lower", -np.inf), sides.get("upper", np.inf))


def _as_penalty(prices: Mapping[str, Any]) -> Penalty | None:
    return None if prices["l1"] == np.inf else Penalty(prices["l1"], prices["l2"])


def _frozen(value: Any) -> Any:
    if isinstance(value, Mapping):
        return tuple((key, _frozen(item)) for key, item in value.items())
    return tuple(value) if isinstance(value, list) else value


def _number(values: Array) -> float | list[float]:
    return float(values[0]) if (values == values[0]).all() else values.tolist()
