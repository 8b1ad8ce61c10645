"""From a command to what is applied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rumo.controllers import Controller
from rumo.signals import Array
from rumo.simulation.faults import Fault


class Actuators:
    """Commands on their way to the actuators, which hold the last that has arrived.

    Attributes
    ----------
    believed : ndarray, shape (nu,)
        Input since the sample before, as far as controller and estimator know.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._delay = controller.problem.delay
        self._coming = dict(enumerate(controller.applied[: self._delay]))
        self.believed = self._arrived = controller.applied[0]
        self._past = [self.believed]
        self.skipped = False

    def send(self, k: int, command: Array, late: int) -> None:
        """A command computed at sample k is on its way."""
        self._coming[k + self._delay + late] = command

    def tell(self, k: int) -> None:
        """Tell the controller, after samples without it, what will be applied from sample k on."""
        decided, last = list[Array](), self._arrived
        for sample in range(k, k + max(self._delay, 1)):
            last = self._coming.get(sample, last)
            decided.append(last)
        self._controller.applied = np.array(decided)
        self.skipped = False

    def apply(self, k: int, bad: Sequence[tuple[Fault, int]]) -> Array:
        """What is applied from sample k to the next (nu,)."""
        inputs = self._controller.problem.model.inputs
        self._arrived = applied = believed = self._coming.pop(k, self._arrived)
        for fault, before in bad:
            applied = fault.act(applied, self._past, before, inputs)
            if fault.known:
                believed = fault.act(believed, self._past, before, inputs)
        if self._delay == 0 and believed is not self._arrived:
            self._controller.applied = believed
        self.believed = believed
        self._past.append(applied)
        return applied
