"""Checks of what a controller is told at a sample, for all engines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers
from rumo.errors import ArgumentError, ShapeError, UnknownNameError
from rumo.problem import Problem
from rumo.signals import Array

ReferenceWindow = Mapping[str, ArrayLike] | ArrayLike
Inputs = Mapping[str, float] | ArrayLike


def decided_inputs(problem: Problem, inputs: Inputs | None) -> Array:
    """Inputs already decided as (max(delay, 1), nu); the safe input for None."""
    model = problem.model
    shape = (max(problem.delay, 1), len(model.inputs))
    if inputs is None:
        array = problem.safe_input
    else:
        named = isinstance(inputs, Mapping)
        array = model.inputs.vector(inputs, "applied") if named else as_numbers(inputs, "applied")
    if array.shape not in (shape, shape[1:]):
        raise ShapeError("applied", f"shape {array.shape}", f"shape {shape} or {shape[1:]}")
    if not np.isfinite(array).all():
        raise ArgumentError("applied", f"{array.tolist()}", "finite inputs")
    return np.broadcast_to(array, shape).copy()


def reference_window(problem: Problem, reference: ReferenceWindow) -> dict[str, Array]:
    """Reference of each named signal over the horizon, (N + 1,): all tracked outputs, and others that are given."""
    length = problem.horizon + 1
    named: Mapping[str, Any]
    if isinstance(reference, Mapping):
        named = reference
        model = problem.model
        allowed = dict.fromkeys((*problem.outputs, *model.states, *model.inputs, *model.outputs))
        for name in named:
            if name not in allowed:
                raise UnknownNameError("reference", name, allowed)
        for name in problem.outputs:
            if name not in named:
                raise ArgumentError("reference", f"no values for {name!r}", "values for every tracked output")
    else:
        array = as_numbers(reference, "reference")
        if array.shape != (length, len(problem.outputs)):
            raise ShapeError(
                "reference", f"shape {array.shape}", f"({length}, {len(problem.outputs)}): N + 1 by tracked outputs"
            )
        named = dict(zip(problem.outputs, array.T, strict=True))
    window: dict[str, Array] = {}
    for name, values in named.items():
        array = as_numbers(values, f"reference[{name!r}]")
        if array.shape not in ((), (length,)):
            expected = f"one number or {length}, from now to t + N"
            raise ShapeError(f"reference[{name!r}]", f"shape {array.shape}", expected)
        window[name] = np.broadcast_to(array, (length,))
    return window


def tracked(problem: Problem, window: Mapping[str, Array]) -> Array:
    """The reference of the tracked outputs (N + 1, ny)."""
    return np.column_stack([window[name] for name in problem.outputs])
