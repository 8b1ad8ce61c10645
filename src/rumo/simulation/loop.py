"""The closed loop: measure, compute, hold, advance."""

from __future__ import annotations

import gc
from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, checked, whole_number
from rumo.controllers import Controller
from rumo.errors import ArgumentError, PlantError
from rumo.model import Model
from rumo.references import Reference, constant
from rumo.signals import Array, Values
from rumo.simulation.log import Recorder
from rumo.simulation.plant import Plant
from rumo.simulation.sensors import Sensors, observation, require_same_units
from rumo.simulation.wind import Disturbance

if TYPE_CHECKING:
    import xarray as xr


def simulate(
    controller: Controller,
    plant: Model | Plant,
    x: Values,
    reference: Reference | Mapping[str, float],
    duration: float,
    *,
    applied: Mapping[str, float] | ArrayLike | None = None,
    seed: int = 0,
    sensors: Sensors | None = None,
    disturbances: Mapping[str, Disturbance] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Run a controller in closed loop with a plant.

    At each sample the plant is measured, the controller computes a command, and the command computed `delay` samples
    ago is held until the next sample.

    Parameters
    ----------
    controller : Controller
        It is reset first.
    plant : Model or Plant
        What is controlled; a `Plant` where tolerances or scales matter. Its inputs include the controller's, further
        ones stay 0; each state of the controller's model is one of its states or outputs, in the same unit.
    x : mapping or sequence, (plant nx,)
        Initial state of the plant.
    reference : callable or mapping of str to float
        Times (n,) [s] -> signal -> values (n,); a mapping is held.
    duration : float
        [s].
    applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
        Inputs decided before the start; the safe input if not given.
    seed : int
        Of noise and disturbances: the same seed gives the same log, but for timings.
    sensors : Sensors, optional
        Exact states if not given.
    disturbances : mapping of str to Disturbance, optional
        Plant parameters that vary with time, such as the wind.
    progress : callable, optional
        Called with (samples done, all samples).

    Returns
    -------
    xarray.Dataset
        See the page on logs; save it with `rumo.simulation.save(log, "run.nc")`.

    Raises
    ------
    ArgumentError
        If names or shapes don't fit.
    PlantError
        If the plant cannot be integrated; its `log` has the run so far.
    """
    problem = checked(controller, "controller", Controller).problem
    model, dt = problem.model, problem.sampling_time
    integrator = plant if isinstance(plant, Plant) else Plant(checked(plant, "plant", Model), dt)
    plant = integrator.model
    if integrator.sampling_time != dt:
        raise ArgumentError("plant", f"a sampling time of {integrator.sampling_time:g} s", f"the problem's {dt:g} s")
    if not dt <= duration < np.inf:
        raise ArgumentError("duration", f"{duration!r}", f"at least one sampling time of {dt:g} s, finite")
    whole_number(seed, "seed", 0)
    for name in model.inputs:
        plant.inputs.index(name, "plant")
    require_same_units(plant, model, model.inputs)
    state = plant.states.finite_vector(x, "x")
    reference = constant(reference) if isinstance(reference, Mapping) else reference
    if not callable(reference):
        raise ArgumentError("reference", repr(reference), "a function of times, or a mapping from names to numbers")
    sensors = Sensors() if sensors is None else checked(sensors, "sensors", Sensors)

    steps = round(duration / dt)
    times = dt * np.arange(steps)
    wind_rng, noise_rng = np.random.default_rng(seed).spawn(2)
    parameters = np.tile(plant.default_parameters, (steps, 1))
    for name, disturbance in (disturbances or {}).items():
        column = plant.parameters.index(name, "disturbances")
        parameters[:, column] = disturbance.sample(times, wind_rng)
    noise = sensors.deviations(plant) * noise_rng.standard_normal((steps, len(plant.states)))
    observe = observation(plant, model)
    estimate = sensors.start(problem)

    controller.reset(applied=applied)
    decided = deque(controller.applied[: problem.delay])
    columns = [plant.inputs.index(name) for name in model.inputs]
    held = np.zeros(len(plant.inputs))
    held[columns] = controller.applied[0]
    recorder = Recorder(controller, plant, seed)
    gc.collect()  # what the set-up left behind would otherwise be collected, and counted, within a step
    for k, t in enumerate(times):
        measured = observe(state + noise[k], held, parameters[k]).full().ravel()
        estimated = measured if estimate is None else estimate(measured, held[columns])
        window = as_mapping(reference(t + problem.times), "reference(t)")
        plan = controller.step(estimated, window)
        decided.append(plan.command.values)
        held[columns] = decided.popleft()
        recorder.add(
            plan,
            time=t,
            plant=state,
            measured=measured,
            estimated=estimated,
            applied=held[columns].copy(),
            reference=_now(window, problem.outputs.names),
            disturbance=parameters[k],
        )
        try:
            state = integrator.advance(state, held, parameters[k])
        except PlantError as error:
            raise PlantError(f"At t = {t:g} s: {error}", recorder.dataset()) from None
        if progress is not None:
            progress(k + 1, steps)
    return recorder.dataset()


def _now(window: Mapping[str, Array], outputs: tuple[str, ...]) -> Array:
    return np.array([np.ravel(window[name])[0] for name in outputs])
