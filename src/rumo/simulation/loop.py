"""The closed loop: measure, estimate, look ahead, compute, hold, advance."""

from __future__ import annotations

import gc
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from math import isclose
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, checked
from rumo.controllers import Controller
from rumo.errors import ArgumentError, CallOrderError, PlantError
from rumo.estimation import Unfiltered
from rumo.estimation.base import as_estimate, started
from rumo.interrupts import interruptible
from rumo.plan import Plan
from rumo.references import Preview, Reference, as_reference, start_reference
from rumo.signals import Array, NamedArray, Signals, read_only
from rumo.simulation.actuators import Actuators
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import ForeignPlant, as_plant
from rumo.simulation.moment import Moment
from rumo.simulation.observation import Observation
from rumo.simulation.plant import Plant
from rumo.simulation.previews import PreviewedParameters
from rumo.simulation.sample import Sample
from rumo.simulation.sensors import RunningSensors, known_observer, require_same_units
from rumo.simulation.wind import sampled

if TYPE_CHECKING:
    from rumo.simulation.scenario import Scenario


_RUNS: WeakKeyDictionary[Controller, object] = WeakKeyDictionary()
"""The latest run of each controller."""


class ClosedLoop:
    """A scenario, sample by sample: `for sample in ClosedLoop(scenario)`. Each such loop is a new run.

    Between two samples the controller may be changed, or reset; before its next step it is told again which inputs are
    decided. The sample's input is applied when the next sample is asked for.

    Only one run at a time has a controller: the one that was started last.

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
    observed : Model
        Whose states are estimated.
    measured : Signals
        What is measured.

    Raises
    ------
    ArgumentError
        If names, units or shapes don't fit together.
    """

    def __init__(self, scenario: Scenario, controller: Controller | None = None) -> None:
        if not hasattr(scenario, "make_controller"):
            raise ArgumentError("scenario", repr(scenario), "a rumo.Scenario")
        self.scenario = scenario
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
        seen = [name for name in (*model.states, *problem.outputs) if name in plant.states or name in plant.outputs]
        require_same_units(plant, model, (*model.inputs, *seen))
        self._x = plant.states.finite_vector(scenario.x, "x")
        for name in scenario.disturbances:
            plant.parameters.index(name, "disturbances")
        ages = dict(zip(model.states, problem.sensors.age.tolist(), strict=True))
        _require_same_lateness(scenario.sensors.late, _lateness(scenario.estimator, dt), ages)
        self._observation = Observation(problem, scenario.observed)
        self.observed = observed = self._observation.model
        self.measured = scenario.sensors.signals(plant, observed)
        for fault in scenario.faults:
            fault.check(self.measured, model.inputs)
            fault.check_parameters(plant.parameters)
        self._substitutes = [_substitute(fault, plant, dt) for fault in scenario.faults]
        with interruptible():
            self._states = known_observer(plant, observed.states)
            self._outputs = known_observer(plant, problem.outputs)

    def __len__(self) -> int:
        return self.scenario.samples

    def __iter__(self) -> Generator[Sample, None, None]:
        with closing(self.moments()) as moments:
            for moment in moments:
                yield moments.send(moment.plan())

    def moments(self) -> Generator[Any, Plan | ArrayLike | None, None]:
        """A new run, for whoever decides in place of the controller: of each sample a `Moment`, then a `Sample`.

        After a `Moment`, `send` a plan, or a command (nu,), or None for no command at all: what comes back is the
        `Sample`, and `next` goes on. What is sent takes the way of a controller's command, delay and faults included.
        """
        scenario, controller, plant = self.scenario, self.controller, self.plant
        problem = controller.problem
        reference, observation = start_reference(as_reference(scenario.reference), problem), self._observation
        seen, model, times = self.observed, problem.model, problem.sampling_time * np.arange(len(self))
        faults = [(fault, fault.samples(problem.sampling_time)) for fault in scenario.faults]
        disturbance, sensors = self._random()
        with interruptible():
            scheme = controller.transcription.discretization
            observing = observation.problem
            estimator = started(scenario.estimator or Unfiltered(), observing, sensors.signals.names, scheme)
        for driven in (plant, *filter(None, self._substitutes)):
            driven.reset()
        _RUNS[controller] = run = object()
        controller.reset(applied=scenario.applied)
        actuators = Actuators(controller)
        columns = [plant.inputs.index(name) for name in model.inputs]
        state, held = read_only(self._x), np.zeros(len(plant.inputs))
        held[columns] = controller.applied[0]
        readings, last = list[Array](), read_only(np.full(len(seen.states), np.nan))
        previewed, parameters = PreviewedParameters(controller), problem.parameters[0]
        gc.collect()  # what the set-up left behind would otherwise be collected, and counted, within a step
        try:
            # What others may change is a copy; what is kept cannot be written to.
            for k, t in enumerate(times.tolist()):
                bad = [(fault, k - samples.start) for fault, samples in faults if k in samples]
                given = self._disturbed(disturbance[k], bad)
                measured = received = read_only(sensors.read(k, state, held, given))
                readings.append(measured)
                for fault, before in bad:
                    said = fault.sense(received.copy(), readings, before, sensors.signals)
                    received = sensors.signals.vector(said, f"{type(fault).__name__}.sense()")
                received = read_only(received)
                true = NamedArray(seen.states, read_only(self._states(state, held, given)))
                outputs = self._outputs(state, held, given)

                known = observation.parameters(parameters)
                estimate = as_estimate(estimator.update(received.copy(), actuators.believed, known), seen)
                last = estimate.x if np.isfinite(estimate.x).all() else last
                preview = _preview(reference, t + problem.times, NamedArray(seen.states, last))
                previewed.look({**observation.estimated_parameters(estimate), **preview.parameters})
                x = read_only(observation.told(NamedArray(seen.states, estimate.x), reference))
                numbers = controller.problem.numbers
                parameters = numbers.parameters[0]
                # With a delay, what arrives now was decided before; without, it is what is computed now.
                if problem.delay:
                    held[columns] = actuators.move(k, bad)
                else:
                    actuators.tell(k)
                told, observed = NamedArray(model.states, x), NamedArray(seen.states, estimate.x)
                there = tuple(fault for fault, _ in bad)
                moment = Moment(k, t, told, observed, true, preview, controller.applied, controller, there)
                sent = yield moment
                plan = sent if isinstance(sent, Plan) else None
                command = sent.command.values if isinstance(sent, Plan) else sent
                if command is not None and moment.computes:
                    actuators.send(k, model.inputs.finite_vector(command, "command"), bad)
                if not problem.delay:
                    held[columns] = actuators.move(k, bad)

                yield Sample(
                    index=k,
                    time=t,
                    plant=NamedArray(plant.states, state),
                    measured=NamedArray(sensors.signals, measured),
                    received=NamedArray(sensors.signals, received),
                    estimated=told,
                    observed=observed,
                    estimate=estimate,
                    preview=preview,
                    reference=NamedArray(problem.outputs, read_only(_now(preview, problem.outputs))),
                    numbers=numbers,
                    plan=plan,
                    applied=NamedArray(model.inputs, read_only(held[columns])),
                    disturbance=NamedArray(plant.parameters, given),
                    states=NamedArray(model.states, read_only(observation.told(true, reference))),
                    outputs=NamedArray(problem.outputs, read_only(outputs)),
                    true=true,
                )
                try:
                    driven = self._driven(k, faults)
                    state = read_only(driven.advance(state, held, self._driven_by(driven, given, disturbance[k])))
                except PlantError as error:
                    raise PlantError(f"At t = {t:g} s: {error}") from None
                if _RUNS.get(controller) is not run:
                    raise CallOrderError(
                        "The controller was given to another run: each run at the same time needs its own."
                    )
        finally:
            previewed.look({})  # the others were this run's

    def _disturbed(self, given: Array, bad: Sequence[tuple[Fault, int]]) -> Array:
        """Parameters of the plant (np_,), as faults leave them."""
        for fault, _ in bad:
            said = fault.disturb(given.copy(), self.plant.parameters)
            given = self.plant.parameters.finite_vector(said, f"{type(fault).__name__}.disturb()")
        return read_only(given)

    def _driven(self, k: int, faults: Sequence[tuple[Fault, range]]) -> Plant | ForeignPlant:
        """The plant at sample k, or what the last fault puts in its place."""
        driven = self.plant
        for (_, samples), substitute in zip(faults, self._substitutes, strict=True):
            if substitute is not None and k in samples:
                driven = substitute
        return driven

    def _driven_by(self, driven: Plant | ForeignPlant, given: Array, disturbance: Array) -> Array:
        """Parameters (np_,) of what is driven: the plant's, but another's own where nothing has set them."""
        if driven is self.plant:
            return given
        named = np.isin(self.plant.parameters.names, list(self.scenario.disturbances))
        return np.where(named | (given != disturbance), given, driven.default_parameters)

    def _random(self) -> tuple[Array, RunningSensors]:
        """Parameters of the plant at each sample (K, np_), and sensors with their noise: all that the seed decides."""
        scenario, plant, problem = self.scenario, self.plant, self.controller.problem
        wind, noise = np.random.default_rng(scenario.seed).spawn(2)
        times = problem.sampling_time * np.arange(len(self))
        disturbance = np.tile(plant.default_parameters, (len(self), 1))
        for name, source in scenario.disturbances.items():
            disturbance[:, plant.parameters.index(name)] = sampled(
                source, f"disturbances[{name!r}]", times.copy(), wind
            )
        return read_only(disturbance), scenario.sensors.start(plant, self.measured, len(self), noise)


def _substitute(fault: Fault, plant: Plant | ForeignPlant, dt: float) -> Plant | ForeignPlant | None:
    """What a fault drives in place of the plant, if anything; raises unless it has the same signals."""
    if fault.substitute is None:
        return None
    other = as_plant(fault.substitute, dt)
    for role in ("states", "inputs", "parameters"):
        found, expected = (
            dict(zip(s.names, s.units, strict=True)) for s in (getattr(other, role), getattr(plant, role))
        )
        if list(found.items()) != list(expected.items()):
            raise ArgumentError(
                f"{type(fault).__name__}.plant",
                f"{role} {', '.join(found) or 'none'}",
                f"those of the plant, in the same order and units: {', '.join(expected) or 'none'}",
            )
    return other


def _preview(reference: Reference, times: Array, x: NamedArray) -> Preview:
    preview = reference.preview(times, x)
    if not isinstance(preview, Preview):
        raise ArgumentError("reference.preview()", repr(preview), "a rumo.references.Preview")
    return preview


def _now(preview: Preview, outputs: Signals) -> Array:
    return np.array([np.ravel(preview.signals.get(name, np.nan))[0] for name in outputs], dtype=float)


def _lateness(estimator: object, dt: float) -> dict[str, float]:
    """Samples of which an estimator, which may be of the user's making, knows that measurements are late."""
    age, late = (as_mapping(getattr(estimator, name, {}), name) for name in ("age", "late"))
    return {name: value / dt for name, value in age.items()} | late


def _require_same_lateness(sensors: Mapping[str, int], estimator: Mapping[str, float], ages: Mapping[str, int]) -> None:
    """Raise if estimator and controller together would take measurements for newer, or older, than they are."""
    for name in {**sensors, **estimator, **ages}:
        late, expected = sensors.get(name, 0), estimator.get(name, 0) + ages.get(name, 0)
        if not isclose(late, expected, abs_tol=1e-6):
            raise ArgumentError(
                f"sensors.late[{name!r}]",
                str(late),
                f"the {expected:g} samples that estimator and problem reckon with",
                "ExtendedKalman(late={...}) takes late measurements for what they are, or Problem(measurements={...}) "
                "with rumo.Measurement(age=...); what neither shall know of is a fault, LateMeasurement.",
            )
