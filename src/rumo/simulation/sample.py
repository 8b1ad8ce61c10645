"""One sample of a closed loop."""

from __future__ import annotations

from dataclasses import dataclass

from rumo.estimation import Estimate
from rumo.numbers import ProblemNumbers
from rumo.plan import Plan
from rumo.references import Preview
from rumo.signals import Array, NamedArray


@dataclass(frozen=True)
class Sample:
    """Everything that is known at a sample, when its input is about to be applied.

    Its arrays are read-only, but for the plan's.

    Attributes
    ----------
    index : int
        From 0.
    time : float
        [s].
    plant : NamedArray
        State of the plant.
    measured : NamedArray
        What the sensors say.
    received : NamedArray
        What of it arrives: the same, but for faults.
    estimated : NamedArray
        State that the controller is told: the one in which the next input begins to act.
    observed : NamedArray
        Estimated state of the observed model, at the sample: the same, unless the scenario has a model of its own for
        that, or inputs begin to act between two samples.
    estimate : Estimate
        All that the estimator says.
    preview : Preview
        What lies ahead, as the controller is told.
    reference : NamedArray
        Wanted outputs now.
    numbers : ProblemNumbers
        Of the controller's problem, such as bounds and limits.
    plan : Plan or None
        What the controller answers; None if it was skipped.
    applied : NamedArray
        Input from now to the next sample: what actuators are told, if the scenario has any.
    actuated : NamedArray
        What they make of it: mean of the plant's input from now to the next sample.
    delays : NamedArray
        Found by the scenario's monitors [s], NaN where not known.
    disturbance : NamedArray
        Parameters of the plant from now to the next sample.
    states, outputs : NamedArray
        True states of the controller's model, and true tracked outputs, where the plant has signals of these names;
        else NaN.
    true : NamedArray
        True state of the observed model.
    """

    index: int
    time: float
    plant: NamedArray[float]
    measured: NamedArray[float]
    received: NamedArray[float]
    estimated: NamedArray[float]
    observed: NamedArray[float]
    estimate: Estimate
    preview: Preview
    reference: NamedArray[float]
    numbers: ProblemNumbers
    plan: Plan | None
    applied: NamedArray[float]
    actuated: NamedArray[float]
    delays: NamedArray[float]
    disturbance: NamedArray[float]
    states: NamedArray[float]
    outputs: NamedArray[float]
    true: NamedArray[float]

    @property
    def covariance(self) -> Array | None:
        """Of the estimate's error, that of the observed state, where the estimator knows."""
        return self.estimate.covariance

    @property
    def parameters(self) -> Array:
        """Parameters of the controller's model on each interval (N, np_), as the controller believes."""
        return self.numbers.parameters

    @property
    def commanded(self) -> NamedArray[float] | None:
        """Input computed at this sample, applied `delay` samples later."""
        return None if self.plan is None else self.plan.command
