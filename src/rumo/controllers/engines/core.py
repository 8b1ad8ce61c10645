"""The C core as an engine, tailored or portable."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict

import numpy as np

from rumo.controllers.arguments import ReferenceWindow, followed, tracked
from rumo.controllers.engines.described import core_problem, core_settings, numbers_of, parameters_of
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import Settings
from rumo.errors import ArgumentError, CallOrderError
from rumo.forks import SharedLock, when_forked
from rumo.kernel import NUMBERS, Build, Core, portable, tailored
from rumo.plan import Plan, PlanLayout
from rumo.signals import Array, Values
from rumo.status import STATUSES, Status
from rumo.transcription import Transcription

NOT_ARRAYS = (BufferError, TypeError, ValueError)
"""What the core raises for a state or reference that it cannot read as it is."""


class CoreEngine:
    """Steps computed by the C core, portable or compiled for the problem. Threads that share it wait for each other."""

    def __init__(self, transcription: Transcription, settings: Settings, *, tailor: bool) -> None:
        self._lock = SharedLock()  # around changes; the core has one of its own, and knows what its plans' layout is
        self._problem = transcription.problem
        self._followed = frozenset(followed(self._problem))
        description = core_problem(transcription, settings.qp.solver)
        self._solver = "condensing" if description.values["condensing"] else "riccati"
        self._numbers = {name: description.values[name] for name in NUMBERS}
        self._build: Build = tailored(description) if tailor else portable()
        self.backend = self._build.name
        self._layout = PlanLayout(self._problem, settings.integrator_tolerance)
        self._size = self._layout.size
        self._core = Core(
            self._build.table, description.values, asdict(core_settings(settings, self._problem)), self._layout
        )
        when_forked(self, lambda engine: engine._core.after_fork())

    def configure(self, settings: Settings) -> None:
        """See `Engine.configure`."""
        solver = settings.qp.solver
        if solver not in ("auto", self._solver):
            raise ArgumentError("qp.solver", repr(solver), f"{self._solver!r}, as made", "Make another controller.")
        with self._lock:
            layout = PlanLayout(self._problem, settings.integrator_tolerance)
            self._core.configure(asdict(core_settings(settings, self._problem)), layout)
            self._layout = layout

    def update(self, transcription: Transcription) -> None:
        """See `Engine.update`."""
        problem = transcription.problem
        with self._lock:
            if problem.numbers.differences(self._problem.numbers) == ["parameters"]:
                numbers = self._numbers | parameters_of(transcription)
            else:
                numbers = numbers_of(transcription)
            changed = {
                name: numbers[name]
                for name, old in self._numbers.items()
                if numbers[name] is not old and not np.array_equal(numbers[name], old)
            }
            layout = self._layout.renumbered(problem)
            self._core.update(changed, layout)
            self._problem, self._numbers, self._layout = problem, numbers, layout

    def reset(self, applied: Array) -> None:
        """See `Engine.reset`."""
        self._core.reset(applied)

    def rest(self, x: Array) -> None:
        """See `Engine.rest`."""
        self._core.rest(x)

    def start(self, x: Array, u: Array) -> None:
        """See `Engine.start`."""
        self._core.engage(np.ascontiguousarray(x), np.ascontiguousarray(u))

    @property
    def applied(self) -> Array:
        """See `Engine.applied`."""
        inputs = np.empty((max(self._problem.delay, 1), len(self._problem.model.inputs)))
        self._core.get_applied(inputs)
        return inputs

    @applied.setter
    def applied(self, inputs: Array) -> None:
        self._core.set_applied(inputs)

    @property
    def counts(self) -> Counter[Status]:
        """See `Engine.counts`."""
        counts = zip(STATUSES, self._core.counts(), strict=True)
        return Counter({status: count for status, count in counts if count})

    def prepare(self) -> None:
        """See `Engine.prepare`."""
        self._core.prepare()

    @property
    def taken(self) -> Array:
        """The last measurement (nx,) as it was used: some readings are predicted."""
        x = np.empty(len(self._problem.model.states))
        self._core.taken(x)
        return x

    @property
    def begins(self) -> dict[str, float]:
        """Where the last reference of each output began; angles without jumps of a turn."""
        wanted = np.empty(len(self._problem.outputs))
        self._core.begins(wanted)
        return dict(zip(self._problem.outputs, wanted.tolist(), strict=True))

    def adopt(self, trajectory: Trajectory, status: Status) -> Status:
        """Instead of the last step's plan, apply another of the same sample, found elsewhere, and go on from it."""
        u, x, inner = (np.ascontiguousarray(part) for part in trajectory.parts)
        return STATUSES[self._core.adopt(u, x, inner, STATUSES.index(status))]

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.feedback`. Fastest for arrays: x (nx,) and reference (N + 1, ny), contiguous, of floats."""
        # As `step`, which is written out too: to share a function with it would take a fiftieth of a step's time.
        numbers = np.empty(self._size)
        try:
            outcome = self._core.feedback(x, reference, numbers)
        except NOT_ARRAYS:
            outcome = self._core.feedback(*self._arrays(x, reference), numbers)
        if outcome is None:
            raise CallOrderError("feedback() needs a preparation: call prepare() first, or step() for both.")
        return Plan(numbers, outcome)

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.step`."""
        numbers = np.empty(self._size)
        if type(reference) is dict:  # as closed loops have it: to try it as an array takes longer than to look at it
            return Plan(numbers, self._core.step(*self._arrays(x, reference), numbers))
        try:
            outcome = self._core.step(x, reference, numbers)
        except NOT_ARRAYS:
            outcome = self._core.step(*self._arrays(x, reference), numbers)
        return Plan(numbers, outcome)

    def replay(self, x: Array, reference: Array, applied: Array) -> Array:
        """See `RealTimeIteration.replay`."""
        times = np.zeros((len(x), 3))
        data = [np.ascontiguousarray(array) for array in (x, reference, applied)]
        self._core.replay(data[0], data[1], data[2], times, len(times))
        return times

    def _arrays(self, x: Values, reference: ReferenceWindow) -> tuple[Array, Array]:
        """What the core reads: (nx,), (N + 1, ny)."""
        measurement = self._problem.model.states.vector(x, "x")
        return measurement, tracked(self._problem, reference, self._followed)
