"""From a command to what is applied, and to what controller and estimator know of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rumo.controllers import Controller
from rumo.signals import Array, read_only
from rumo.simulation.faults import Fault


class _Line:
    """Commands on their way; the last that has arrived is held."""

    def __init__(self, decided: Array, delay: int) -> None:
        self._coming = dict(enumerate(decided[:delay]))
        self._delay, self._held = delay, decided[0]

    def send(self, k: int, command: Array, faults: Iterable[Fault]) -> None:
        late = [fault.lateness for fault in faults]
        if None not in late:
            self._coming[k + self._delay + sum(samples or 0 for samples in late)] = command

    def receive(self, k: int) -> Array:
        self._held = self._coming.pop(k, self._held)
        return self._held

    def ahead(self, k: int) -> list[Array]:
        """What arrives after sample k that was sent before it."""
        decided = [self._held]
        for sample in range(k + 1, k + self._delay):
            decided.append(self._coming.get(sample, decided[-1]))
        return decided[1:]


class Actuators:
    """Commands on their way to the actuators, which hold the last that has arrived.

    Controller and estimator take for granted that commands arrive, and that actuators do what they are told. They know
    better where a fault is `known`, and that a sample was skipped.

    Attributes
    ----------
    believed : ndarray, shape (nu,)
        Input since the sample before, as far as controller and estimator know.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        delay, decided = controller.problem.delay, read_only(controller.applied)
        self._sent, self._known = _Line(decided, delay), _Line(decided, delay)
        self.believed: Array = decided[0]
        self._past: list[Array] = [self.believed]

    def send(self, k: int, command: Array, bad: Sequence[tuple[Fault, int]]) -> None:
        """A command computed at sample k is on its way."""
        command = read_only(command)
        self._sent.send(k, command, (fault for fault, _ in bad))
        self._known.send(k, command, (fault for fault, _ in bad if fault.known))

    def move(self, k: int, bad: Sequence[tuple[Fault, int]]) -> Array:
        """What is applied from sample k to the next (nu,): decided before its step with a delay, by it without.

        The controller is told.
        """
        inputs = self._controller.problem.model.inputs
        applied, believed = self._sent.receive(k), self._known.receive(k)
        for fault, before in bad:
            argument = f"{type(fault).__name__}.act()"
            applied = inputs.finite_vector(fault.act(applied.copy(), self._past, before, inputs), argument)
            if fault.known:
                believed = inputs.finite_vector(fault.act(believed.copy(), self._past, before, inputs), argument)
        self.believed = read_only(believed)
        self._past.append(read_only(applied))
        self.tell(k)
        return self._past[-1]

    def tell(self, k: int) -> None:
        """Tell the controller what is decided at sample k, where it takes anything else for granted.

        A fault may be known, a sample have been skipped, the controller have been reset.
        """
        decided = np.array([self.believed, *self._known.ahead(k)])
        if not np.array_equal(decided, self._controller.applied):
            self._controller.applied = decided
