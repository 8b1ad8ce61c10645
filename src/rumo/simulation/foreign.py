"""Plants that are no models: another simulator, a recording, hardware."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from inspect import signature
from math import isclose
from typing import Any, Protocol, runtime_checkable

import numpy as np

from rumo.checks import checked_items, positive_number
from rumo.errors import ArgumentError, PlantError, UnknownNameError
from rumo.model import Model, Parameter
from rumo.registry import MODELS
from rumo.signals import Array, Signals
from rumo.simulation.plant import Plant


@runtime_checkable
class PlantLike(Protocol):
    """Anything that can be driven.

    It goes on by parts of a sample, as dead times and late sensors may need, if `advance` has a further argument
    `duration` [s], and there is no attribute `divisible` that is False. It may also have a `name`; `parameters`, a
    mapping from names to `rumo.Parameter` for disturbances to act on; `outputs`, a mapping from names to units, with a
    method `observe(x, u, p) -> mapping` that gives their values; a `sampling_time`, which is then compared with the
    problem's; and `reset()`, called before a run.

    Attributes
    ----------
    states, inputs : mapping of str to str
        Unit of each signal, in vector order.
    """

    states: Any
    inputs: Any

    def advance(self, x: Array, u: Array, p: Array) -> Array:
        """State (nx,) one sampling time after x (nx,), with input u (nu,) and parameters p (np_,) held."""
        ...


class ForeignPlant:
    """A `PlantLike` with all that a `Plant` has.

    Parameters
    ----------
    plant : PlantLike
        What advances.
    sampling_time : float
        Of the loop, for plants without their own [s].

    Attributes
    ----------
    divisible : bool
        Whether it goes on by parts of a sample.
    """

    def __init__(self, plant: PlantLike, sampling_time: float) -> None:
        self._plant = plant
        self.name = str(getattr(plant, "name", type(plant).__name__))
        self.states, self.inputs = _signals(plant.states, "states"), _signals(plant.inputs, "inputs")
        self.outputs = _signals(getattr(plant, "outputs", {}), "outputs")
        for name in self.outputs:
            if name in self.states:
                raise ArgumentError("plant.outputs", f"{name!r}, a state", "other names than those of states")
        if len(self.outputs) and not callable(getattr(plant, "observe", None)):
            raise ArgumentError("plant", "outputs without observe", "a method observe(x, u, p) -> mapping of outputs")
        parameters = checked_items(
            getattr(plant, "parameters", {}), "parameters", Parameter, 'rumo.Parameter("kg", 1.0)'
        )
        self.parameters = Signals({name: item.unit for name, item in parameters.items()}, "parameters")
        self.default_parameters: Array = np.array([item.default for item in parameters.values()], dtype=float)
        self.sampling_time = positive_number(getattr(plant, "sampling_time", sampling_time), "plant.sampling_time")
        self.divisible = bool(getattr(plant, "divisible", True)) and "duration" in signature(plant.advance).parameters

    def reset(self) -> None:
        """Begin a run."""
        reset = getattr(self._plant, "reset", None)
        if reset is not None:
            reset()

    def advance(self, x: Array, u: Array, p: Array, duration: float | None = None) -> Array:
        """State one sampling time later, or a duration [s], see `PlantLike`."""
        part: dict[str, Any] = {} if duration is None else {"duration": duration}
        end = self.states.vector(self._plant.advance(x.copy(), u.copy(), p.copy(), **part), "plant.advance()")
        if not np.isfinite(end).all():
            raise PlantError(f"The plant left the finite numbers from x = {x.tolist()}, u = {u.tolist()}")
        return end

    def observer(self, names: tuple[str, ...]) -> Callable[[Array, Array, Array], Array]:
        """Function `(x, u, p) -> (n,)` of states and outputs."""
        for name in names:
            if name not in self.states and name not in self.outputs:
                raise UnknownNameError("plant", name, (*self.states, *self.outputs))
        plant: Any = self._plant

        def observe(x: Array, u: Array, p: Array) -> Array:
            known = dict(zip(self.states, x.tolist(), strict=True))
            if any(name in self.outputs for name in names):
                outputs = self.outputs.vector(plant.observe(x.copy(), u.copy(), p.copy()), "plant.observe()")
                known |= zip(self.outputs, outputs.tolist(), strict=True)
            return np.array([known[name] for name in names], dtype=float)

        return observe


def _signals(units: Mapping[str, str] | Signals, role: str) -> Signals:
    return units if isinstance(units, Signals) else Signals(units, role)


def check_plant(plant: object) -> None:
    """Raise unless it can be a plant: a name in the registry, a model, a `Plant`, anything `PlantLike`."""
    if isinstance(plant, str):
        if plant not in MODELS:
            raise UnknownNameError("plant", plant, MODELS)
    elif not isinstance(plant, Model | PlantLike) or isinstance(plant, type):
        expected = "a rumo.Model, or anything with states, inputs and advance(x, u, p)"
        raise ArgumentError("plant", repr(plant), expected)


def parameters_of(plant: Model | Plant | PlantLike | str) -> Mapping[str, Parameter]:
    """Parameters of a plant as they were given, by name; of one that is a name, nothing."""
    if isinstance(plant, Plant):
        plant = plant.model
    if isinstance(plant, Model):
        return plant.parameter_items
    given = getattr(plant, "parameters", None)
    items = given.items() if isinstance(given, Mapping) else ()
    return {name: item for name, item in items if isinstance(item, Parameter)}


def as_plant(plant: Any, sampling_time: float) -> Plant | ForeignPlant:
    """A plant from whatever can be one; of a `Plant` a copy, so that no two loops share a memory."""
    check_plant(plant)
    if isinstance(plant, str):
        plant = MODELS[plant]()
    if isinstance(plant, Model):
        return Plant(plant, sampling_time)
    plant = copy(plant) if isinstance(plant, Plant) else ForeignPlant(plant, sampling_time)
    if not isclose(plant.sampling_time, sampling_time):
        raise ArgumentError(
            "plant", f"a sampling time of {plant.sampling_time:g} s", f"the problem's {sampling_time:g} s"
        )
    return plant
