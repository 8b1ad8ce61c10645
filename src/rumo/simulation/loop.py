"""The closed loop: measure, estimate, look ahead, compute, hold, advance."""

from __future__ import annotations

import gc
from collections.abc import Generator, Sequence
from contextlib import closing
from math import isclose, isfinite
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from rumo.actuation import acting_inputs
from rumo.actuation.timing import in_samples
from rumo.checks import checked
from rumo.controllers import Controller
from rumo.errors import ArgumentError, CallOrderError, PlantError
from rumo.estimation import Unfiltered
from rumo.estimation.base import as_estimate, started
from rumo.interrupts import interruptible
from rumo.plan import Plan
from rumo.signals import Array, NamedArray, Signals, read_only
from rumo.simulation.actuated import ActuatedInputs, mean_input
from rumo.simulation.actuators import Actuators
from rumo.simulation.compensation import Compensation
from rumo.simulation.disturbances import Disturbances
from rumo.simulation.driven import DrivenPlant
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import as_plant
from rumo.simulation.lateness import as_it_is, believed_inputs, require_same_lateness
from rumo.simulation.moment import Moment
from rumo.simulation.monitors import Monitors
from rumo.simulation.observation import Observation
from rumo.simulation.previews import PreviewedParameters, Previews, first_of
from rumo.simulation.sample import Sample
from rumo.simulation.sensors import RunningSensors, known_observer, require_same_units

if TYPE_CHECKING:
    from rumo.simulation.scenario import Scenario


_RUNS: WeakKeyDictionary[Controller, object] = WeakKeyDictionary()
"""The latest run of each controller."""
YOUNG, ALL = 1, 2
"""Generations of garbage: what a run with a controller that is there already leaves behind is young, and to go through
all objects there are takes longer than a short run."""


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
    monitors : Monitors
        That find delays.
    lead : float
        Time from a sample until its next input begins to act, less than a sampling time: the controller is told the
        state then [s].

    Raises
    ------
    ArgumentError
        If names, units or shapes don't fit together.
    """

    def __init__(self, scenario: Scenario, controller: Controller | None = None) -> None:
        if not hasattr(scenario, "make_controller"):
            raise ArgumentError("scenario", repr(scenario), "a rumo.Scenario")
        self.scenario, self._makes_controller = scenario, controller is None
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
        self._columns = [plant.inputs.index(name, "plant") for name in model.inputs]
        seen = [name for name in (*model.states, *problem.outputs) if name in plant.states or name in plant.outputs]
        require_same_units(plant, model, (*model.inputs, *seen))
        self._x = plant.states.finite_vector(scenario.x, "x")
        for name in scenario.disturbances:
            plant.parameters.index(name, "disturbances")
        self._observation = Observation(problem, scenario.observed)
        self.observed = observed = self._observation.model
        self.measured = scenario.sensors.signals(plant, observed)
        require_same_lateness(scenario.sensors, scenario.estimator, problem, self.measured)
        self._actuation = as_it_is(scenario.actuation, problem)
        believed = self._actuation if scenario.believed is None else scenario.believed
        self._acting = acting_inputs(self._actuation, model.inputs, dt)
        self._share = believed_inputs(believed, problem).share
        self.lead = self._share * dt
        late = scenario.sensors.lateness(self.measured, dt)
        self.monitors = Monitors(scenario.monitors, believed, model.inputs, self.measured, late, dt)
        for fault in scenario.faults:
            fault.check(self.measured, model.inputs)
            fault.check_parameters(plant.parameters)
        parts = self._actuation.moves or any(in_samples(each)[1] for each in (*self._acting.rest, *late))
        self._driven = DrivenPlant(plant, scenario.faults, scenario.disturbances, self._columns, parts)
        with interruptible():
            self._true = known_observer(plant, (*observed.states, *problem.outputs))

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
        problem, observation, seen = controller.problem, self._observation, self.observed
        model, times = problem.model, problem.sampling_time * np.arange(len(self))
        previews = Previews(scenario.reference, problem, times)
        reference = previews.reference
        faults = [(fault, fault.samples(problem.sampling_time)) for fault in scenario.faults]
        disturbances, sensors = self._random()
        with interruptible():
            scheme = controller.transcription.discretization
            observing = observation.problem
            estimator = started(scenario.estimator or Unfiltered(), observing, sensors.signals.names, scheme)
            compensation = Compensation(observing, scheme, estimator, self._share)
        self._driven.reset()
        _RUNS[controller] = run = object()
        controller.reset(applied=scenario.applied)
        actuators = Actuators(controller, self._acting.delay)
        actuated = ActuatedInputs(
            self._actuation, self._acting, model.inputs, problem.sampling_time, actuators.believed
        )
        self.monitors.reset(actuators.believed)
        state, held = read_only(self._x), np.zeros(len(plant.inputs))
        held[self._columns] = actuators.believed
        readings, last = list[Array](), read_only(np.full(len(seen.states), np.nan))
        set_parameters, parameters = PreviewedParameters(controller), problem.parameters[0]
        # What the set-up left behind would otherwise be collected, and counted, within a step.
        gc.collect(ALL if self._makes_controller else YOUNG)
        try:
            # What others may change is a copy; what is kept cannot be written to.
            for k, t in enumerate(times.tolist()):
                bad = [(fault, k - samples.start) for fault, samples in faults if k in samples]
                disturbance = disturbances.at(k, state)
                given = self._disturbed(disturbance, bad)
                readings.append(read_only(sensors.read(k, state, held, given)))
                measured, received = readings[-1], self._received(readings, bad, sensors.signals)
                here = read_only(self._true(state, held, given))
                true = NamedArray(seen.states, here[: len(seen.states)])

                known = observation.parameters(parameters)
                applied = compensation.applied(actuators)
                estimate = as_estimate(estimator.update(received.copy(), applied, known), seen)
                soon = compensation.ahead(estimate, actuators.believed, known)
                now = None
                if self.lead:
                    now = previews.at(k, 0.0, NamedArray(seen.states, finite_or(estimate.x, last)))
                last = finite_or(soon, last)
                preview = previews.at(k, self.lead, NamedArray(seen.states, last))
                wanted = first_of(preview if now is None else now, problem.outputs)
                set_parameters.look({**observation.estimated_parameters(estimate), **preview.parameters})
                x = read_only(observation.told(NamedArray(seen.states, soon), reference))
                numbers = controller.problem.numbers
                parameters = numbers.parameters[0]
                # With a delay, what arrives now was decided before; without, it is what is computed now.
                if problem.delay:
                    actuators.decide(k, bad)
                else:
                    actuators.tell(k)
                told, observed = NamedArray(model.states, x), NamedArray(seen.states, estimate.x)
                there = tuple(fault for fault, _ in bad)
                moment = Moment(k, t, told, observed, true, preview, controller.applied, controller, there)
                sent = yield moment
                plan = sent if isinstance(sent, Plan) else None
                command = sent.command.values if isinstance(sent, Plan) else sent
                command = model.inputs.finite_vector(command, "command") if command is not None else None
                if command is not None and moment.computes:
                    actuators.send(k, command, bad)
                if not problem.delay:
                    actuators.decide(k, bad)
                done = actuators.act(k, bad)
                pieces = actuated.over(done, sensors.stops)
                found = self.monitors.update(t, command if moment.computes else None, received)

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
                    reference=NamedArray(problem.outputs, read_only(wanted)),
                    numbers=numbers,
                    plan=plan,
                    applied=NamedArray(model.inputs, done),
                    actuated=NamedArray(model.inputs, read_only(mean_input(pieces))),
                    delays=found,
                    disturbance=NamedArray(plant.parameters, given),
                    states=NamedArray(model.states, read_only(observation.told(true, reference))),
                    outputs=NamedArray(problem.outputs, here[len(seen.states) :]),
                    true=true,
                )
                try:
                    state = self._driven.advance(k, state, held, pieces, given, disturbance, sensors)
                except PlantError as error:
                    raise PlantError(f"At t = {t:g} s: {error}") from None
                if _RUNS.get(controller) is not run:
                    raise CallOrderError(
                        "The controller was given to another run: each run at the same time needs its own."
                    )
        finally:
            set_parameters.look({})  # the others were this run's

    def _received(self, readings: Sequence[Array], bad: Sequence[tuple[Fault, int]], signals: Signals) -> Array:
        """What arrives (m,) of the latest of all readings, as faults leave it."""
        received = readings[-1]
        for fault, before in bad:
            said = fault.sense(received.copy(), readings, before, signals)
            received = read_only(signals.vector(said, f"{type(fault).__name__}.sense()"))
        return received

    def _disturbed(self, given: Array, bad: Sequence[tuple[Fault, int]]) -> Array:
        """Parameters of the plant (np_,), as faults leave them."""
        for fault, _ in bad:
            said = fault.disturb(given.copy(), self.plant.parameters)
            given = read_only(self.plant.parameters.finite_vector(said, f"{type(fault).__name__}.disturb()"))
        return given

    def _random(self) -> tuple[Disturbances, RunningSensors]:
        """Disturbances of the plant, and sensors with their noise: all that the seed decides."""
        scenario, plant, dt = self.scenario, self.plant, self.controller.problem.sampling_time
        wind, noise = np.random.default_rng(scenario.seed).spawn(2)
        disturbances = Disturbances(
            scenario.disturbances,
            plant.default_parameters,
            plant.parameters,
            plant.states,
            dt * np.arange(len(self)),
            wind,
        )
        return disturbances, scenario.sensors.start(plant, self.measured, len(self), noise)


def finite_or(x: Array, before: Array) -> Array:
    """A state (nx,) if it is finite, else the one before."""
    return x if all(map(isfinite, x.tolist())) else before
