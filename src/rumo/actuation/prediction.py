"""Models that know of the actuators before their inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from rumo.actuation.actuator import Actuation, Actuator
from rumo.checks import checked
from rumo.errors import ArgumentError
from rumo.model import Algebraic, Expression, Model, Output, Parameter
from rumo.signals import NamedSymbols, Signals


def with_actuators(model: Model, actuation: Actuation) -> Model:
    """A model of which each input is the command of an actuator, for predictions and estimators.

    States `<input>_lag` for a lag, `<input>_late` and `<input>_later` for a dead time, all in the input's unit; at rest
    the first two are the command, and the last is 0. What all inputs share of dead time, and the time to compute, are
    left out: `Problem.delay` and the loop see to these exactly. Limits of rate are left to move bounds.

    Parameters
    ----------
    model : Model
        Of the system behind the actuators.
    actuation : Actuation
        Of its inputs.

    Returns
    -------
    Model
        With the same inputs, parameters, algebraic variables and outputs; `model` itself if no state is needed. Its
        outputs see what the actuators do; in constraints of a problem `u` is the command, unless they are
        `behind_actuators`.

    Raises
    ------
    ArgumentError
        If an input is unknown, or a name is taken.

    Notes
    -----
    A dead time T is the Pade approximation `(1 - sT/3) / (1 + 2sT/3 + (sT)^2/6)` of exp(-sT). The one of equal degrees
    would answer a step at once, which no actuator with a dead time does, and which a controller would make use of.
    """
    checked(model, "model", Model)
    checked(actuation, "actuation", Actuation).check(model.inputs, "actuation")
    chains = _chains(actuation, model.inputs)
    added = {state: model.inputs.unit(name) for name, chain in chains.items() for state in chain.states}
    if not added:
        return model
    for state in added:
        if state in model.states:  # others are found out by the new model itself
            raise ArgumentError("model", f"a state {state!r}", "another name", "That is what the actuator's is called.")
    model_of = _Inner(model, chains)

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        rates = model_of.rows(model.f, x, u, p)
        own = dict(zip(model.states, ca.vertsplit(rates), strict=True))
        return own | {state: rate for name, chain in chains.items() for state, rate in chain.rates(x, u[name]).items()}

    return Model(
        states=_units(model.states) | added,
        inputs=_units(model.inputs),
        dynamics=dynamics,
        parameters={
            name: Parameter(unit, float(default))
            for (name, unit), default in zip(_units(model.parameters).items(), model.default_parameters, strict=True)
        },
        outputs={
            name: Output(unit, model_of.expression(model.expression(name, "model")))
            for name, unit in _units(model.outputs).items()
        },
        algebraic={
            name: Algebraic(unit, model_of.equation(i), float(model.algebraic_guess[i]))
            for i, (name, unit) in enumerate(_units(model.algebraic).items())
        },
        name=model.name,
    )


def behind_actuators(expression: Expression, actuation: Actuation, inputs: Signals) -> Expression:
    """An expression `(x, u, p)` of a constraint, for a model `with_actuators`: its u is what these do."""
    checked(actuation, "actuation", Actuation).check(inputs, "actuation")
    chains = _chains(actuation, inputs)
    return lambda x, u, p: expression(x, _Acting(chains, x, u), p)


def _chains(actuation: Actuation, inputs: Signals) -> dict[str, _Chain]:
    shared = actuation.least_dead_time(inputs)
    return {name: _Chain(name, actuation.of(name), shared) for name in inputs}


class _Chain:
    """States between the command of an input and the input: dead time beyond what is shared, then lag."""

    def __init__(self, name: str, actuator: Actuator, shared: float) -> None:
        self._lag, self._dead = actuator.lag, actuator.dead_time - shared
        self._names = f"{name}_late", f"{name}_later", f"{name}_lag"
        late, lag = self._names[:2] if self._dead > 0.0 else (), self._names[2:] if self._lag > 0.0 else ()
        self.states: tuple[str, ...] = (*late, *lag)

    def output(self, x: NamedSymbols, command: Any) -> Any:
        """What reaches the system."""
        return x[self._names[2]] if self._lag > 0.0 else self._arrived(x, command)

    def rates(self, x: NamedSymbols, command: Any) -> dict[str, Any]:
        """Derivatives of the states."""
        rates: dict[str, Any] = {}
        late, later, lag = self._names
        if self._dead > 0.0:
            # With v = late and w = later = T v': T^2/6 v'' + 2T/3 v' + v = command, of which v - w/3 arrives.
            rates[late] = x[later] / self._dead
            rates[later] = (6.0 * (command - x[late]) - 4.0 * x[later]) / self._dead
        if self._lag > 0.0:
            rates[lag] = (self._arrived(x, command) - x[lag]) / self._lag
        return rates

    def _arrived(self, x: NamedSymbols, command: Any) -> Any:
        return x[self._names[0]] - x[self._names[1]] / 3.0 if self._dead > 0.0 else command


class _Acting(NamedSymbols):
    """Inputs that are what actuators make of commands."""

    def __init__(self, chains: Mapping[str, _Chain], x: NamedSymbols, u: NamedSymbols) -> None:
        inputs = Signals(dict.fromkeys(chains, "1"), "inputs")
        super().__init__(inputs, ca.vertcat(*(chain.output(x, u[name]) for name, chain in chains.items())))


class _Inner:
    """Functions of a model, of the symbols of one that has its variables, and chains before its inputs."""

    def __init__(self, model: Model, chains: Mapping[str, _Chain]) -> None:
        self._model, self._chains = model, chains

    def rows(self, function: Any, x: NamedSymbols, u: NamedSymbols, p: NamedSymbols) -> Any:
        """A function of (xz, u, p)."""
        model = self._model
        acting = _Acting(self._chains, x, u)
        inputs = [acting[name] for name in model.inputs]
        variables, parameters = [x[name] for name in model.variables], [p[name] for name in model.parameters]
        return function(*(ca.vertcat(ca.SX(0, 1), *part) for part in (variables, inputs, parameters)))

    def expression(self, expression: Any) -> Expression:
        """A scalar expression of the model's symbols, as models are written."""
        function = self._model.packed([expression])
        return lambda x, u, p: self.rows(function, x, u, p)

    def equation(self, i: int) -> Expression:
        """One of the algebraic equations."""
        return lambda x, u, p: self.rows(self._model.g, x, u, p)[i]


def _units(signals: Any) -> dict[str, str]:
    return dict(zip(signals.names, signals.units, strict=True))
