"""The control problem: what is wanted over the horizon, never how it is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, as_numbers, checked, checked_items, positive_number, whole_number
from rumo.errors import ArgumentError, FrozenError, ShapeError, UnknownNameError
from rumo.grid import Grid, InputBlocks, MoveBlocks
from rumo.model import Model
from rumo.sealed import Sealed
from rumo.signals import Array, Signals
from rumo.terms import Bounds, BoundsLike, Constraint, Penalty, Weight, as_bounds, check_penalty


@dataclass(frozen=True)
class PathConstraint:
    """A constraint as the transcription sees it: one row `G <= 0`, in a unit, of a typical size `scale`."""

    name: str
    unit: str
    scale: float
    row: Any
    penalty: Penalty | None


class Problem(Sealed):
    """Optimal control problem over a moving horizon.

    Minimises, over the free inputs `u_d ... u_{N-1}` with d = `delay`,
    `sum_i |y_i - r_i|^2_Q (i = 1..N) + sum_i |u_i - u_{i-1}|^2_R (i = d..N-1)` plus the penalties of
    soft constraints.

    Parameters
    ----------
    model : Model
        What is controlled.
    horizon : int or Grid
        Number N of intervals of one sampling time each, or intervals of other lengths, of which the first d + 1 are one
        sampling time long.
    sampling_time : float
        Time from one sample to the next [s].
    track : mapping of str to Weight
        Weight of the error of each tracked state or output; at the end of an interval twice as long as a sampling time
        it counts twice.
    moves : mapping of str to Weight
        Positive weight of each input's increment; every input has one, which makes the problem strictly convex.
    bounds : mapping of str to Bounds or (lower, upper), optional
        Of inputs (always hard), states and algebraic variables.
    move_bounds : mapping of str to Bounds or (lower, upper), optional
        Of input increments from one interval to the next.
    constraints : mapping of str to Constraint, optional
        Path constraints `G(x_i, u_{i-1}) <= 0`, by name.
    delay : int
        Number d of samples between a measurement and the first input computed from it; 0 <= d < N.
    safe_input : mapping of str to float, optional
        Where the inputs go when no plan is left; 0, or the nearest bound, where not given.
    parameters : mapping of str to float or sequence of float, length N, optional
        Values of the model's parameters, on the whole horizon or on each interval; their defaults where not given.
    blocks : MoveBlocks, optional
        Intervals over which inputs, or their increments, are held; none if not given.

    Attributes
    ----------
    horizon : int
        N.
    steps, times : ndarray, shapes (N,), (N + 1,)
        Length of each interval, and time of each stage from now [s].
    parameters : ndarray, shape (N, np_)
        Their values on each interval.

    Raises
    ------
    ArgumentError
        On any value that cannot work; the message names argument, value and cure.
    """

    def __init__(
        self,
        model: Model,
        *,
        horizon: int | Grid,
        sampling_time: float,
        track: Mapping[str, Weight],
        moves: Mapping[str, Weight],
        bounds: Mapping[str, BoundsLike] | None = None,
        move_bounds: Mapping[str, BoundsLike] | None = None,
        constraints: Mapping[str, Constraint] | None = None,
        delay: int = 0,
        safe_input: Mapping[str, float] | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        blocks: MoveBlocks | None = None,
    ) -> None:
        self.model = checked(model, "model", Model)
        self.sampling_time = positive_number(sampling_time, "sampling_time")
        self.horizon = len(horizon.steps) if isinstance(horizon, Grid) else whole_number(horizon, "horizon", 1)
        self.delay = whole_number(delay, "delay", 0)
        if self.delay >= self.horizon:
            raise ArgumentError(
                "delay", str(delay), f"less than the horizon of {self.horizon}", "Otherwise no input is left to choose."
            )
        self.steps, self.times = self._stages(horizon if isinstance(horizon, Grid) else None)
        self.blocks = self._blocks(blocks)

        track = checked_items(track, "track", Weight, "rumo.Weight(1.0, range=...)")
        moves = checked_items(moves, "moves", Weight, "rumo.Weight(1.0, range=...)")
        if not track:
            raise ArgumentError("track", "nothing", "at least one state or output to track")
        self.output_rows = [model.expression(name, "track") for name in track]
        self.outputs = Signals({name: model.unit(name) for name in track}, "tracked outputs")
        self.output_weights = np.column_stack([self._weight(track[name], f"track[{name!r}]") for name in track])
        self.output_weights *= self.steps[:, None] / self.sampling_time

        for name in moves:
            model.inputs.index(name, "moves")
        for name in model.inputs:
            if name not in moves:
                raise ArgumentError(
                    "moves", f"no weight for {name!r}", "a positive weight for each input", "Add rumo.Weight(...)."
                )
        self.move_weights = np.column_stack(
            [self._weight(moves[name], f"moves[{name!r}]", positive=True) for name in model.inputs]
        )
        weights = [as_numbers(weight.value, "weight") for weight in (*track.values(), *moves.values())]
        self.cost_scale = max(float(weight.max()) for weight in weights)
        self.input_scales = np.array([moves[name].range for name in model.inputs], dtype=float)

        bounds = as_mapping(bounds, "bounds")
        for name in bounds:
            if name not in model.states and name not in model.algebraic and name not in model.inputs:
                raise UnknownNameError(
                    "bounds",
                    name,
                    (*model.inputs, *model.states, *model.algebraic),
                    "Bound anything else by constraints=.",
                )
        on_states = {name: as_bounds(bounds[name], f"bounds[{name!r}]") for name in bounds if name not in model.inputs}
        on_inputs = {name: bounds[name] for name in bounds if name in model.inputs}
        self.input_lower, self.input_upper = self._input_limits(on_inputs, "bounds")
        self.move_lower, self.move_upper = self._input_limits(as_mapping(move_bounds, "move_bounds"), "move_bounds")
        for i, name in enumerate(model.inputs):
            if not self.move_lower[i] <= 0.0 <= self.move_upper[i]:
                raise ArgumentError(
                    f"move_bounds[{name!r}]",
                    f"({self.move_lower[i]:g}, {self.move_upper[i]:g})",
                    "an interval that contains 0",
                    "An input must be allowed to stay where it is.",
                )

        self.constraints = self._path_constraints(
            on_states, checked_items(constraints, "constraints", Constraint, "rumo.Constraint(lambda x, u, p: ...)")
        )
        self.constraint_names = Signals({item.name: item.unit for item in self.constraints}, "constraints")
        self.constraint_scales = np.array([item.scale for item in self.constraints])
        self.safe_input = self._safe_input(as_mapping(safe_input, "safe_input"))
        self.parameters = self.parameter_table(as_mapping(parameters, "parameters"))
        self._protect()

    def __setattr__(self, name: str, value: Any) -> None:
        if self._constructed and not name.startswith("_") and name in set(self._known()):
            raise FrozenError(
                f"Problem.{name} cannot be set. Write problem.changed(weights=..., bounds=...) for a problem with "
                "other numbers; what is no number needs a new Problem."
            )
        super().__setattr__(name, value)

    def _protect(self) -> None:
        # Controllers build on these numbers once; a change would reach some and not others.
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def __getstate__(self) -> dict[str, Any]:
        # Expressions pickle as a function of the model's symbols.
        rows = self.model.packed([*self.output_rows, *(item.row for item in self.constraints)])
        return vars(self) | {"output_rows": rows, "constraints": [replace(item, row=None) for item in self.constraints]}

    def __setstate__(self, state: dict[str, Any]) -> None:
        model: Model = state["model"]
        rows, ny = model.unpacked(state["output_rows"]), len(state["outputs"])
        constraints = zip(state["constraints"], rows[ny:], strict=True)
        restored = {"output_rows": rows[:ny], "constraints": tuple(replace(item, row=row) for item, row in constraints)}
        vars(self).update(state | restored)
        self._protect()

    @property
    def uniform(self) -> bool:
        """Whether all intervals are one sampling time long."""
        return bool((self.steps == self.sampling_time).all())

    @property
    def block_move_weights(self) -> Array:
        """Weight of each block's move (nb, nu): what its intervals' moves cost together."""
        squares = self.blocks.moves()[:, None] ** 2 * self.move_weights[self.delay :]
        return np.add.reduceat(squares, self.blocks.first)

    @property
    def block_move_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of each block's move (nb, nu)."""
        # The largest move of an interval within a block, over the block's.
        largest = np.maximum.reduceat(self.blocks.moves(), self.blocks.first)[:, None]
        return self.move_lower / largest, self.move_upper / largest

    def parameter_table(self, values: Mapping[str, ArrayLike], argument: str = "parameters") -> Array:
        """Parameter values (N, np_), finite, defaults where `values` leaves one out."""
        table = np.tile(self.model.default_parameters, (self.horizon, 1))
        for name, value in values.items():
            column, numbers = self.model.parameters.index(name, argument), as_numbers(value, f"{argument}[{name!r}]")
            if numbers.shape not in ((), (self.horizon,)):
                raise ShapeError(
                    f"{argument}[{name!r}]",
                    f"shape {numbers.shape}",
                    f"one number, or {self.horizon}: one for each interval of the horizon",
                )
            if not np.isfinite(numbers).all():
                raise ArgumentError(f"{argument}[{name!r}]", str(numbers.tolist()), "a finite number")
            table[:, column] = numbers
        return table

    def _stages(self, grid: Grid | None) -> tuple[Array, Array]:
        """Length of each interval and time of each stage [s]."""
        if grid is None:
            return np.full(self.horizon, self.sampling_time), self.sampling_time * np.arange(self.horizon + 1)
        steps = np.array(grid.steps)
        ahead = steps[: self.delay + 1]
        if not np.allclose(ahead, self.sampling_time, rtol=1e-9, atol=0.0):
            raise ArgumentError(
                "horizon",
                f"a grid that begins with steps of {', '.join(f'{step:g}' for step in ahead)} s",
                f"{len(ahead)} of the sampling time, {self.sampling_time:g} s",
                "Inputs of the first intervals are applied for a sampling time each: see Grid.geometric(equal=...).",
            )
        steps[: self.delay + 1] = self.sampling_time
        return steps, np.concatenate([[0.0], np.cumsum(steps)])

    def _blocks(self, blocks: MoveBlocks | None) -> MoveBlocks:
        free = self.horizon - self.delay
        if blocks is None:
            return InputBlocks([1] * free)
        blocks = checked(blocks, "blocks", MoveBlocks, "Write rumo.InputBlocks([1, 1, 2, 4]).")
        if sum(blocks.lengths) != free:
            raise ArgumentError(
                "blocks",
                f"{sum(blocks.lengths)} intervals in all",
                f"{free}: the horizon of {self.horizon} without the delay of {self.delay}",
            )
        return blocks

    def _weight(self, weight: Weight, argument: str, *, positive: bool = False) -> Array:
        """Stage weights (N,), divided by the squared range."""
        span = positive_number(weight.range, f"{argument}.range")
        values = as_numbers(weight.value, argument)
        if values.ndim == 0:
            values = np.full(self.horizon, float(values))
        if values.shape != (self.horizon,):
            raise ShapeError(
                argument, f"{values.size} weights", f"one weight, or {self.horizon}: one for each stage of the horizon"
            )
        if not np.all(np.isfinite(values)) or np.any(values < 0.0) or (positive and np.any(values <= 0.0)):
            kind = "positive" if positive else "non-negative"
            raise ArgumentError(argument, f"weight {weight.value!r}", f"{kind} finite numbers")
        return values / span**2

    def _input_limits(self, bounds: Mapping[str, BoundsLike], argument: str) -> tuple[Array, Array]:
        inputs = self.model.inputs
        lower, upper = np.full(len(inputs), -np.inf), np.full(len(inputs), np.inf)
        for name, value in bounds.items():
            i, bound = inputs.index(name, argument), as_bounds(value, f"{argument}[{name!r}]")
            if bound.penalty is not None:
                raise ArgumentError(
                    f"{argument}[{name!r}]",
                    "a penalty on an input",
                    "hard bounds for inputs",
                    "Actuators have hard limits; remove the penalty.",
                )
            lower[i], upper[i] = bound.lower, bound.upper
        return lower, upper

    def _path_constraints(
        self, bounds: Mapping[str, Bounds], constraints: Mapping[str, Constraint]
    ) -> tuple[PathConstraint, ...]:
        rows: list[PathConstraint] = []
        for name, constraint in constraints.items():
            argument = f"constraints[{name!r}]"
            if not callable(constraint.expression):
                raise ArgumentError(argument, repr(constraint.expression), "a function (x, u, p) -> expression")
            check_penalty(constraint.penalty, f"{argument}.penalty")
            row = self.model.scalar(constraint.expression(*self.model.symbols), argument)
            if not self.model.depends(row):
                raise ArgumentError(
                    argument, f"{row}, which neither states nor inputs change", "an expression of states or inputs"
                )
            rows.append(PathConstraint(name, "1", 1.0, row, constraint.penalty))
        for name, bound in bounds.items():
            check_penalty(bound.penalty, f"bounds[{name!r}].penalty")
            state, unit = self.model.expression(name, "bounds"), self.model.unit(name)
            limits = [abs(limit) for limit in (bound.lower, bound.upper) if np.isfinite(limit)]
            width = sum(limits) if bound.lower < 0.0 < bound.upper else max(limits, default=0.0)
            scale = width or 1.0
            if np.isfinite(bound.upper):
                rows.append(PathConstraint(f"{name}_upper", unit, scale, state - bound.upper, bound.penalty))
            if np.isfinite(bound.lower):
                rows.append(PathConstraint(f"{name}_lower", unit, scale, bound.lower - state, bound.penalty))
        names = [row.name for row in rows]
        for name in constraints:
            if names.count(name) > 1:
                raise ArgumentError(f"constraints[{name!r}]", "a name that a state bound uses", "another name")
        return tuple(rows)

    def _safe_input(self, values: Mapping[str, float]) -> Array:
        inputs = self.model.inputs
        zero = np.clip(np.zeros(len(inputs)), self.input_lower, self.input_upper)
        safe = inputs.finite_vector(values, "safe_input", zero)
        for i, name in enumerate(inputs):
            if not self.input_lower[i] <= safe[i] <= self.input_upper[i]:
                raise ArgumentError(
                    f"safe_input[{name!r}]",
                    f"{safe[i]:g}",
                    f"a value within the bounds ({self.input_lower[i]:g}, {self.input_upper[i]:g})",
                )
        return safe

    def __repr__(self) -> str:
        return (
            f"Problem({self.model.name}: horizon {self.horizon} x {self.sampling_time:g} s, delay {self.delay}, "
            f"{len(self.constraints)} path constraints)"
        )
