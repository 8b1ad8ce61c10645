"""The C core as an engine, tailored or portable."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from threading import RLock
from typing import Any

import numpy as np

from rumo.controllers.arguments import ReferenceWindow, reference_window, tracked
from rumo.controllers.engines.described import core_problem, core_settings, numbers_of
from rumo.controllers.settings import Settings
from rumo.errors import CallOrderError
from rumo.kernel import NUMBERS, Build, Core, portable, tailored
from rumo.plan import Plan, PlanLayout
from rumo.signals import Array, Values
from rumo.status import STATUSES, Status
from rumo.transcription import Transcription


class CoreEngine:
    """Steps computed by the C core, portable or compiled for the problem. Threads that share it wait for each other."""

    def __init__(self, transcription: Transcription, settings: Settings, *, tailor: bool) -> None:
        self._lock = RLock()  # what the core computes with is what its plans' layout says
        self._problem = transcription.problem
        description = core_problem(transcription, settings.qp.solver)
        self._numbers = {name: description.values[name] for name in NUMBERS}
        self._build: Build = tailored(description) if tailor else portable()
        self.backend = self._build.name
        self._core = Core(self._build.table, description.values, asdict(core_settings(settings)))
        self._layout = PlanLayout(self._problem, settings.integrator_tolerance)

    def configure(self, settings: Settings) -> None:
        """See `Engine.configure`."""
        with self._lock:
            self._core.configure(asdict(core_settings(settings)))
            self._layout = PlanLayout(self._problem, settings.integrator_tolerance)

    def update(self, transcription: Transcription) -> None:
        """See `Engine.update`."""
        numbers = numbers_of(transcription)
        with self._lock:
            prepared = self._core.ready
            changed = {name: array for name, array in numbers.items() if not np.array_equal(array, self._numbers[name])}
            self._core.update(changed)
            self._problem, self._numbers = transcription.problem, numbers
            self._layout = PlanLayout(self._problem, self._layout.integrator_tolerance)
            if prepared and not self._core.ready:
                self._core.prepare()

    def reset(self, applied: Array) -> None:
        """See `Engine.reset`."""
        with self._lock:
            self._core.reset()
            self._core.set_applied(applied)

    def rest(self, x: Array) -> None:
        """See `Engine.rest`."""
        with self._lock:
            self._core.rest(x)

    def start(self, x: Array, u: Array) -> None:
        """See `Engine.start`."""
        with self._lock:
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
        with self._lock:
            self._core.prepare()

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.feedback`. Fastest for arrays: x (nx,) and reference (N + 1, ny), contiguous, of floats."""
        with self._lock:
            if not self._core.ready:
                raise CallOrderError("feedback() needs a preparation: call prepare() first, or step() for both.")
            return self._run(self._core.feedback, x, reference)

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.step`."""
        with self._lock:
            return self._run(self._core.step, x, reference)

    def replay(self, x: Array, reference: Array, applied: Array) -> Array:
        """See `RealTimeIteration.replay`."""
        times = np.zeros((len(x), 3))
        data = [np.ascontiguousarray(array) for array in (x, reference, applied)]
        with self._lock:
            self._core.replay(data[0], data[1], data[2], times, len(times))
        return times

    def _run(self, function: Any, x: Values, reference: ReferenceWindow) -> Plan:
        layout = self._layout
        numbers = np.empty(layout.size)
        try:
            outcome = function(x, reference, numbers)
        except (BufferError, TypeError, ValueError):
            measurement = self._problem.model.states.vector(x, "x")
            wanted = tracked(self._problem, reference_window(self._problem, reference))
            outcome = function(measurement, np.ascontiguousarray(wanted), numbers)
        status, cause, prepare, feedback, iterations, conflict = outcome
        named = self._names_of(conflict) if conflict else ()
        return Plan(layout, numbers, STATUSES[status], STATUSES[cause], prepare, feedback, iterations, named)

    def _names_of(self, conflict: list[tuple[int, int, int]]) -> tuple[str, ...]:
        """Limits in words: bounds of inputs, their increments, path constraints."""
        inputs, constraints = self._problem.model.inputs.names, self._problem.constraint_names.names
        kinds = (
            [f"bounds of {name}" for name in inputs],
            [f"move bounds of {name}" for name in inputs],
            constraints,
        )
        return tuple(f"{kinds[kind][index]} at stage {stage}" for kind, stage, index in sorted(conflict))
