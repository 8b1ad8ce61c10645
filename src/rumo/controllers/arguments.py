"""Checks of what a controller is told at a sample, for all engines."""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers
from rumo.errors import ArgumentError, ShapeError, UnknownNameError
from rumo.problem import Problem
from rumo.signals import Array

FLOAT = np.dtype(float)
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
        allowed = followed(problem)
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


def followed(problem: Problem) -> dict[str, None]:
    """Names of all that a reference may tell, in order."""
    model = problem.model
    return dict.fromkeys((*problem.outputs, *model.states, *model.inputs, *model.outputs))


def tracked(problem: Problem, reference: ReferenceWindow, allowed: Set[str] = frozenset()) -> Array:
    """The reference of the tracked outputs (N + 1, ny), contiguous; `allowed` are names known to be `followed`."""
    named: Any = reference
    if not (isinstance(named, dict) and named.keys() <= allowed and _is_window(problem, named)):
        named = reference_window(problem, reference)
    wanted = np.empty((problem.horizon + 1, len(problem.outputs)))
    for i, name in enumerate(problem.outputs):
        wanted[:, i] = named[name]
    return wanted


def _is_window(problem: Problem, named: Mapping[str, Any]) -> bool:
    """Whether a reference is one as `reference_window` returns it: floats at each stage, of all tracked outputs.

    So they come in closed loops; what is wrong with others is for that function to say.
    """
    shape = (problem.horizon + 1,)
    for values in named.values():
        if type(values) is not np.ndarray or values.dtype is not FLOAT or values.shape != shape:
            return False
    return all(name in named for name in problem.outputs)
