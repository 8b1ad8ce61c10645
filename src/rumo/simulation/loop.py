"""The closed loop: measure, estimate, look ahead, compute, hold, advance."""

from __future__ import annotations

import gc
from collections.abc import Generator, Sequence
from contextlib import ExitStack
from math import isclose

import numpy as np

from rumo.checks import checked
from rumo.controllers import Controller
from rumo.errors import ArgumentError, PlantError
from rumo.estimation import Unfiltered
from rumo.estimation.base import as_estimate, started
from rumo.interrupts import interruptible
from rumo.plan import Plan
from rumo.references import Preview, Reference, as_reference
from rumo.signals import Array, NamedArray, Signals
from rumo.simulation.actuators import Actuators
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import as_plant
from rumo.simulation.sample import Sample
from rumo.simulation.scenario import Scenario
from rumo.simulation.sensors import RunningSensors, known_observer, require_same_units
from rumo.simulation.wind import sampled


class ClosedLoop:
    """A scenario, sample by sample: `for sample in ClosedLoop(scenario)`. Each such loop is a new run.

    Between two samples the controller may be changed; the sample's input is applied when the next sample is asked for.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    controller : Controller, optional
        One that is there already; as the scenario wants it if not given. It is reset first.

    Attributes
    ----------
    controller : Controller
        That controls.
    plant : Plant or ForeignPlant
        That is controlled.
    measured : Signals
        What is measured.

    Raises
    ------
    ArgumentError
        If names, units or shapes don't fit together.
    """

    def __init__(self, scenario: Scenario, controller: Controller | None = None) -> None:
        self.scenario = checked(scenario, "scenario", Scenario)
        self.controller = (
            scenario.make_controller() if controller is None else checked(controller, "controller", Controller)
        )
        problem = self.controller.problem
        model, dt = problem.model, problem.sampling_time
        if not isclose(dt, scenario.problem.sampling_time) or problem.delay != scenario.problem.delay:
            raise ArgumentError(
                "controller",
                f"one with samples of {dt:g} s and a delay of {problem.delay}",
                f"the scenario's, {scenario.problem.sampling_time:g} s and {scenario.problem.delay}",
            )
        self.plant = plant = as_plant(scenario.plant, dt)
        for name in model.inputs:
            plant.inputs.index(name, "plant")
        require_same_units(plant, model, model.inputs)
        self._x = plant.states.finite_vector(scenario.x, "x")
        for name in scenario.disturbances:
            plant.parameters.index(name, "disturbances")
        self.measured = scenario.sensors.signals(plant, model)
        for fault in scenario.faults:
            fault.check(self.measured, model.inputs)
        with interruptible():
            self._states = known_observer(plant, model.states)
            self._outputs = known_observer(plant, problem.outputs)

    def __len__(self) -> int:
        return self.scenario.samples

    def __iter__(self) -> Generator[Sample, None, None]:
        scenario, controller, plant = self.scenario, self.controller, self.plant
        problem, reference = controller.problem, as_reference(scenario.reference)
        model, times = problem.model, problem.sampling_time * np.arange(len(self))
        faults = [(fault, fault.samples(problem.sampling_time)) for fault in scenario.faults]
        disturbance, sensors = self._random()
        with interruptible():
            estimator = started(scenario.estimator or Unfiltered(), problem, sensors.signals.names)
        plant.reset()
        controller.reset(applied=scenario.applied)
        actuators = Actuators(controller)
        columns = [plant.inputs.index(name) for name in model.inputs]
        state, held = self._x, np.zeros(len(plant.inputs))
        held[columns] = controller.applied[0]
        readings, last = list[Array](), np.full(len(model.states), np.nan)
        own_parameters = parameters = controller.parameters
        previewed = False
        gc.collect()  # what the set-up left behind would otherwise be collected, and counted, within a step
        try:
            for k, t in enumerate(times.tolist()):
                bad = [(fault, k - samples.start) for fault, samples in faults if k in samples]
                given = disturbance[k]
                measured = received = sensors.read(k, state, held, given)
                readings.append(measured)
                for fault, before in bad:
                    received = fault.sense(received, readings, before, sensors.signals)
                true = self._states(state, held, given), self._outputs(state, held, given)

                estimate = as_estimate(estimator.update(received, actuators.believed, parameters[0]), model.states)
                last = estimate.x if np.isfinite(estimate.x).all() else last
                preview = _preview(reference, t + problem.times, NamedArray(model.states, last))
                if preview.parameters:
                    controller.parameters, previewed = preview.parameters, True
                parameters = _believed(controller)
                plan = _step(controller, estimate.x, preview, bad, actuators, k)
                held[columns] = actuators.apply(k, bad)

                yield Sample(
                    index=k,
                    time=t,
                    plant=NamedArray(plant.states, state),
                    measured=NamedArray(sensors.signals, measured),
                    received=NamedArray(sensors.signals, received),
                    estimated=NamedArray(model.states, estimate.x),
                    covariance=estimate.covariance,
                    preview=preview,
                    reference=NamedArray(problem.outputs, _now(preview, problem.outputs)),
                    parameters=parameters,
                    plan=plan,
                    applied=NamedArray(model.inputs, held[columns].copy()),
                    disturbance=NamedArray(plant.parameters, given),
                    states=NamedArray(model.states, true[0]),
                    outputs=NamedArray(problem.outputs, true[1]),
                )
                try:
                    state = plant.advance(state, held, given)
                except PlantError as error:
                    raise PlantError(f"At t = {t:g} s: {error}") from None
        finally:
            if previewed:  # the others were this run's
                controller.parameters = dict(zip(model.parameters, own_parameters.T, strict=True))

    def _random(self) -> tuple[Array, RunningSensors]:
        """Parameters of the plant at each sample (K, np_), and sensors with their noise: all that the seed decides."""
        scenario, plant, problem = self.scenario, self.plant, self.controller.problem
        wind, noise = np.random.default_rng(scenario.seed).spawn(2)
        times = problem.sampling_time * np.arange(len(self))
        disturbance = np.tile(plant.default_parameters, (len(self), 1))
        for name, source in scenario.disturbances.items():
            disturbance[:, plant.parameters.index(name)] = sampled(source, f"disturbances[{name!r}]", times, wind)
        return disturbance, scenario.sensors.start(plant, self.measured, len(self), noise)


def _preview(reference: Reference, times: Array, x: NamedArray) -> Preview:
    preview = reference.preview(times, x)
    if not isinstance(preview, Preview):
        raise ArgumentError("reference.preview()", repr(preview), "a rumo.references.Preview")
    return preview


def _believed(controller: Controller) -> Array:
    """The controller's parameters (N, np_): set as a mapping, read as an array."""
    return controller.parameters


def _now(preview: Preview, outputs: Signals) -> Array:
    return np.array([np.ravel(preview.signals.get(name, np.nan))[0] for name in outputs], dtype=float)


def _step(
    controller: Controller,
    x: Array,
    preview: Preview,
    bad: Sequence[tuple[Fault, int]],
    actuators: Actuators,
    k: int,
) -> Plan | None:
    """The controller's step at sample k, whose command is then on its way; None if the controller does not run."""
    if not all(fault.runs for fault, _ in bad):
        actuators.skipped = True
        return None
    if actuators.skipped:
        actuators.tell(k)
    with ExitStack() as contexts:
        for fault, _ in bad:
            contexts.enter_context(fault.around(controller))
        with interruptible():
            plan = controller.step(x, preview.signals)
    late = [fault.lateness for fault, _ in bad]
    if None not in late:
        actuators.send(k, plan.command.values, sum(samples or 0 for samples in late))
    return plan
