"""A sample of a closed loop before anything is decided."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from rumo.controllers import Controller
from rumo.plan import Plan
from rumo.references import Preview
from rumo.signals import Array, NamedArray
from rumo.simulation.faults import Fault


@dataclass(frozen=True)
class Moment:
    """Everything that is known at a sample when its command is asked for.

    Attributes
    ----------
    index : int
        From 0.
    time : float
        [s].
    estimated : NamedArray
        State that the controller is told.
    observed : NamedArray
        Estimated state of the observed model.
    true : NamedArray
        True state of the observed model, NaN where the plant has no such signal.
    preview : Preview
        What lies ahead, as the controller is told.
    decided : ndarray, shape (max(delay, 1), nu)
        Inputs that the controller is told of: the one applied now, and with a delay those that follow; without, the one
        before.
    controller : Controller
        Of the loop.
    faults : sequence of Fault
        Those of this sample.
    """

    index: int
    time: float
    estimated: NamedArray[float]
    observed: NamedArray[float]
    true: NamedArray[float]
    preview: Preview
    decided: Array
    controller: Controller
    faults: Sequence[Fault]

    @property
    def computes(self) -> bool:
        """Whether anything is computed: a fault may keep it from that."""
        return all(fault.runs for fault in self.faults)

    def plan(self) -> Plan | None:
        """The controller's step, to be taken once; None if nothing is computed."""
        if not self.computes:
            return None
        if not self.faults:
            return self.controller.step(self.estimated.values, self.preview.signals)
        with ExitStack() as contexts:
            for fault in self.faults:
                contexts.enter_context(fault.around(self.controller))
            return self.controller.step(self.estimated.values, self.preview.signals)
