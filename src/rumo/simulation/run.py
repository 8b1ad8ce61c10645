"""A run from its beginning to its end, and its log."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from rumo.checks import checked
from rumo.controllers import Controller
from rumo.errors import PlantError
from rumo.estimation import Estimator
from rumo.interrupts import Interrupted
from rumo.model import Model
from rumo.references import ReferenceLike
from rumo.signals import Values
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import PlantLike
from rumo.simulation.loop import ClosedLoop
from rumo.simulation.plant import Plant
from rumo.simulation.recorder import Recorder
from rumo.simulation.scenario import Scenario
from rumo.simulation.sensors import Sensors
from rumo.simulation.wind import Disturbance

if TYPE_CHECKING:
    import xarray as xr


def record(loop: ClosedLoop, progress: Callable[[int, int], None] | None = None) -> xr.Dataset:
    """Run a loop to its end and return the log, see `Scenario.run`."""
    recorder = Recorder(loop.controller, loop.plant, measured=loop.measured, seed=loop.scenario.seed)
    try:
        with closing(iter(loop)) as samples:
            for sample in samples:
                recorder.record(sample)
                if progress is not None:
                    progress(sample.index + 1, len(loop))
        return recorder.log()
    except PlantError as error:
        error.log = recorder.log()
        raise
    except KeyboardInterrupt:
        raise Interrupted(recorder.log()) from None


def simulate(
    controller: Controller,
    plant: Model | Plant | PlantLike | str,
    x: Values,
    reference: ReferenceLike,
    duration: float,
    *,
    applied: Mapping[str, float] | ArrayLike | None = None,
    seed: int = 0,
    sensors: Sensors | None = None,
    estimator: Estimator | None = None,
    disturbances: Mapping[str, Disturbance] | None = None,
    faults: Sequence[Fault] = (),
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Run a controller in closed loop with a plant: a `Scenario` with a controller that is there already.

    At each sample the plant is measured, the controller computes a command, and the command computed `delay` samples
    ago is held until the next sample.

    Parameters
    ----------
    controller : Controller
        It is reset first.
    plant : Model, Plant, PlantLike or str
        What is controlled; a `Plant` where tolerances or scales matter. Its inputs include the controller's, further
        ones stay 0; each state of the controller's model is one of its states or outputs, in the same unit.
    x : mapping or sequence, (plant nx,)
        Initial state of the plant.
    reference : Reference, callable, or mapping of str to float
        What lies ahead; times (n,) [s] -> signal -> values (n,); or values to be held.
    duration : float
        [s].
    applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
        Inputs decided before the start; the safe input if not given.
    seed : int
        Of noise and disturbances: the same seed gives the same log, but for timings.
    sensors : Sensors, optional
        Exact states if not given.
    estimator : Estimator, optional
        From measurements to the state that the controller is told; measured states pass unchanged without one.
    disturbances : mapping of str to Disturbance, optional
        Plant parameters that vary with time, such as the wind.
    faults : sequence of Fault
        What goes wrong.
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
    Interrupted
        A KeyboardInterrupt, on Ctrl-C; its `log` has the run so far.
    """
    scenario = Scenario(
        checked(controller, "controller", Controller).problem,
        plant,
        x,
        reference,
        duration,
        controller=type(controller),
        applied=applied,
        sensors=Sensors() if sensors is None else sensors,
        estimator=estimator,
        disturbances=disturbances or {},
        faults=faults,
        seed=seed,
    )
    return scenario.run(controller, progress)
