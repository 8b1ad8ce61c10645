"""The real-time iteration in the C core."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.controllers.base import ReferenceWindow
from rumo.controllers.fallback import Shift
from rumo.controllers.qp import QpOptions
from rumo.controllers.rti import RealTimeIteration
from rumo.errors import CallOrderError
from rumo.kernel import Build, Core, Settings, describe, portable, tailored
from rumo.plan import Plan
from rumo.signals import Array, Values
from rumo.status import Status

STATUSES = tuple(Status)


class CompiledRti(RealTimeIteration):
    """`RealTimeIteration(problem, backend="tailored")` or `"portable"`."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        description = self._describe()
        self._build: Build = portable() if self._requested == "portable" else tailored(description)
        self._backend = self._build.name
        self._core = Core(self._build.table, description.values, asdict(self._settings()))
        self.reset()

    @property
    def qp(self) -> QpOptions:
        """Limits and accuracy of the QP solver; may be set between steps."""
        return self._qp

    @qp.setter
    def qp(self, options: QpOptions) -> None:
        self._qp = options
        if hasattr(self, "_core"):
            self._core.configure(asdict(self._settings()))

    def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Forget everything, see `Controller.reset`."""
        decided = self._decided(applied)
        start = None if x is None else self.problem.model.states.finite_vector(x, "x")
        self._core.reset()
        self._parameters = self.problem.parameters
        self._core.set_applied(decided)
        if start is not None:
            self._core.start(start)

    @property
    def applied(self) -> Array:
        """Inputs already decided, see `Controller.applied`."""
        inputs = np.empty((max(self.problem.delay, 1), len(self.problem.model.inputs)))
        self._core.get_applied(inputs)
        return inputs

    @applied.setter
    def applied(self, inputs: Mapping[str, float] | ArrayLike) -> None:
        self._core.set_applied(self._decided(inputs))

    def _take_parameters(self) -> None:
        self._core.set_parameters(np.ascontiguousarray(self.transcription.given(self._parameters)))

    @property
    def status_counts(self) -> Counter[Status]:
        """Outcomes of all steps since the last reset."""
        counts = zip(STATUSES, self._core.counts(), strict=True)
        return Counter({status: count for status, count in counts if count})

    def prepare(self) -> None:
        """Do all that needs no measurement, see `Controller.prepare`."""
        self._core.prepare()

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """Return the plan for a measurement, see `Controller.feedback`.

        Fastest for arrays: x (nx,) and reference (N + 1, ny), contiguous, of floats.
        """
        if not self._core.ready:
            raise CallOrderError("feedback() needs a preparation: call prepare() first, or step() for both.")
        return self._run(self._core.feedback, x, reference)

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """`prepare()` and `feedback(x, reference)` in one call."""
        return self._run(self._core.step, x, reference)

    def replay(self, x: Array, reference: Array, applied: Array) -> Array:
        """Run recorded samples in a loop in C, for measuring.

        Parameters
        ----------
        x, reference, applied : ndarray, shapes (n, nx), (n, N + 1, ny), (n, max(delay, 1), nu)
            What the controller is told at each sample.

        Returns
        -------
        ndarray, shape (n, 3)
            Time of linearisation (NaN without a guess), of the preparation that it belongs to, and of feedback [s].
        """
        times = np.zeros((len(x), 3))
        data = [np.ascontiguousarray(array, dtype=float) for array in (x, reference, applied)]
        self._core.replay(data[0], data[1], data[2], times, len(times))
        return times

    def _run(self, function: Any, x: Values, reference: ReferenceWindow) -> Plan:
        numbers = np.empty(self._layout.size)
        try:
            outcome = function(x, reference, numbers)
        except (BufferError, TypeError, ValueError):
            measurement = self.problem.model.states.vector(x, "x")
            window = self._window(reference)
            wanted = np.column_stack([window[name] for name in self.problem.outputs])
            outcome = function(measurement, np.ascontiguousarray(wanted), numbers)
        status, cause, prepare, feedback, iterations, conflict = outcome
        return Plan(
            self._layout,
            numbers,
            STATUSES[status],
            STATUSES[cause],
            prepare,
            feedback,
            iterations,
            self._names_of(conflict) if conflict else (),
        )

    def _settings(self) -> Settings:
        gate = self.gate
        return Settings(
            sqp_iterations=self.sqp_iterations,
            preparation_iterations=self.preparation_iterations,
            sqp_tolerance=self.tolerance,
            qp_iterations=self.qp.max_iterations,
            qp_tolerance=self.qp.tolerance,
            qp_seconds=self.qp.time_limit,
            gate_width=np.inf if gate is None else gate.width,
            gate_patience=0 if gate is None else gate.patience,
        )

    def _describe(self) -> Any:
        problem, model = self.problem, self.problem.model
        penalties = [constraint.penalty for constraint in problem.constraints]
        scheme = self.transcription.discretization
        sizes = {
            "horizon": problem.horizon,
            "states": len(model.states),
            "algebraic": len(model.algebraic),
            "inputs": len(model.inputs),
            "outputs": len(problem.outputs),
            "constraints": len(problem.constraints),
            "parameters": self.transcription.interval.size1_in(3),
            "delay": problem.delay,
            "inner": len(scheme.inner(len(model.states), len(model.algebraic))),
            "substeps": scheme.substeps,
            "explicit_scheme": scheme.explicit,
            "blocks": len(problem.blocks.lengths),
            "shift_same_rows": int(problem.uniform),
        }
        names = ("output_weights", "input_scales", "input_lower", "input_upper", "move_lower", "move_upper")
        values = {name: getattr(problem, name) for name in (*names, "safe_input", "constraint_scales")}
        shift, blocks = Shift(self.transcription), problem.blocks
        values |= {f"shift_{name}": getattr(shift, name) for name in ("stages", "shares", "intervals")}
        blocking = {"block": blocks.block_of, "share": blocks.shares(), "part": blocks.parts()}
        for name, array in blocking.items():  # of all intervals; those before the first free one have none
            values[f"blocking_{name}"] = np.concatenate([np.zeros(problem.delay, array.dtype), array])
        lower, upper = problem.block_move_bounds
        values |= {
            "move_weights": problem.block_move_weights,
            "block_lower": lower,
            "block_upper": upper,
            "l1": np.array([np.inf if penalty is None else penalty.l1 for penalty in penalties]),
            "l2": np.array([0.0 if penalty is None else penalty.l2 for penalty in penalties]),
            "imposed": self.transcription.imposed,
            "inner_signals": self.transcription.inner_signals,
            "inner_nodes": self.transcription.inner_nodes,
            "algebraic_guess": model.algebraic_guess,
            "parameter_values": self.transcription.given(problem.parameters),
        }
        return describe(self.transcription.program(), sizes, values)

    def _names_of(self, conflict: list[tuple[int, int, int]]) -> tuple[str, ...]:
        """Limits in words: bounds of inputs, their increments, path constraints."""
        inputs, constraints = self.problem.model.inputs.names, self.problem.constraint_names.names
        kinds = (
            [f"bounds of {name}" for name in inputs],
            [f"move bounds of {name}" for name in inputs],
            constraints,
        )
        return tuple(f"{kinds[kind][index]} at stage {stage}" for kind, stage, index in sorted(conflict))
