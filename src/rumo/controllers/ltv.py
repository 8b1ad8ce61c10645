"""Linearisation along the reference: no iteration, the method the paper calls cheaper but worse."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.controllers.base import Controller
from rumo.controllers.engines.base import Candidate
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.numpy import NumpyRti
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import LtvSettings, Settings, changed
from rumo.discretization import Discretization
from rumo.errors import ArgumentError
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Transcription


class LinearTimeVarying(Controller[LtvSettings]):
    """Linear time-varying MPC: the same QP as the real-time iteration, about the reference instead of the last plan.

    The reference must name every state of the model; inputs that it leaves out are linearised about the
    safe input. A plan to engage with changes nothing: no step starts from one.

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        The problem's if not given; implicit Euler if it has none.
    settings : LtvSettings
        Limits and accuracy of the QP solver, and the gate.
    **changes
        Single settings by name, such as `gate=None`.
    """

    name = "ltv"

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        settings: LtvSettings = LtvSettings(),
        **changes: Any,
    ) -> None:
        transcription, settings = Transcription(problem, discretization), changed(settings, changes, LtvSettings)
        method = _AlongReference(transcription, Settings(qp=settings.qp))
        super().__init__(transcription, Guarded(method, settings), settings)


class _AlongReference(NumpyRti):
    """One iteration about a trajectory that comes with the measurement."""

    @property
    def signals(self) -> tuple[str, ...]:
        model = self.transcription.problem.model
        return tuple(dict.fromkeys((*super().signals, *model.states, *model.inputs)))

    @property
    def weighed(self) -> tuple[str, ...]:
        model = self.transcription.problem.model
        return tuple(name for name in super().weighed if name not in model.states)

    def check(self, window: Mapping[str, Array]) -> None:
        missing = [name for name in self.transcription.problem.model.states if name not in window]
        if missing:
            raise ArgumentError(
                "reference",
                f"no values for {', '.join(missing)}",
                "values for every state of the model",
                "LinearTimeVarying linearises along the reference.",
            )

    def configure(self, settings: LtvSettings) -> None:
        super().configure(Settings(qp=settings.qp))

    def prepare(self, guess: Trajectory, applied: Array) -> float | None:
        return 0.0

    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        if guess.resting:
            self.missed()
        return self.iterate(x, window, applied) if self.linearize(self._trajectory(window), applied) else None

    def _trajectory(self, window: Mapping[str, Array]) -> Trajectory:
        problem = self.transcription.problem
        model, N = problem.model, problem.horizon
        named = dict(zip(model.inputs, np.tile(problem.safe_input[:, None], N + 1), strict=True)) | dict(window)
        u = np.column_stack([named[name][:N] for name in model.inputs])
        x = np.column_stack([named[name] for name in model.states])
        return Trajectory(u, x, self.transcription.inner_between(x[:-1], x[1:]))
