"""From samples to a log: an xarray.Dataset with names and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.checks import as_numbers, checked, finite_number, whole_number
from rumo.controllers import Controller
from rumo.controllers.arguments import ReferenceWindow, reference_window
from rumo.draft import parameter_table
from rumo.errors import ArgumentError, ShapeError, UnknownNameError
from rumo.interrupts import interruptible
from rumo.model import Model
from rumo.plan import Plan
from rumo.signals import Array, NamedArray, Signals, Values
from rumo.simulation.computed import completed, limits_at
from rumo.simulation.foreign import ForeignPlant, PlantLike, as_plant
from rumo.simulation.plant import Plant
from rumo.simulation.rows import of_health, of_innovation, of_plan
from rumo.simulation.sample import Sample
from rumo.simulation.variables import (
    ACTUATED,
    MONITORED,
    OBSERVED,
    OTHERS,
    RESCUED,
    TEXTS,
    TIMES,
    UNITLESS,
    VARIABLES,
)
from rumo.version import __version__

if TYPE_CHECKING:
    import xarray as xr


class Recorder:
    """Collects the samples of a run, a `ClosedLoop`'s or your own, and turns them into a log.

    Parameters
    ----------
    controller : Controller
        Names the states, inputs, outputs and constraints.
    plant : Model, Plant, PlantLike or str, optional
        Names the plant's states and parameters; there are none without one.
    measured : Signals, or mapping of str to str, optional
        What is measured, and in which unit; the states of the controller's model if not given.
    observed : Model, optional
        Whose states are estimated, if not the controller's model.
    actuated : bool
        Whether the plant gets something else than what is applied.
    monitors : Signals, or mapping of str to str, optional
        Names of what finds delays, and their unit.
    seed : int
        Of the run.
    """

    def __init__(
        self,
        controller: Controller,
        plant: Model | Plant | ForeignPlant | PlantLike | str | None = None,
        *,
        measured: Signals | Mapping[str, str] | None = None,
        observed: Model | None = None,
        actuated: bool = False,
        monitors: Signals | Mapping[str, str] | None = None,
        seed: int = 0,
    ) -> None:
        self._controller = checked(controller, "controller", Controller)
        problem = controller.problem
        model, nothing = problem.model, Signals({}, "nothing")
        if not isinstance(measured, Signals):
            measured = model.states if measured is None else Signals(measured, "measured")
        if plant is not None and not isinstance(plant, Plant | ForeignPlant):
            plant = as_plant(plant, problem.sampling_time)
        further = {name: measured.unit(name) for name in measured if name not in model.states}
        self._plant, self._seed = plant, whole_number(seed, "seed", 0, most=np.inf)
        self._measured = measured
        self._signals = {
            "state": model.states,
            "input": model.inputs,
            "output": problem.outputs,
            "constraint": problem.constraint_names,
            "plant_state": plant.states if plant else nothing,
            "parameter": plant.parameters if plant else nothing,
            "measurement": measured,
            "measured_output": Signals(further, "measured outputs"),
            "model_parameter": model.parameters,
        }
        self._variables = VARIABLES | (ACTUATED if actuated else {})
        if observed is not None:
            self._variables |= OBSERVED
            self._signals["observed_state"] = observed.states
        if monitors:
            self._variables |= MONITORED
            self._signals["monitor"] = monitors if isinstance(monitors, Signals) else Signals(monitors, "monitors")
        self._rows: list[dict[str, Any]] = []

    def add(
        self,
        plan: Plan | None,
        *,
        time: float,
        measured: Values | NamedArray | None = None,
        estimated: Values | NamedArray | None = None,
        applied: Values | NamedArray | None = None,
        reference: ReferenceWindow | None = None,
        **others: Any,
    ) -> None:
        """Record a sample. Mappings may leave signals out; NaN is what the log says of them.

        What is given is copied, so it may change afterwards; what does not fit raises, and is not recorded.

        Parameters
        ----------
        plan : Plan or None
            What the controller answered; None where it did not run.
        time : float
            Of the sample, later than that of the one before [s].
        measured : mapping or array_like (m,), optional
            What was measured.
        estimated : mapping or array_like (nx,), optional
            What the controller was told; what was measured if not given.
        applied : mapping or array_like (nu,), optional
            What is applied from now to the next sample.
        reference : mapping of str to float or array_like (N + 1,), or array_like (N + 1, ny), optional
            Wanted outputs, as the controller was told.
        others : mapping or array_like
            Other variables of a log, by their names: `plant`, `disturbance`, `received`, `parameters`,
            `estimated_deviation`, `estimated_parameters`, `estimated_biases`, `true_states`, `true_outputs`; and
            `innovation`, an `Innovation`.
        """
        signals = self._signals
        time = finite_number(time, "time")
        if self._rows and time <= self._rows[-1]["time"]:
            raise ArgumentError("time", f"{time:g} s", f"one after the last sample's, {self._rows[-1]['time']:g} s")
        if plan is not None:
            checked(plan, "plan", Plan, "It is what controller.step(...) returns.")
        for name in others:
            if name not in OTHERS or name not in self._variables:
                known = ("measured", "estimated", "applied", "reference", *OTHERS)
                raise UnknownNameError("Recorder.add", name, known)
        said = self._vector(self._measured, measured, "measured")
        got = self._vector(self._measured, others.pop("received", measured), "received")
        row: dict[str, Any] = {
            "time": time,
            "applied": self._vector(signals["input"], applied, "applied"),
            "reference": self._wanted(reference),
        }
        for name, values in (("measured", said), ("received", got)):
            known = dict(zip(self._measured, values.tolist(), strict=True))
            row[name] = np.array([known.get(key, np.nan) for key in signals["state"]])
            row[f"{name}_outputs"] = np.array([known[key] for key in signals["measured_output"]])
        told = row["received"] if estimated is None else estimated
        row["estimated"] = self._vector(signals["state"], told, "estimated")
        parameters = others.pop("parameters", {})
        if isinstance(parameters, Mapping):
            parameters = parameter_table(self._controller.problem.model, self._controller.parameters, parameters)
        row["parameters"] = parameters
        row["numbers"] = self._controller.problem.numbers
        others |= of_innovation(others.pop("innovation", None))
        row["nis"] = others.pop("nis", None)
        for name, values in others.items():
            row[name] = self._vector(signals[self._variables[name][0][-1]], values, name)
        row |= of_plan(plan) | of_health(plan, self._signals["state"])
        for name, (dims, _) in self._variables.items():
            if name not in TEXTS:
                row[name] = self._copied(name, dims, row.get(name))
        self._rows.append(row)

    def record(self, sample: Sample) -> None:
        """Record a sample of a `ClosedLoop`."""
        covariance, estimate = sample.covariance, sample.estimate
        deviations = None
        if covariance is not None:
            deviations = dict(zip(sample.observed.signals, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        others: dict[str, Any] = {}
        if "observed" in self._variables:
            others |= {"observed": sample.observed, "observed_deviation": deviations, "true_observed": sample.true}
            deviations = deviations and {n: v for n, v in deviations.items() if n in self._signals["state"]}
        for name, values in (("actuated", sample.actuated), ("found_delay", sample.delays)):
            if name in self._variables:
                others[name] = values
        self.add(
            sample.plan,
            time=sample.time,
            measured=sample.measured,
            received=sample.received,
            estimated=sample.estimated,
            applied=sample.applied,
            reference=sample.reference,
            plant=sample.plant,
            disturbance=sample.disturbance,
            parameters=sample.parameters,
            estimated_deviation=deviations,
            estimated_parameters={
                n: v for n, v in estimate.parameters.items() if n in self._signals["model_parameter"]
            },
            estimated_biases=estimate.biases,
            innovation=estimate.innovation,
            true_states=sample.states,
            true_outputs=sample.outputs,
            **others,
        )
        self._rows[-1]["numbers"] = sample.numbers

    def log(self) -> xr.Dataset:
        """Everything recorded, dimensions named, units in attributes and in a `..._unit` coordinate."""
        import xarray as xr  # heavy; a controller alone does without it

        problem = self._controller.problem
        model = problem.model
        columns = {
            name: self._column(name, dims, str if name in TEXTS else float)
            for name, (dims, _) in self._variables.items()
        }
        with interruptible():
            numbers = [row["numbers"] for row in self._rows]
            if self._rows:
                columns |= completed(problem, columns, numbers)
            limits = limits_at(problem, numbers)
        data: dict[str, Any] = {}
        for name, (dims, meaning) in self._variables.items():
            attributes = {"long_name": meaning}
            if name in UNITLESS or (dims and name not in TEXTS):
                attributes["units"] = "1" if name in UNITLESS else _unit_list(self._signals[dims[-1]])
            data[name] = (("time", *dims), columns[name], attributes)
        for name in TIMES:
            data[name] = (("time",), self._column(name), {"units": "s", "long_name": name})
        data["rescued"] = (("time",), self._column("rescued", kind=bool), {"long_name": RESCUED})
        coordinates: dict[str, Any] = {
            "time": ("time", self._column("time"), {"units": "s", "long_name": "time"}),
            "stage": np.arange(problem.horizon + 1),
            "interval": np.arange(problem.horizon),
        }
        for dim, names in self._signals.items():
            coordinates[dim] = (dim, np.array(names.names, dtype=str))
            coordinates[f"{dim}_unit"] = (dim, np.array(names.units, dtype=str))
        for dim, sides in limits.items():
            for side, values in zip(("lower", "upper"), sides, strict=True):
                coordinates[f"{dim}_{side}"] = (("time", dim), values, {"units": _unit_list(self._signals[dim])})
        plant_name = self._plant.name if self._plant else "a plant"
        attributes = {
            "title": f"{plant_name} under {self._controller.name}",
            "controller": self._controller.name,
            "model": model.name,
            "plant_model": plant_name,
            "seed": self._seed if self._seed < 2**63 else str(self._seed),  # more than a file takes as a number
            "sampling_time_s": problem.sampling_time,
            "horizon": problem.horizon,
            "delay": problem.delay,
            "rumo_version": __version__,
        }
        return xr.Dataset(data, coordinates, attributes)

    def _wanted(self, reference: ReferenceWindow | None) -> Array:
        """Wanted outputs now (ny,)."""
        outputs = self._signals["output"]
        if reference is None or isinstance(reference, Mapping | NamedArray):
            given: Any = reference.as_dict() if isinstance(reference, NamedArray) else reference or {}
            reference = dict.fromkeys(outputs, np.nan) | dict(given)
        window = reference_window(self._controller.problem, reference)
        return np.array([window[name][0] for name in outputs])

    def _vector(self, signals: Signals, values: Any, argument: str) -> Array:
        nothing = np.full(len(signals), np.nan)
        if values is None:
            return nothing
        return signals.vector(values.as_dict() if isinstance(values, NamedArray) else values, argument, nothing)

    def _column(self, name: str, dims: tuple[str, ...] = (), kind: type = float) -> Any:
        return np.array([row[name] for row in self._rows], dtype=kind).reshape(len(self._rows), *self._shape(dims))

    def _shape(self, dims: tuple[str, ...]) -> tuple[int, ...]:
        N = self._controller.problem.horizon
        sizes = {"stage": N + 1, "interval": N}
        return tuple(sizes[dim] if dim in sizes else len(self._signals[dim]) for dim in dims)

    def _copied(self, name: str, dims: tuple[str, ...], values: Any) -> Array:
        """A variable of a sample, NaN for None; a vector is that of every interval."""
        shape = self._shape(dims)
        if values is None:
            return np.full(shape, np.nan)
        array = as_numbers(values, name)
        if array.shape not in (shape, shape[1:]):
            raise ShapeError(name, f"shape {array.shape}", f"shape {shape}")
        return np.broadcast_to(array, shape).copy()


def _unit_list(signals: Signals) -> str:
    return ", ".join(f"{name}: {signals.unit(name)}" for name in signals)
