"""The real-time iteration: one linearisation and one QP per sample."""

from __future__ import annotations

import logging
import os
from typing import Any

import numpy as np

from rumo.checks import as_numbers
from rumo.controllers.base import Controller
from rumo.controllers.engines.core import CoreEngine
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.numpy import NumpyRti
from rumo.controllers.engines.rescued import Rescued
from rumo.controllers.nlp import DirectNlp
from rumo.controllers.settings import NlpSettings, Settings, changed
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, ShapeError, UnknownNameError
from rumo.problem import Problem
from rumo.recording import missing_operation
from rumo.signals import Array
from rumo.transcription import Transcription

BACKENDS = ("auto", "tailored", "portable", "reference")

logger = logging.getLogger("rumo")


class RealTimeIteration(Controller[Settings]):
    """Real-time iteration on an implicit discretisation (Diehl, 2001; Wagner and Normey-Rico).

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        The problem's if not given; implicit Euler if it has none.
    settings : Settings
        Iterations, limits of the QP solver, the gate.
    backend : str
        What computes the steps: "tailored", the C core compiled for this problem on first use and kept in the user's
        cache; "portable", the C core as installed; "reference", NumPy, some hundred times slower. "auto" takes the
        first that works, or what the environment variable RUMO_BACKEND says. Without a working compiler, "tailored" is
        "portable", and the logger "rumo" says why.
    rescue : type of DirectNlp, or DirectNlp, optional
        Has IPOPT solve the nonlinear program of a sample whose plan is not trusted: `rumo.DirectNlp`, within the
        sampling time, or one of the same problem and scheme whose settings are taken, within its `max_wall_time`; and
        within what is left of `QpOptions.time_limit`. Its solution is applied then, followed and iterated from next:
        see `plan.rescued`.
    **changes
        Single settings by name, such as `sqp_iterations=3`.
    """

    name = "rti"

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        settings: Settings = Settings(),
        backend: str = "auto",
        rescue: type[DirectNlp] | DirectNlp | None = None,
        **changes: Any,
    ) -> None:
        settings = changed(settings, changes, Settings)
        backend = requested(backend)
        transcription = Transcription(problem, discretization)
        rescuer = None if rescue is None else _rescuer(rescue, transcription)
        engine = _engine(transcription, settings, backend)
        super().__init__(
            transcription, engine if rescuer is None else Rescued(engine, transcription, settings, *rescuer), settings
        )

    @property
    def backend(self) -> str:
        """What computes the steps: "tailored", "portable" or "reference"."""
        return self._engine.backend

    def replay(self, x: Array, reference: Array, applied: Array) -> Array:
        """Run recorded samples in a loop in C, for measuring; for the backends in C only.

        Parameters
        ----------
        x, reference, applied : ndarray, shapes (n, nx), (n, N + 1, ny), (n, max(delay, 1), nu)
            What the controller is told at each sample.

        Returns
        -------
        ndarray, shape (n, 3)
            Time of linearisation (NaN without a guess), of the preparation that it belongs to, and of feedback [s].
        """
        if isinstance(self._engine, Rescued):
            raise ArgumentError("rescue", "a controller beside the loop in C", "none, to replay")
        if not isinstance(self._engine, CoreEngine):
            raise ArgumentError("backend", repr(self.backend), "one in C, tailored or portable, to replay")
        problem, told = self.problem, {"x": x, "reference": reference, "applied": applied}
        arrays = {name: as_numbers(values, name) for name, values in told.items()}
        window, decided = (problem.horizon + 1, len(problem.outputs)), self.applied.shape
        for name, shape in ("x", (len(problem.model.states),)), ("reference", window), ("applied", decided):
            expected = arrays["x"].shape[:1] + shape
            if arrays[name].shape != expected:
                raise ShapeError(name, f"shape {arrays[name].shape}", f"shape {expected}")
        if not np.isfinite(arrays["applied"]).all():
            raise ArgumentError("applied", "NaN or infinity", "finite inputs")
        return self._engine.replay(**arrays)


def requested(backend: str) -> str:
    """The backend asked for, here or by the environment."""
    if backend not in BACKENDS:
        raise UnknownNameError("backend", backend, BACKENDS)
    if backend == "auto":
        backend = os.environ.get("RUMO_BACKEND", "auto")
        if backend not in BACKENDS:
            raise UnknownNameError("RUMO_BACKEND", backend, BACKENDS, "Correct the environment variable, or unset it.")
    return backend


def _rescuer(rescue: type[DirectNlp] | DirectNlp, transcription: Transcription) -> tuple[NlpSettings, float]:
    """Settings of the nonlinear program that rescues a step, and the time [s] for both."""
    given: Any = rescue
    if isinstance(given, type) and issubclass(given, DirectNlp):
        return NlpSettings(), transcription.problem.sampling_time
    expected = "rumo.DirectNlp, or one of this problem and scheme"
    if not isinstance(given, DirectNlp):
        raise ArgumentError("rescue", repr(rescue), expected)
    if given.problem is not transcription.problem:
        raise ArgumentError(
            "rescue", f"one of another problem, {given.problem!r}", expected, "Hand both the same object, or the class."
        )
    scheme, other = transcription.discretization, given.transcription.discretization
    if other != scheme:
        raise ArgumentError("rescue", f"one with {other!r}", f"one with {scheme!r}", "Hand over the class.")
    return given.settings, given.settings.max_wall_time


def _engine(transcription: Transcription, settings: Settings, backend: str) -> CoreEngine | Guarded:
    missing = None if backend == "reference" else missing_operation(transcription.problem)
    if missing is not None:
        message = f"The C core lacks the operation {missing}, which {transcription.problem.model.name} uses."
        if backend != "auto":
            raise ArgumentError("backend", repr(backend), '"auto" or "reference" for this model', message)
        logger.warning("%s The slow reference backend is used.", message)
    if backend == "reference" or missing is not None:
        return Guarded(NumpyRti(transcription, settings), settings, "reference")
    return CoreEngine(transcription, settings, tailor=backend != "portable")
