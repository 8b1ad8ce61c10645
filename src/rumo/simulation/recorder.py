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
from rumo.model import Model
from rumo.plan import Plan
from rumo.signals import Array, NamedArray, Signals, Values
from rumo.simulation.dataset import Log
from rumo.simulation.foreign import ForeignPlant, PlantLike, as_plant
from rumo.simulation.plant import Plant
from rumo.simulation.rows import Row, check_parts, of_innovation, of_plan
from rumo.simulation.sample import Sample
from rumo.simulation.variables import (
    ACTUATED,
    MONITORED,
    OBSERVED,
    OTHERS,
    VARIABLES,
)

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
        self._rows: list[Row] = []

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
        time = self._later(finite_number(time, "time"))
        if plan is not None:
            checked(plan, "plan", Plan, "It is what controller.step(...) returns.")
            check_parts(plan, self._controller.problem)
        for name in others:
            if name not in OTHERS or name not in self._variables:
                known = ("measured", "estimated", "applied", "reference", *OTHERS)
                raise UnknownNameError("Recorder.add", name, known)
        sensed = self._vector(self._measured, measured, "measured")
        arrived = self._vector(self._measured, others.pop("received", measured), "received")
        if estimated is None:
            readings = zip(self._measured, arrived.tolist(), strict=True)
            estimated = {name: value for name, value in readings if name in signals["state"]}
        parameters = others.pop("parameters", {})
        if isinstance(parameters, Mapping):
            parameters = parameter_table(self._controller.problem.model, self._controller.parameters, parameters)
        row: Row = {
            "time": time,
            "sensed": sensed,
            "arrived": arrived,
            "estimated": self._vector(signals["state"], estimated, "estimated"),
            "applied": self._vector(signals["input"], applied, "applied"),
            "reference": self._wanted(reference),
            "parameters": self._on_intervals(parameters),
            "numbers": self._controller.problem.numbers,
            **of_plan(plan),
            **self._of_innovation(others.pop("innovation", None)),
        }
        for name, values in others.items():
            row[name] = self._vector(signals[self._variables[name][0][-1]], values, name)
        self._rows.append(row)

    def record(self, sample: Sample) -> None:
        """Record a sample of a `ClosedLoop`: its arrays do not change, so none is copied."""
        signals, estimate = self._signals, sample.estimate
        if not self._same_signals(sample):
            self._record_by_name(sample)
            return
        row: Row = {
            "time": self._later(sample.time),
            "sensed": sample.measured.values,
            "arrived": sample.received.values,
            "estimated": sample.estimated.values,
            "applied": sample.applied.values,
            "reference": sample.reference.values,
            "parameters": sample.parameters,
            "numbers": sample.numbers,
            "plant": sample.plant.values,
            "disturbance": sample.disturbance.values,
            "true_states": sample.states.values,
            "true_outputs": sample.outputs.values,
            "observed": sample.observed.values,
            "true_observed": sample.true.values,
            "actuated": sample.actuated.values,
            "found_delay": sample.delays.values,
            **of_plan(sample.plan),
            **self._of_innovation(estimate.innovation),
        }
        if estimate.covariance is not None:
            row["observed_deviation"], row["estimated_deviation"] = self._deviations(sample, estimate.covariance)
        if estimate.parameters:
            row["estimated_parameters"] = self._known(signals["model_parameter"], estimate.parameters)
        if estimate.biases:
            row["estimated_biases"] = self._vector(self._measured, estimate.biases, "estimated_biases")
        self._rows.append(row)

    def log(self) -> xr.Dataset:
        """Everything recorded, dimensions named, units in attributes and in a `..._unit` coordinate."""
        plant = self._plant.name if self._plant else "a plant"
        log = Log(self._controller.problem, self._signals, self._variables, self._measured)
        attributes = {
            "title": f"{plant} under {self._controller.name}",
            "controller": self._controller.name,
            "model": self._controller.problem.model.name,
            "plant_model": plant,
            "seed": self._seed if self._seed < 2**63 else str(self._seed),  # more than a file takes as a number
        }
        return log.of(self._rows, attributes)

    def _record_by_name(self, sample: Sample) -> None:
        """Record a sample of a loop that has other signals than were named."""
        estimate, others = sample.estimate, dict[str, Any]()
        if estimate.covariance is not None:
            observed, told = self._deviations(sample, estimate.covariance)
            others = {"observed_deviation": observed, "estimated_deviation": told}
        others |= {"observed": sample.observed, "true_observed": sample.true}
        others |= {"actuated": sample.actuated, "found_delay": sample.delays}
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
            estimated_parameters=self._known(self._signals["model_parameter"], estimate.parameters),
            estimated_biases=estimate.biases,
            innovation=estimate.innovation,
            true_states=sample.states,
            true_outputs=sample.outputs,
            **{name: values for name, values in others.items() if name in self._variables},
        )
        self._rows[-1]["numbers"] = sample.numbers

    def _same_signals(self, sample: Sample) -> bool:
        """Whether a sample has the very signals that were named, so that its arrays can be taken as they are."""
        signals = self._signals
        return (
            sample.measured.signals is self._measured
            and sample.plant.signals is signals["plant_state"]
            and sample.disturbance.signals is signals["parameter"]
            and sample.estimated.signals is signals["state"]
            and sample.observed.signals is signals.get("observed_state", signals["state"])
        )

    def _deviations(self, sample: Sample, covariance: Array) -> tuple[Array, Array]:
        """Of the observed model's states, and of the controller's, NaN for those that it alone has."""
        deviations, states = np.sqrt(covariance.diagonal()), self._signals["state"]
        observed = sample.observed.signals
        if observed is states:
            return deviations, deviations
        return deviations, self._known(states, dict(zip(observed, deviations.tolist(), strict=True)))

    def _later(self, time: float) -> float:
        if self._rows and time <= self._rows[-1]["time"]:
            raise ArgumentError("time", f"{time:g} s", f"one after the last sample's, {self._rows[-1]['time']:g} s")
        return time

    def _of_innovation(self, innovation: object) -> Row:
        parts = of_innovation(innovation)
        return {n: self._vector(self._measured, v, n) if n != "nis" else v for n, v in parts.items()}

    def _known(self, signals: Signals, values: Mapping[str, float]) -> Array:
        """Values of those signals that there are (n,), NaN for others."""
        return self._vector(signals, {name: value for name, value in values.items() if name in signals}, "values")

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

    def _on_intervals(self, values: Any) -> Array:
        """Parameters on every interval (N, np_), of which a vector is that of each."""
        array, shape = as_numbers(values, "parameters"), self._controller.problem.parameters.shape
        if array.shape not in (shape, shape[1:]):
            raise ShapeError("parameters", f"shape {array.shape}", f"shape {shape}")
        return np.broadcast_to(array, shape).copy()
