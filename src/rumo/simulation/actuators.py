"""From a command to what is applied, and to what controller and estimator know of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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

    Parameters
    ----------
    controller : Controller
        It believes in its problem's delay.
    delay : int
        Samples that commands really take.

    Attributes
    ----------
    believed, before : ndarray, shape (nu,)
        Input of the latest sample for which one is decided, and of the one before, as far as controller and estimator
        know.
    """

    def __init__(self, controller: Controller, delay: int) -> None:
        self._controller = controller
        decided = read_only(controller.applied)
        self._sent, self._known = _Line(decided, delay), _Line(decided, controller.problem.delay)
        self.believed: Array = decided[0]
        self.before = self.believed
        self._past: list[Array] = [self.believed]

    def send(self, k: int, command: Array, bad: Sequence[tuple[Fault, int]]) -> None:
        """A command computed at sample k is on its way."""
        command = read_only(command)
        self._sent.send(k, command, (fault for fault, _ in bad))
        self._known.send(k, command, (fault for fault, _ in bad if fault.known))

    def decide(self, k: int, bad: Sequence[tuple[Fault, int]]) -> None:
        """What controller and estimator believe in from sample k on: known before its step with a delay, else by it.

        The controller is told. Comes before `act` of the same sample.
        """
        known = [(fault, before) for fault, before in bad if fault.known]
        self.before, self.believed = self.believed, self._as_done(self._known.receive(k), known)
        self.tell(k)

    def act(self, k: int, bad: Sequence[tuple[Fault, int]]) -> Array:
        """What is applied from sample k to the next (nu,)."""
        self._past.append(self._as_done(self._sent.receive(k), bad))
        return self._past[-1]

    def _as_done(self, command: Array, bad: Iterable[tuple[Fault, int]]) -> Array:
        inputs = self._controller.problem.model.inputs
        for fault, before in bad:
            done = fault.act(command.copy(), self._past, before, inputs)
            command = read_only(inputs.finite_vector(done, f"{type(fault).__name__}.act()"))
        return command

    def tell(self, k: int) -> None:
        """Tell the controller what is decided at sample k, where it takes anything else for granted.

        A fault may be known, a sample have been skipped, the controller have been reset.
        """
        decided = [self.believed, *self._known.ahead(k)]
        if [inputs.tolist() for inputs in decided] != self._controller.applied.tolist():
            self._controller.applied = decided
