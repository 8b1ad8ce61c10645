"""Numbers of a problem in the making: the one place where they are entered and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import FARTHEST, UNITS, as_numbers, positive_number
from rumo.errors import ArgumentError, ShapeError, UnknownNameError
from rumo.model import Model
from rumo.numbers import ProblemNumbers
from rumo.signals import Array
from rumo.structure import Structure
from rumo.terms import Bounds, BoundsLike, Penalty, as_limits, check_penalty, stage_weights

NARROWEST = 1e-7
"""Least width of bounds that do not meet, over their distance from zero: a millionth of it is more than rounding."""


class Draft:
    """Numbers in the making, from nothing or from others; each entry is checked, and names its argument if it is wrong.

    Parameters
    ----------
    structure : Structure
        What they are the numbers of.
    numbers : ProblemNumbers, optional
        What stays where nothing else is entered.
    """

    def __init__(self, structure: Structure, numbers: ProblemNumbers | None = None) -> None:
        self._structure = structure
        N, ny, nu = len(structure.shares), len(structure.outputs), len(structure.model.inputs)
        nc = len(structure.rows)
        if numbers is not None:
            self._arrays = {field.name: getattr(numbers, field.name) for field in fields(numbers)}
        else:
            self._arrays: dict[str, Array] = {
                "shares": structure.shares,
                "tracking": np.zeros((N, ny)),
                "ranges": np.ones(ny),
                "moving": np.zeros((N, nu)),
                "input_scales": np.ones(nu),
                "input_lower": np.full((N, nu), -np.inf),
                "input_upper": np.full((N, nu), np.inf),
                "move_lower": np.full(nu, -np.inf),
                "move_upper": np.full(nu, np.inf),
                "limits": np.zeros((N, nc)),
                "constraint_scales": np.ones(nc),
                "stakes": np.array([structure.shares.sum() if row.bounded else 1.0 for row in structure.rows]),
                "prices": np.tile([[np.inf], [0.0]], nc),
                "chosen": np.full(nu, np.nan),
                "parameters": np.tile(structure.model.default_parameters, (N, 1)),
            }

    def weigh(self, name: str, value: object, argument: str) -> None:
        """Weights of a tracked output or an input's moves."""
        tracked, column = self._place(name, argument)
        values = stage_weights(value, argument, len(self._structure.shares), positive=not tracked)
        self._own("tracking" if tracked else "moving")[:, column] = values

    def span(self, name: str, value: object, argument: str) -> None:
        """Range of a tracked output or an input."""
        tracked, column = self._place(name, argument)
        self._own("ranges" if tracked else "input_scales")[column] = positive_number(value, argument)

    def _place(self, name: str, argument: str) -> tuple[bool, int]:
        """Whether a name is a tracked output's, else an input's, and its column."""
        outputs, inputs = self._structure.outputs, self._structure.model.inputs
        if name not in (*outputs, *inputs):
            raise UnknownNameError(argument.partition("[")[0], name, (*outputs, *inputs))
        return (True, outputs.index(name)) if name in outputs else (False, inputs.index(name))

    def bound(self, name: str, value: BoundsLike, argument: str) -> None:
        """Bounds of an input or of a state, whose penalty stays where none is given."""
        inputs, variables = self._structure.model.inputs, self._structure.model.variables
        if name not in (*inputs, *variables):
            raise UnknownNameError("bounds", name, (*inputs, *variables), "Bound anything else by constraints=.")
        lower, upper = as_limits(value, argument, len(self._structure.shares))
        if name in inputs:
            _refuse_penalty(value, argument)
            self._own("input_lower")[:, inputs.index(name)] = lower
            self._own("input_upper")[:, inputs.index(name)] = upper
            return
        rows = {row.side: j for j, row in enumerate(self._structure.rows) if row.bounded == name}
        for side, limits, word in ((1, upper, "upper"), (-1, lower, "lower")):
            if side not in rows and not np.isinf(limits).all():
                raise ArgumentError(
                    argument,
                    f"{word} bound {limits[np.isfinite(limits)][0]:g}",
                    f"none: the problem was made without {word} bound for {name!r}",
                    "Make it with one, as far away as you like, to have a row that can be changed.",
                )
            if side in rows and not np.isfinite(limits).all():
                raise ArgumentError(
                    argument,
                    f"{word} bound {limits[~np.isfinite(limits)][0]:g}",
                    "a finite bound at every stage where there is one at some",
                    "Give a number that the state never reaches.",
                )
        for side, limits in ((1, upper), (-1, lower)):
            if side in rows:
                self._own("limits")[:, rows[side]] = side * limits
                self._own("constraint_scales")[rows[side]] = _scale(lower, upper)
        if isinstance(value, Bounds) and value.penalty is not None:
            self._price(list(rows.values()), value.penalty, f"{argument}.penalty")

    def bound_moves(self, name: str, value: BoundsLike, argument: str) -> None:
        """Bounds of an input's moves."""
        i = self._structure.model.inputs.index(name, argument.partition("[")[0])
        _refuse_penalty(value, argument)
        lower, upper = (limits[0] for limits in as_limits(value, argument, 1))
        if not lower <= 0.0 <= upper:
            raise ArgumentError(
                argument,
                f"({lower:g}, {upper:g})",
                "an interval that contains 0",
                "An input must be allowed to stay where it is.",
            )
        if not self._structure.limited[i] and not np.isinf([lower, upper]).all():
            raise ArgumentError(
                argument,
                f"({lower:g}, {upper:g})",
                f"none: the problem was made without move bounds for {name!r}",
                "Make it with some, as wide as you like, to have rows that can be changed.",
            )
        self._own("move_lower")[i], self._own("move_upper")[i] = lower, upper

    def limit(self, name: str, value: object, argument: str) -> None:
        """Limits of a constraint given by an expression."""
        names = [row.name for row in self._structure.rows if not row.bounded]
        if name not in names:
            raise UnknownNameError("limits", name, names, "Limits of states and inputs change by bounds=.")
        values, N = as_numbers(value, argument), len(self._structure.shares)
        if values.shape not in ((), (N,)):
            raise ShapeError(
                argument, f"shape {values.shape}", f"one number, or {N}: one for each stage of the horizon"
            )
        if not np.isfinite(values).all():
            raise ArgumentError(argument, str(values.tolist()), "finite numbers")
        if not (np.abs(values) <= FARTHEST).all():
            raise ArgumentError(argument, str(values.tolist()), f"numbers of at most {FARTHEST:.4g}", UNITS)
        self._own("limits")[:, names.index(name)] = values

    def penalise(self, name: str, penalty: Penalty | None, argument: str) -> None:
        """Penalty of a constraint, or of both bounds of a state; None makes them hard."""
        rows = list(enumerate(self._structure.rows))
        found = [j for j, row in rows if row.name == name] or [j for j, row in rows if name and row.bounded == name]
        if not found:
            known = [known for _, row in rows for known in (row.bounded, row.name) if known]
            raise UnknownNameError("penalties", name, dict.fromkeys(known))
        self._price(found, penalty, argument)

    def choose_safe_input(self, values: Mapping[str, float]) -> None:
        """Safe input of those named."""
        inputs = self._structure.model.inputs
        numbers = inputs.finite_vector(values, "safe_input", np.zeros(len(inputs)))
        for name in values:
            self._own("chosen")[inputs.index(name)] = numbers[inputs.index(name)]

    def set_parameters(self, values: Mapping[str, ArrayLike]) -> None:
        """Parameters of the model."""
        self._arrays["parameters"] = parameter_table(self._structure.model, self._arrays["parameters"], values)

    def finished(self) -> ProblemNumbers:
        """The numbers, if they can hold together and be scaled."""
        self._place_safe_input()
        bounded = self._changed("input_lower", "input_upper")
        scaled = self._changed("tracking", "ranges", "moving", "input_scales", "constraint_scales", "prices")
        numbers = ProblemNumbers(**self._arrays)
        if bounded:
            self._check_blocks(numbers)
        if scaled:
            self._check_scaled(numbers)
        if scaled or bounded or self._changed("move_lower", "move_upper", "limits", "chosen"):
            self._check_limits(numbers)
        return numbers

    def _own(self, name: str) -> Array:
        """An array to write to; those of others cannot be."""
        if not self._arrays[name].flags.writeable:
            self._arrays[name] = self._arrays[name].copy()
        return self._arrays[name]

    def _changed(self, *names: str) -> bool:
        return any(self._arrays[name].flags.writeable for name in names)

    def _place_safe_input(self) -> None:
        """Within the bounds of the first interval whose input is free."""
        d = self._structure.delay
        lower, upper = self._arrays["input_lower"][d], self._arrays["input_upper"][d]
        chosen = self._arrays["chosen"]
        for i in np.flatnonzero((chosen < lower) | (chosen > upper)):
            raise ArgumentError(
                f"safe_input[{self._structure.model.inputs.names[i]!r}]",
                f"{chosen[i]:g}",
                f"a value within the bounds ({lower[i]:g}, {upper[i]:g})",
            )
        self._arrays["safe_input"] = np.where(np.isnan(chosen), np.clip(np.zeros(len(chosen)), lower, upper), chosen)

    def _check_blocks(self, numbers: ProblemNumbers) -> None:
        """Whether the bounds of all intervals of a block leave it a value."""
        d, inputs = self._structure.delay, self._structure.model.inputs
        lower, upper = self._structure.blocks.bounds(numbers.input_lower[d:], numbers.input_upper[d:])
        for block, i in np.argwhere(lower > upper):
            raise ArgumentError(
                f"bounds[{inputs.names[i]!r}]",
                f"at least {lower[block, i]:g} and at most {upper[block, i]:g} within block {block + 1} of the inputs",
                "bounds that leave the block a value",
                "Let bounds change where a block begins, or make blocks shorter.",
            )

    def _check_scaled(self, numbers: ProblemNumbers) -> None:
        """Whether weights and prices stay numbers over ranges or scales."""
        structure = self._structure
        signals = (("track", structure.outputs), ("moves", structure.model.inputs))
        tracked, moved = ([f"{argument}[{name!r}]" for name in names] for argument, names in signals)
        rows = [f"bounds[{row.bounded!r}]" if row.bounded else f"constraints[{row.name!r}]" for row in structure.rows]
        with np.errstate(all="ignore"):
            columns = (
                (tracked, numbers.tracking, numbers.ranges, numbers.output_weights),
                (moved, numbers.moving, numbers.input_scales, numbers.move_weights),
                (rows, numbers.prices[:1], numbers.constraint_scales, numbers.l1[None]),
                (rows, numbers.prices[1:], numbers.constraint_scales, numbers.l2[None]),
            )
        for names, given, ranges, scaled in columns:
            lost = (given > 0.0) & (given < np.inf) & ~((scaled >= np.finfo(float).tiny) & (scaled < np.inf))
            lost |= np.isnan(scaled) | ~np.isfinite(ranges)
            for k, j in np.argwhere(lost):
                raise ArgumentError(
                    names[j],
                    f"{given[k, j]:g} for a range of {ranges[j]:g}",
                    "weights, penalties and ranges whose ratio is a number",
                    UNITS,
                )

    def _check_limits(self, numbers: ProblemNumbers) -> None:
        """Whether limits stay numbers over ranges and scales, in whose units they hold."""
        structure = self._structure
        inputs = structure.model.inputs.names
        rows = [
            f"bounds[{row.bounded!r}]" if row.bounded else f"constraints[{row.name!r}].limit" for row in structure.rows
        ]
        bounds, moves = ([f"{argument}[{name!r}]" for name in inputs] for argument in ("bounds", "move_bounds"))
        safe = [f"safe_input[{name!r}]" for name in inputs]
        columns = (
            (bounds, numbers.input_lower, numbers.input_scales),
            (bounds, numbers.input_upper, numbers.input_scales),
            (moves, numbers.move_lower[None], numbers.input_scales),
            (moves, numbers.move_upper[None], numbers.input_scales),
            (safe, numbers.safe_input[None], numbers.input_scales),
            (rows, numbers.limits, numbers.constraint_scales),
        )
        for names, limits, scales in columns:
            with np.errstate(all="ignore"):
                lost = np.isfinite(limits) & ~np.isfinite(limits / scales)
            for k, j in np.argwhere(lost):
                given = f"{limits[k, j]:g} for a range of {scales[j]:g}"
                raise ArgumentError(names[j], given, "limits and ranges whose ratio is a number", UNITS)

    def _price(self, rows: Sequence[int], penalty: Penalty | None, argument: str) -> None:
        check_penalty(penalty, argument)
        self._own("prices")[:, rows] = [[np.inf], [0.0]] if penalty is None else [[penalty.l1], [penalty.l2]]


def parameter_table(model: Model, table: Array, values: Mapping[str, ArrayLike], argument: str = "parameters") -> Array:
    """A table of parameters (N, np_) in which `values` replace those they name."""
    table = table.copy()
    for name, value in values.items():
        column, numbers = model.parameters.index(name, argument), as_numbers(value, f"{argument}[{name!r}]")
        if numbers.shape not in ((), (len(table),)):
            raise ShapeError(
                f"{argument}[{name!r}]",
                f"shape {numbers.shape}",
                f"one number, or {len(table)}: one for each interval of the horizon",
            )
        if not np.isfinite(numbers).all():
            raise ArgumentError(f"{argument}[{name!r}]", str(numbers.tolist()), "a finite number")
        table[:, column] = numbers
    return table


def _scale(lower: Array, upper: Array) -> float:
    """Scale of bounds: their width where it is largest, or their distance from zero where they have none, or else 1."""
    finite = np.concatenate([limits[np.isfinite(limits)] for limits in (lower, upper)])
    farthest = float(np.abs(finite).max(initial=0.0))
    width = float((upper - lower).max())
    return max(width, NARROWEST * farthest) if 0.0 < width < np.inf else farthest or 1.0


def _refuse_penalty(value: BoundsLike, argument: str) -> None:
    if isinstance(value, Bounds) and value.penalty is not None:
        raise ArgumentError(
            argument,
            "a penalty on an input",
            "hard bounds for inputs",
            "Actuators have hard limits; remove the penalty.",
        )
