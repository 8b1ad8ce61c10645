"""The control problem: what is wanted over the horizon; of how it is solved, at most which scheme suits it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, checked, checked_items, positive_number, whole_number
from rumo.discretization import Discretization
from rumo.draft import Draft, parameter_table
from rumo.errors import ArgumentError, FrozenError
from rumo.grid import Grid, MoveBlocks, blocks_of, stages_of
from rumo.measurements import Measurement, sensor_numbers
from rumo.model import Model
from rumo.numbers import PathConstraint, ProblemNumbers, path_constraints
from rumo.sealed import Sealed
from rumo.signals import Array, Signals
from rumo.structure import Row, Structure, limited_moves, rows_of
from rumo.terms import BoundsLike, Constraint, Penalty, Weight


class _Number:
    """An array of `Problem.numbers` under its own name."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, problem: Any, owner: type | None = None) -> Array:
        return self if problem is None else getattr(problem.numbers, self._name)  # pyright: ignore[reportReturnType]


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
        Number N of intervals of one sampling time each, or others, of which the first d + 1 are that long.
    sampling_time : float
        Time from one sample to the next [s].
    track : mapping of str to Weight
        Weight of the error of each tracked state or output; after an interval of two sampling times it counts twice.
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
    measurements : mapping of str to Measurement, optional
        What is known of the measurement of some states.
    discretization : Discretization, optional
        The scheme that suits it: of controllers that are not told another. Implicit Euler if not given.

    Attributes
    ----------
    horizon : int
        N.
    steps, times : ndarray, shapes (N,), (N + 1,)
        Length of each interval, and time of each stage from now [s].
    numbers : ProblemNumbers
        All that `changed` can change; its arrays are attributes of the problem too, such as `parameters` (N, np_).
    constraints : tuple of PathConstraint
        Path constraints given by expressions, then the bounds of states.
    sensors : SensorNumbers
        What is known of the measurement of each state; `sensors.turn` is 2 pi where it is an angle.

    Raises
    ------
    ArgumentError
        On any value that cannot work; the message names argument, value and cure.
    """

    numbers: ProblemNumbers
    constraints: tuple[PathConstraint, ...]
    output_weights = _Number()
    move_weights = _Number()
    input_scales = _Number()
    move_lower = _Number()
    move_upper = _Number()
    constraint_scales = _Number()
    safe_input = _Number()
    parameters = _Number()

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
        measurements: Mapping[str, Measurement] | None = None,
        discretization: Discretization | None = None,
    ) -> None:
        self.model = checked(model, "model", Model)
        self.discretization = discretization
        if discretization is not None:
            checked(discretization, "discretization", Discretization, "Write rumo.Radau2().")
        self.sampling_time = positive_number(sampling_time, "sampling_time")
        self.horizon = len(horizon.steps) if isinstance(horizon, Grid) else whole_number(horizon, "horizon", 1)
        self.delay = whole_number(delay, "delay", 0)
        if self.delay >= self.horizon:
            raise ArgumentError(
                "delay", str(delay), f"less than the horizon of {self.horizon}", "Otherwise no input is left to choose."
            )
        grid = horizon if isinstance(horizon, Grid) else None
        self.steps, self.times = stages_of(grid, self.horizon, self.sampling_time, self.delay)
        self.blocks = blocks_of(blocks, self.horizon, self.delay)

        track = checked_items(track, "track", Weight, "rumo.Weight(1.0, range=...)")
        moves = checked_items(moves, "moves", Weight, "rumo.Weight(1.0, range=...)")
        if not track:
            known = ", ".join((*model.states, *model.algebraic, *model.outputs))
            raise ArgumentError("track", "nothing", f"at least one of {known}", "Write {name: rumo.Weight(1.0)}.")
        self.output_rows = tuple(model.expression(name, "track") for name in track)
        self.outputs = Signals({name: model.unit(name) for name in track}, "tracked outputs")
        for name in moves:
            model.inputs.index(name, "moves")
        for name in model.inputs:
            if name not in moves:
                raise ArgumentError(
                    "moves", f"no weight for {name!r}", "a positive weight for each input", "Add rumo.Weight(...)."
                )
        bounds, move_bounds = as_mapping(bounds, "bounds"), as_mapping(move_bounds, "move_bounds")
        constraints = checked_items(constraints, "constraints", Constraint, "rumo.Constraint(lambda x, u, p: ...)")
        self._structure = Structure(
            model=model,
            shares=self.steps / self.sampling_time,
            delay=self.delay,
            blocks=self.blocks,
            outputs=self.outputs,
            output_rows=self.output_rows,
            rows=rows_of(model, self.horizon, bounds, constraints),
            limited=limited_moves(model, move_bounds),
        )
        self.sensors = sensor_numbers(self._structure, measurements)
        self.constraint_names = Signals({row.name: row.unit for row in self._structure.rows}, "constraints")
        draft = Draft(self._structure)
        for weights, argument in ((track, "track"), (moves, "moves")):
            for name, weight in weights.items():
                draft.span(name, weight.range, f"{argument}[{name!r}].range")
                draft.weigh(name, weight.value, f"{argument}[{name!r}]")
        for name, value in move_bounds.items():
            draft.bound_moves(name, value, f"move_bounds[{name!r}]")
        for name, value in bounds.items():
            draft.bound(name, value, f"bounds[{name!r}]")
        for name, constraint in constraints.items():
            draft.limit(name, constraint.limit, f"constraints[{name!r}].limit")
            draft.penalise(name, constraint.penalty, f"constraints[{name!r}].penalty")
        draft.choose_safe_input(as_mapping(safe_input, "safe_input"))
        draft.set_parameters(as_mapping(parameters, "parameters"))
        self._take(draft.finished())
        _protect(self)

    def changed(
        self,
        *,
        weights: Mapping[str, ArrayLike] | None = None,
        ranges: Mapping[str, float] | None = None,
        bounds: Mapping[str, BoundsLike] | None = None,
        move_bounds: Mapping[str, BoundsLike] | None = None,
        limits: Mapping[str, ArrayLike] | None = None,
        penalties: Mapping[str, Penalty | None] | None = None,
        safe_input: Mapping[str, float] | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> Problem:
        """The same problem with other numbers; nothing is built anew, and what is not named stays.

        Parameters
        ----------
        weights : mapping of str to float or sequence of float, length N
            Of tracked outputs and of inputs' moves.
        ranges : mapping of str to float
            Of the same.
        bounds : mapping of str to Bounds or (lower, upper)
            Of inputs, and of states that were made with such a bound; without a penalty, a state's stays as it is:
            `penalties` make it hard. Each may be N numbers: for a state at stages 1 to N, for an input on intervals
            1 to N.
        move_bounds : mapping of str to Bounds or (lower, upper)
            Of inputs whose moves were bounded when the problem was made.
        limits : mapping of str to float or sequence of float, length N
            Of constraints given by expressions.
        penalties : mapping of str to Penalty or None
            Of constraints, and of states for both of their bounds; None makes them hard.
        safe_input : mapping of str to float
            See `Problem`.
        parameters : mapping of str to float or sequence of float, length N
            See `Problem`.

        Raises
        ------
        ArgumentError
            On any value that cannot work, as when a problem is made.
        """
        if all(part is None for part in (weights, ranges, bounds, move_bounds, limits, penalties, safe_input)):
            # As references do at each sample.
            table = parameter_table(self.model, self.parameters, as_mapping(parameters, "parameters"))
            return self.renumbered(self.numbers.with_parameters(table))
        draft = Draft(self._structure, self.numbers)
        entries = (
            ("weights", weights, draft.weigh),
            ("ranges", ranges, draft.span),
            ("bounds", bounds, draft.bound),
            ("move_bounds", move_bounds, draft.bound_moves),
            ("limits", limits, draft.limit),
            ("penalties", penalties, draft.penalise),
        )
        for argument, values, enter in entries:
            for name, value in as_mapping(values, argument).items():
                enter(name, value, f"{argument}[{name!r}]")
        draft.choose_safe_input(as_mapping(safe_input, "safe_input"))
        draft.set_parameters(as_mapping(parameters, "parameters"))
        return self.renumbered(draft.finished())

    def renumbered(self, numbers: ProblemNumbers) -> Problem:
        """The same problem with the numbers of another of the same structure."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), numbers=numbers)
        if numbers.differences(self.numbers) != ["parameters"]:  # on which constraints do not depend
            other._take(numbers)
        return other

    @property
    def structure(self) -> Structure:
        """What all problems have in common that `changed` makes of one: the same object."""
        return self._structure

    def without_numbers(self) -> dict[str, Any]:
        """All that decides a problem but its numbers, as data that can be pickled."""
        return {name: value for name, value in self.__getstate__().items() if name != "numbers"}

    def _take(self, numbers: ProblemNumbers) -> None:
        vars(self)["numbers"] = numbers
        vars(self)["constraints"] = path_constraints(self._structure, numbers)

    def __setattr__(self, name: str, value: Any) -> None:
        if self._constructed and not name.startswith("_") and name in set(self._known()):
            raise FrozenError(
                f"Problem.{name} cannot be set. Write problem.changed(weights=..., bounds=...) for a problem with "
                "other numbers; what is no number needs a new Problem."
            )
        super().__setattr__(name, value)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name not in ("constraints", "output_rows")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        vars(self)["output_rows"] = self._structure.output_rows
        self._take(state["numbers"])
        _protect(self)

    @property
    def rows(self) -> tuple[Row, ...]:
        """The path constraints without their numbers: which state each bounds, and on which side."""
        return self._structure.rows

    @property
    def input_lower(self) -> Array:
        """Lower bounds of the inputs that hold on every interval (nu,)."""
        return self.numbers.input_lower.max(axis=0)

    @property
    def input_upper(self) -> Array:
        """Upper bounds of the inputs that hold on every interval (nu,)."""
        return self.numbers.input_upper.min(axis=0)

    @property
    def cost_scale(self) -> float:
        """The largest weight as given."""
        return self.numbers.cost_scale

    @property
    def uniform(self) -> bool:
        """Whether all intervals are one sampling time long."""
        return bool((self.steps == self.sampling_time).all())

    @property
    def block_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of each block's input (nb, nu): those of all intervals that it has a share in."""
        return self.blocks.bounds(self.numbers.input_lower[self.delay :], self.numbers.input_upper[self.delay :])

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

    def __repr__(self) -> str:
        return (
            f"Problem({self.model.name}: horizon {self.horizon} x {self.sampling_time:g} s, delay {self.delay}, "
            f"{len(self.constraints)} path constraints)"
        )


def _protect(problem: Problem) -> None:
    for value in vars(problem).values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
