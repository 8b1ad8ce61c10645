"""What varies about a plant in a run, by the clock and by its state."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from rumo.checks import as_numbers, finite_number
from rumo.errors import ArgumentError, ShapeError
from rumo.model import Parameter
from rumo.signals import Array, Signals, read_only
from rumo.simulation.place import DisturbanceByState
from rumo.simulation.wind import Constant, Disturbance


def check_disturbance(disturbance: object, argument: str, parameter: Parameter | None = None) -> None:
    """Raise unless it is a disturbance, and if constant, of a value that the parameter can have."""
    if isinstance(disturbance, type) or not isinstance(disturbance, Disturbance | DisturbanceByState):
        cure = f"Write Constant({disturbance!r})." if isinstance(disturbance, int | float) else ""
        expected = "a disturbance such as rumo.simulation.Constant(9.81), with sample(times, rng) or start(states)"
        raise ArgumentError(argument, repr(disturbance), expected, cure)
    if parameter is not None and isinstance(disturbance, Constant):
        parameter.check(disturbance.value, argument)


class Disturbances:
    """Parameters of a plant, sample by sample.

    Parameters
    ----------
    sources : mapping of str to Disturbance or DisturbanceByState
        By the parameters' names.
    default : ndarray, shape (np_,)
        Of the others.
    parameters, states : Signals
        Of the plant.
    times : ndarray, shape (K,)
        Of the samples [s].
    rng : Generator
        Of all that is drawn.
    """

    def __init__(
        self,
        sources: Mapping[str, Disturbance | DisturbanceByState],
        default: Array,
        parameters: Signals,
        states: Signals,
        times: Array,
        rng: np.random.Generator,
    ) -> None:
        values = np.tile(default, (len(times), 1))
        self._by_state: list[tuple[int, str, Callable[[Array], float]]] = []
        for name, source in sources.items():
            column, argument = parameters.index(name), f"disturbances[{name!r}]"
            if isinstance(source, Disturbance):
                values[:, column] = _sampled(source, argument, times.copy(), rng)
            else:
                value = source.start(states)
                if not callable(value):
                    expected = "a function from a state (nx,) to a number"
                    raise ArgumentError(f"{argument}.start()", repr(value), expected)
                self._by_state.append((column, argument, value))
        self._values = read_only(values)

    def at(self, k: int, x: Array) -> Array:
        """Parameters (np_,) at sample k, of a plant in state x (nx,); read-only."""
        if not self._by_state:
            return self._values[k]
        values = self._values[k].copy()
        for column, argument, value in self._by_state:
            values[column] = finite_number(value(x.copy()), f"{argument}.start()(x)")
        return read_only(values)


def _sampled(disturbance: Disturbance, argument: str, times: Array, rng: np.random.Generator) -> Array:
    """Values (K,) of a disturbance, which may be of the user's making."""
    values = as_numbers(disturbance.sample(times, rng), f"{argument}.sample()")
    if values.shape not in ((), times.shape):
        raise ShapeError(f"{argument}.sample()", f"shape {values.shape}", f"shape {times.shape}: a value for each time")
    if not np.isfinite(values).all():
        raise ArgumentError(f"{argument}.sample()", "NaN or infinity", "finite numbers")
    return values
