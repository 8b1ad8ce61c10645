"""What all controllers share: their interface, around the engine that computes their steps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from inspect import signature
from typing import Any, Generic, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, as_numbers, known_names
from rumo.controllers.arguments import Inputs, ReferenceWindow, decided_inputs
from rumo.controllers.engines.base import Engine
from rumo.controllers.explanation import Explanation, explain, local_error
from rumo.controllers.instability import warn_of_misjudged_mode
from rumo.controllers.settings import S, changed
from rumo.errors import ArgumentError, FrozenError, ShapeError, UnknownNameError
from rumo.forks import SharedLock
from rumo.interrupts import interruptible
from rumo.numbers import ProblemNumbers
from rumo.plan import Plan
from rumo.problem import Problem
from rumo.sealed import Sealed
from rumo.signals import Array, NamedArray, Values
from rumo.status import Status
from rumo.transcription import Transcription

CHANGES = tuple(signature(Problem.changed).parameters)[1:]
"""What `Controller.update` takes."""


class Controller(Sealed, Generic[S]):
    """A model predictive controller: `prepare()`, then `feedback(x, reference)`, once each sample.

    Threads may share it: steps wait for each other, and so do changes, of which none is lost.

    Parameters
    ----------
    transcription : Transcription
        The discretised problem.
    engine : Engine
        What computes the steps: `Guarded(method, settings)` for a method of one's own.
    settings : ControllerSettings
        What the engine was made with.
    """

    name = "controller"

    def __init__(self, transcription: Transcription, engine: Engine, settings: S) -> None:
        self._lock = SharedLock()  # around what is read, changed and written back; steps have the engine's
        self._transcription = transcription
        self._engine = engine
        self._settings = settings
        engine.reset(decided_inputs(self.problem, None))
        warn_of_misjudged_mode(transcription)

    @property
    def problem(self) -> Problem:
        """What is solved, with the numbers of now: see `update`."""
        return self._transcription.problem

    @property
    def transcription(self) -> Transcription:
        """The discretised problem."""
        return self._transcription

    @property
    def settings(self) -> S:
        """Frozen; set others, or change single ones by `configure`, between two steps."""
        return self._settings

    @settings.setter
    def settings(self, settings: S) -> None:
        with self._lock:
            settings = changed(settings, {}, type(self._settings))
            self._engine.configure(settings)
            self._settings = settings

    def configure(self, **changes: Any) -> None:
        """Change single settings from the next call on: `configure(gate=None)`.

        Raises
        ------
        UnknownNameError
            If there is no such setting.
        ArgumentError
            If a value cannot work; then nothing has changed.
        """
        with self._lock:
            self.settings = changed(self._settings, changes, type(self._settings))

    def update(self, **changes: Any) -> None:
        """Change numbers of the problem from the next preparation on: `update(weights={"p_y": 20.0})`.

        Takes what `Problem.changed` takes, raises what it raises, and then nothing has changed. Guess, plan and counts
        stay; nothing is compiled. What was prepared is prepared again.
        """
        for name in changes:
            if name not in CHANGES:
                raise UnknownNameError("update", name, CHANGES)
        with self._lock:
            self.renumber(self.problem.changed(**changes).numbers)

    def renumber(self, numbers: ProblemNumbers) -> None:
        """Take all numbers of another problem of the same structure from the next preparation on, as `update` does.

        Parameters
        ----------
        numbers : ProblemNumbers
            Of a problem that differs from this controller's in numbers alone.
        """
        with self._lock, interruptible():
            transcription = self._transcription.renumbered(self.problem.renumbered(numbers))
            self._engine.update(transcription)
            self._transcription = transcription

    @property
    def parameters(self) -> Array:
        """Values of the model's parameters on each interval (N, np_), read-only.

        Set some by a mapping from names to numbers, or N numbers each, here or by `update(parameters=...)`; the others
        stay what they are. They are kept until they are set again.
        """
        return self.problem.parameters

    @parameters.setter
    def parameters(self, values: Mapping[str, ArrayLike]) -> None:
        self.update(parameters=as_mapping(values, "parameters"))

    def reset(self, x: Values | None = None, applied: Inputs | None = None) -> None:
        """Forget guess, plan and counts; settings and numbers stay.

        Parameters
        ----------
        x : mapping or sequence, (nx,), optional
            State to prepare the first step for.
        applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
            Inputs already decided; the safe input if not given.
        """
        with self._lock:
            decided = decided_inputs(self.problem, applied)
            state = None if x is None else self.problem.model.states.finite_vector(x, "x")
            self._engine.reset(decided)
            if state is not None:
                self._engine.rest(state)

    def engage(
        self, *, applied: Inputs, x: Values | None = None, plan: Plan | Mapping[str, ArrayLike] | None = None
    ) -> None:
        """Take over without a bump: start from what the actuators do, whoever has moved them until now.

        Parameters
        ----------
        applied : mapping, or array_like (nu,) or (max(delay, 1), nu)
            What the actuators do now and, with a delay, what is already on its way to them.
        x : mapping or sequence, (nx,), optional
            State to prepare the first step for.
        plan : Plan, or mapping with "x" (N + 1, nx) and "u" (N, nu), optional
            Where to linearise first, instead of a state at rest. What has names must have those of this problem.
        """
        guess = None if plan is None else self._guess(plan)
        with self._lock:
            self.reset(x, applied)
            if guess is not None:
                self._engine.start(*guess)

    @property
    def applied(self) -> Array:
        """Inputs already decided, shape (max(delay, 1), nu), oldest first, read-only.

        Those of the next `delay` intervals or, without delay, the last one applied. Each step appends its
        command; set all of them, `controller.applied = ...`, where something else was applied.
        """
        applied = self._engine.applied
        applied.flags.writeable = False
        return applied

    @applied.setter
    def applied(self, inputs: Inputs) -> None:
        self._engine.applied = decided_inputs(self.problem, inputs)

    @property
    def status_counts(self) -> Counter[Status]:
        """Outcomes of all steps since the last reset."""
        return self._engine.counts

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """`prepare()` and `feedback(x, reference)` in one call."""
        return self._engine.step(x, reference)

    def prepare(self) -> None:
        """Do all that needs no measurement. Before the first step there is nothing to do."""
        self._engine.prepare()

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """Return the plan for a measurement.

        Parameters
        ----------
        x : mapping or sequence, (nx,)
            Measured or estimated state; NaN where there is none.
        reference : mapping of str to float or array_like (N + 1,), or array_like (N + 1, ny)
            Wanted outputs from now to the end of the horizon; a number is held. A mapping may name
            further states and inputs of the model, for controllers that linearise along the reference.

        Raises
        ------
        ShapeError
            If x or the reference has the wrong shape.
        UnknownNameError
            If one of them names a signal that does not exist.
        ArgumentError
            If the reference leaves out a tracked output.
        CallOrderError
            If `prepare()` was not called since the last feedback.
        """
        return self._engine.feedback(x, reference)

    def explain(self, plan: Plan) -> Explanation:
        """What limits a plan of this controller: stiffness, active and violated constraints, convergence.

        With the numbers that the plan was made with, whatever `update` has changed since. Takes milliseconds: it
        estimates the local error too.
        """
        return explain(plan, self._transcription.discretization)

    def local_error(self, plan: Plan) -> NamedArray[Array]:
        """Error of each interval of a plan (N, nx), estimated by one with twice as many substeps."""
        return local_error(plan, self._transcription.discretization)

    def __setattr__(self, name: str, value: Any) -> None:
        if self._constructed and hasattr(self._settings, name) and not hasattr(self, name):
            raise FrozenError(f"{name} is one of the settings: write controller.configure({name}={value!r}).")
        super().__setattr__(name, value)

    def _guess(self, plan: Plan | Mapping[str, ArrayLike]) -> tuple[Array, Array]:
        """States and inputs of the user's, checked."""
        problem = self.problem
        model, N = problem.model, problem.horizon
        parts = {"u": plan.u, "x": plan.x} if isinstance(plan, Plan) else as_mapping(plan, "plan")
        known_names(parts, "plan", ("x", "u"))
        arrays: list[Array] = []
        for name, rows, signals in (("u", N, model.inputs), ("x", N + 1, model.states)):
            argument, shape = f"plan[{name!r}]", (rows, len(signals))
            if name not in parts:
                raise ArgumentError("plan", f"no {name!r}", "a Plan, or a mapping with 'x' and 'u'")
            part = parts[name]
            if isinstance(part, NamedArray):
                if part.signals.names != signals.names:
                    raise ArgumentError(
                        argument,
                        f"values of {', '.join(part.signals)}",
                        f"those of {', '.join(signals)}",
                        "Give arrays, in this order.",
                    )
                part = part.values
            array = as_numbers(part, argument).copy()
            if array.shape != shape:
                raise ShapeError(argument, f"shape {array.shape}", f"shape {shape}")
            if not np.isfinite(array).all():
                raise ArgumentError(argument, "NaN or infinity", "finite numbers")
            arrays.append(array)
        u, x = arrays
        return x, u

    def __reduce__(self) -> NoReturn:
        raise TypeError("A controller cannot be copied or pickled. Make another one of its problem and settings.")

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.problem!r})"
