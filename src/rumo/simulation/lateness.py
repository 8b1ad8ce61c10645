"""Whether sensors, estimator and controller mean the same times."""

from __future__ import annotations

from math import isclose

from rumo.actuation import ActingInputs, Actuation, acting_inputs
from rumo.errors import ArgumentError
from rumo.estimation import Estimator
from rumo.estimation.lateness import lateness
from rumo.problem import Problem
from rumo.signals import Signals
from rumo.simulation.sensors import Sensors


def require_same_lateness(sensors: Sensors, estimator: Estimator | None, problem: Problem, measured: Signals) -> None:
    """Raise if estimator and controller together would take measurements for newer, or older, than they are.

    Parameters
    ----------
    sensors : Sensors
        Of the plant.
    estimator : Estimator, optional
        It may have a mapping `late`, or `age`.
    problem : Problem
        Of the controller, with the ages of readings.
    measured : Signals
        What is measured.
    """
    dt = problem.sampling_time
    late = dict(zip(measured, sensors.lateness(measured, dt).tolist(), strict=True))
    said, owner = [getattr(estimator, name, {}) for name in ("late", "age")], type(estimator).__name__
    known = dict(zip(measured, lateness(said[0], said[1], measured, dt, owner).tolist(), strict=True))
    ages = dict(zip(problem.model.states, problem.sensors.age.tolist(), strict=True))
    for name in {**late, **ages}:
        have, expected = late.get(name, 0.0), known.get(name, 0.0) + ages.get(name, 0)
        if not isclose(have, expected, abs_tol=1e-6):
            raise ArgumentError(
                f"sensors.late[{name!r}]",
                f"{have:g}",
                f"the {expected:g} samples that estimator and problem reckon with",
                "ExtendedKalman(late={...}) takes late measurements for what they are, or Problem(measurements={...}) "
                "with rumo.Measurement(age=...); what neither shall know of is a fault, LateMeasurement.",
            )


def as_it_is(actuation: Actuation | None, problem: Problem) -> Actuation:
    """What lies between commands and their effect: the problem's delay, if nothing else is said."""
    return Actuation(computation=problem.delay * problem.sampling_time) if actuation is None else actuation


def believed_inputs(believed: Actuation, problem: Problem) -> ActingInputs:
    """When inputs act, as the controller is to believe; raises unless that is its problem's delay."""
    acting = acting_inputs(believed, problem.model.inputs, problem.sampling_time)
    if acting.delay != problem.delay:
        least = believed.least_dead_time(problem.model.inputs)
        raise ArgumentError(
            "problem.delay",
            str(problem.delay),
            f"{acting.delay}: computation of {believed.computation:g} s and a dead time of at least {least:g} s are "
            f"{acting.delay} samples of {problem.sampling_time:g} s, and {acting.share:.3g} of one",
            "Actuation(computation=...) is all the time from a measurement until its command leaves.",
        )
    return acting
