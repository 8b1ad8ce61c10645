"""A run as a tree of named parts, and the same run with other parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from inspect import signature
from typing import Any

import numpy as np

from rumo.controllers import RealTimeIteration
from rumo.errors import ArgumentError, UnknownNameError
from rumo.model import Model
from rumo.problem import Problem
from rumo.registry import CONTROLLERS, MODELS
from rumo.scenarios.kinds import hints_of
from rumo.scenarios.numbers import numbers_of, renumbered
from rumo.simulation import Constant, Scenario
from rumo.simulation.foreign import as_plant
from rumo.vehicles import VehicleParameters

PLANT = "plant"
"""Part of a scenario that has the parameters of its plant by their names."""
DISTURBANCES = "disturbances"
WHOLE = (VehicleParameters, Model)
"""Dataclasses and others that are taken as they are: what they decide would not follow."""


class Closed(dict[str, Any]):
    """Parts by names of which there are no others; any other mapping takes further ones."""


def parts_of(value: Any) -> dict[str, Any] | None:
    """Parts by name; None of what has none."""
    if isinstance(value, Scenario):
        return _of_scenario(value)
    if isinstance(value, Problem):
        return {name: Closed(numbers) for name, numbers in numbers_of(value).items()}
    if isinstance(value, Mapping):
        return {key: Closed(item) if isinstance(item, dict) else item for key, item in value.items()}
    if isinstance(value, range):
        return {"from": value.start, "to": value.stop, "samples": len(value)}
    if isinstance(value, tuple | list):
        return {str(i): item for i, item in enumerate(value)}
    if not is_dataclass(value) or isinstance(value, (type, *WHOLE)):
        return None
    own = {item.name: getattr(value, item.name) for item in fields(value) if item.init}
    scenario = own.get("scenario")
    return own if not isinstance(scenario, Scenario) else _of_scenario(scenario) | _beside(own)


def with_parts(value: Any, parts: Mapping[str, Any]) -> Any:
    """The same with other parts, which are checked by what they are parts of."""
    if isinstance(value, Scenario):
        return _scenario_with(value, parts)
    if isinstance(value, Problem):
        now = numbers_of(value)
        return renumbered(value, {name: _differing(now[name], numbers) for name, numbers in parts.items()})
    if isinstance(value, Mapping):
        return type(value)({**value, **parts}) if isinstance(value, dict) else {**value, **parts}
    if isinstance(value, range):
        return _range_with(value, parts)
    if isinstance(value, tuple | list):
        return type(value)(parts.get(str(i), item) for i, item in enumerate(value))
    own, inner = {item.name: getattr(value, item.name) for item in fields(value) if item.init}, dict(parts)
    scenario = own.get("scenario")
    if isinstance(scenario, Scenario):
        of_scenario = {name: inner.pop(name) for name in parts if name not in _beside(own)}
        inner["scenario"] = _scenario_with(scenario, of_scenario) if of_scenario else scenario
    return replace(value, **inner)


def _range_with(value: range, parts: Mapping[str, Any]) -> range:
    """Samples from one on, until another or so many."""
    first, last = parts.get("from", value.start), parts.get("to", value.stop)
    if "samples" not in parts:
        none_yet = "to" not in parts and not len(value)  # and none from another one on either
        return range(first, first if none_yet else last)
    count = parts["samples"]
    if count < 0:
        raise ArgumentError("samples", str(count), "a number of at least 0")
    if "to" in parts and last != first + count:
        raise ArgumentError("samples", f"{count} beside from = {first} and to = {last}", "only one of samples and to")
    return range(first, first + count)


def _differing(now: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in wanted.items() if name not in now or value != now[name]}


def hint_of(value: Any, name: str) -> Any:
    """Type of a part, as far as it is known; None if it is not."""
    scenario = getattr(value, "scenario", None)
    if isinstance(scenario, Scenario) and name not in _names(type(value)):
        value = scenario
    return hints_of(type(value)).get(name) if is_dataclass(value) else None


def _names(kind: type) -> set[str]:
    return {item.name for item in fields(kind)}


def _beside(own: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and texts that a run has beside its scenario."""
    return {name: value for name, value in own.items() if isinstance(value, bool | int | float | str)}


def _of_scenario(scenario: Scenario) -> dict[str, Any]:
    own = {item.name: getattr(scenario, item.name) for item in fields(scenario)}
    known, disturbances = plant_signals(scenario), scenario.disturbances
    varied = {name: each.value if isinstance(each, Constant) else None for name, each in disturbances.items()}
    return own | {
        "x": Closed(_values(scenario.x, known.states)),
        "applied": _applied(scenario),
        "settings": controller_settings(scenario),
        PLANT: Closed({name: varied.get(name, value) for name, value in known.parameters.items()}),
    }


def _scenario_with(scenario: Scenario, parts: Mapping[str, Any]) -> Scenario:
    changes = dict(parts)
    if PLANT in changes:
        now = _of_scenario(scenario)[PLANT]
        others = {name: Constant(value) for name, value in changes.pop(PLANT).items() if value != now[name]}
        changes[DISTURBANCES] = dict(changes.get(DISTURBANCES, scenario.disturbances)) | others
    if DISTURBANCES in changes:
        parameters = plant_signals(scenario).parameters
        for name, value in changes[DISTURBANCES].items():
            if name not in parameters:
                raise UnknownNameError(f"{DISTURBANCES}.{name}", name, parameters)
            changes[DISTURBANCES][name] = Constant(value) if isinstance(value, int | float) else value
    if CONTROLLERS.get(changes.get("controller", "rti"), RealTimeIteration) is not RealTimeIteration:
        changes.setdefault("backend", None)  # of the real-time iteration: the others have one each
    if "settings" in changes and is_dataclass(changes["settings"]):
        changes["settings"] = _options(scenario, changes["settings"])
    return replace(scenario, **changes)


def controller_settings(scenario: Scenario) -> Any:
    """Settings of the controller, as it would be made; a mapping of what is given where its class does not tell."""
    given = scenario.settings
    if given is not None and not isinstance(given, Mapping):
        return given
    default = _default_settings(scenario)
    own = {item.name for item in fields(default)} if is_dataclass(default) else set[str]()
    known = {name: value for name, value in (given or {}).items() if name in own}
    return replace(default, **known) if own else dict(given or {})  # pyright: ignore[reportArgumentType]


def _default_settings(scenario: Scenario) -> Any:
    kind: Any = scenario.controller
    kind = CONTROLLERS[kind] if isinstance(kind, str) else kind
    parameter = signature(kind).parameters.get("settings")
    return None if parameter is None else parameter.default


def _options(scenario: Scenario, settings: Any) -> Any:
    """Settings in the form in which a scenario has them: single ones in a mapping, if it does not have all."""
    given = scenario.settings
    if given is not None and not isinstance(given, Mapping):
        return settings
    default = _default_settings(scenario)
    own = {item.name: getattr(settings, item.name) for item in fields(settings)}
    return dict(given or {}) | {name: value for name, value in own.items() if value != getattr(default, name)}


@dataclass(frozen=True)
class PlantSignals:
    """What can be said of a plant by name.

    Attributes
    ----------
    states : tuple of str
        Of the plant.
    parameters : dict of str to float
        Their defaults.
    """

    states: tuple[str, ...]
    parameters: dict[str, float]


def plant_signals(scenario: Scenario) -> PlantSignals:
    """States and parameters of the plant of a scenario."""
    plant: Any = scenario.plant
    plant = _registered(plant) if isinstance(plant, str) else plant
    if not hasattr(plant, "default_parameters"):
        plant = as_plant(plant, scenario.problem.sampling_time)
    return PlantSignals(
        tuple(plant.states), dict(zip(plant.parameters, plant.default_parameters.tolist(), strict=True))
    )


@lru_cache(maxsize=16)
def _registered(name: str) -> Model:
    return MODELS[name]()


def _values(values: Any, names: tuple[str, ...]) -> Any:
    """Values by name."""
    return dict(values) if isinstance(values, Mapping) else dict(zip(names, np.ravel(values).tolist(), strict=False))


def _applied(scenario: Scenario) -> Any:
    """Inputs before the start by name; as it is given where they differ from sample to sample."""
    model, given = scenario.problem.model, scenario.applied
    if given is None:
        given = scenario.problem.safe_input
    shape = None if isinstance(given, Mapping) else np.shape(given)
    return Closed(_values(given, model.inputs.names)) if shape is None or len(shape) == 1 else given
