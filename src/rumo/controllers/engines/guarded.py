"""The phases of a step around a method in Python, inside the guard: what is applied, whatever happened."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from time import perf_counter

import numpy as np

from rumo.controllers.arguments import ReferenceWindow, reference_window
from rumo.controllers.engines.base import UNKNOWN, Candidate, Method
from rumo.controllers.engines.described import core_settings, guard_of, limits_of
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import ControllerSettings
from rumo.errors import CallOrderError
from rumo.forks import SharedLock
from rumo.interrupts import interruptible
from rumo.kernel import SLACK_TOLERANCE
from rumo.kernel import Trajectory as Followed
from rumo.plan import INTEGRATOR_TOLERANCE, Outcome, Plan, PlanLayout
from rumo.signals import Array, Values
from rumo.status import STATUSES, Status
from rumo.transcription import Transcription

PATH_CONSTRAINT = 2
"""See `rumo_limit` in rumo_core.h."""


class Guarded:
    """An engine around a method that proposes a trajectory. Threads that share it wait for each other.

    Parameters
    ----------
    method : Method
        How a step is solved.
    settings : ControllerSettings
        The gate among them.
    backend : str
        What users call it.
    read : bool
        Whether measurements are what sensors read; else states of now, which another engine has judged.

    Attributes
    ----------
    seconds : float
        Time for a step, of which the method is told the end; infinite for any.
    begins : dict
        Where the last reference of each angle began, without jumps of a turn: there the next one goes on.
    """

    def __init__(self, method: Method, settings: ControllerSettings, backend: str = "numpy", read: bool = True) -> None:
        self.backend = backend
        self.method = method
        self._lock = SharedLock()
        self._guard = guard_of(method.transcription, settings, read)
        self._guess: Trajectory | None = None  # where the next step linearises or starts from
        self._wanted: Mapping[str, Array] | None = None  # the last reference
        self.begins: dict[str, float] = {}
        self._followed: Followed | None = None  # the last plan, until the monitor has it,
        self._adopted = False  # and whether it was found elsewhere
        self._prepared, self._prepare_time = False, 0.0
        self._conflict: list[tuple[int, int, int]] = []  # hard constraints that the last solution exceeded
        self._problem = method.transcription.problem
        self.configure(settings)

    def configure(self, settings: ControllerSettings) -> None:
        """See `Engine.configure`."""
        with self._lock:
            self.method.configure(settings)  # it may refuse them
            self._guard.configure(core_settings(settings))
            self.seconds = core_settings(settings).seconds
            self._gated = settings.gate is not None
            self._integrator_tolerance = getattr(settings, "integrator_tolerance", INTEGRATOR_TOLERANCE)
            self._layout = PlanLayout(self._problem, self._integrator_tolerance)

    def update(self, transcription: Transcription) -> None:
        """See `Engine.update`."""
        with self._lock:
            self.method.update(transcription)  # it may refuse them
            self._guard.update(limits_of(transcription.problem))
            self._problem = transcription.problem
            self._layout = PlanLayout(self._problem, self._integrator_tolerance)
            prepared, self._prepared = self._prepared, False
            if prepared:
                self.prepare()

    def reset(self, applied: Array) -> None:
        """See `Engine.reset`."""
        with self._lock:
            self._guard.reset()
            self._guard.applied = applied
            self._guess = self._wanted = self._followed = None
            self.begins = {}
            self._prepared, self._prepare_time = False, 0.0
            self.method.reset()

    def rest(self, x: Array) -> None:
        """See `Engine.rest`."""
        with self._lock:
            self._guess, self._prepared = self._at_rest(x), False

    def start(self, x: Array, u: Array) -> None:
        """See `Engine.start`."""
        with self._lock:
            self._guard.rest()
            self._guess, self._prepared = self._beginning(x, u), False

    def _at_rest(self, x: Array) -> Trajectory:
        return replace(self._beginning(np.tile(x, (self._problem.horizon + 1, 1)), self._guard.rest()), still=True)

    def _beginning(self, x: Array, u: Array) -> Trajectory:
        """A guess without a plan behind it; what lies within its intervals is on the way from state to state."""
        return Trajectory(u, x, self.method.transcription.inner_between(x[:-1], x[1:]), resting=True)

    @property
    def applied(self) -> Array:
        """See `Engine.applied`."""
        with self._lock:
            return self._guard.applied

    @applied.setter
    def applied(self, inputs: Array) -> None:
        with self._lock:
            self._guard.applied = inputs

    @property
    def counts(self) -> Counter[Status]:
        """See `Engine.counts`."""
        return self._guard.counts

    @property
    def taken(self) -> Array:
        """The last measurement (nx,) as it was used: some readings are predicted."""
        return self._guard.taken

    @property
    def trajectory(self) -> Trajectory:
        """What is applied, with all unknowns of its intervals."""
        return Trajectory(*self._guard.plan)

    def adopt(self, trajectory: Trajectory, status: Status) -> Status:
        """Instead of the last step's plan, apply another of the same sample, found elsewhere, and go on from it."""
        with self._lock:
            self._guard.take_back()
            status, _ = self._guard.follow(trajectory.parts, status)
            self._followed, later = self._guard.plan, self._guard.next
            self._adopted = True
            self._guess = None if later is None else Trajectory(*later)
            self._prepared = False
            return status

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.step`."""
        with self._lock:
            start = perf_counter()
            self.method.end = start + self.seconds
            measurement, window = self._checked(x, reference)
            checking = perf_counter() - start
            if not self._guard.has_guess and np.isfinite(measurement).all():
                self.rest(self._guard.unwound(measurement))
            before = 0.0
            if not self._prepared:
                self._prepare_in_time()
                before = self._prepare_time
            return self._complete(measurement, window, perf_counter() - checking, before)

    def prepare(self) -> None:
        """See `Engine.prepare`."""
        with self._lock:
            self.method.end = np.inf  # no one waits for it
            self._prepare_in_time()

    def _prepare_in_time(self) -> None:
        with interruptible():
            start = perf_counter()
            with np.errstate(all="ignore"):
                self._expect()
                if self._guess is not None and not (self._keep(self._guess) and self._advance(self._guess)):
                    self._guard.drop()
                    self._guess = None
            self._prepared = True
            self._prepare_time = perf_counter() - start

    def _expect(self) -> None:
        """What the next readings depend on: for the monitor and for old readings, once a plan."""
        plan, self._followed = self._followed, None
        if plan is not None and (self._gated or self._problem.sensors.age.any()):
            with suppress(np.linalg.LinAlgError):
                method, followed = self.method, Trajectory(*plan)
                A = Method.dependence(method, followed) if self._adopted else method.dependence(followed)
                self._guard.expect(A)

    def _keep(self, guess: Trajectory) -> bool:
        """Prepare at a guess; whether it gives numbers, and the guard keeps it."""
        straying = self.method.prepare(guess, self._guard.applied)
        return straying is not None and self._guard.keep(straying)

    def _advance(self, guess: Trajectory) -> bool:
        return self._wanted is None or self.method.advance(guess.x[0], self._wanted, self._guard.applied)

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.feedback`."""
        with self._lock:
            if not self._prepared:
                raise CallOrderError("feedback() needs a preparation: call prepare() first, or step() for both.")
            start = perf_counter()
            self.method.end = start + self.seconds
            return self._complete(*self._checked(x, reference), start)

    def _checked(self, x: Values, reference: ReferenceWindow) -> tuple[Array, Mapping[str, Array]]:
        """Measurement and reference as arrays; raises before anything changes."""
        measurement = self._problem.model.states.vector(x, "x")
        window = reference_window(self._problem, reference)
        self.method.check(window)
        return measurement, window

    def _complete(self, measurement: Array, window: Mapping[str, Array], start: float, before: float = 0.0) -> Plan:
        """The plan for a measurement and a reference that have been checked, in a feedback that began at `start`.

        Whoever called for it has waited for some time `before` [s].
        """
        with interruptible():
            with np.errstate(all="ignore"):
                candidate, cause = self._attempt(measurement, window)
            if candidate is None:
                self.method.missed()
            status, cause = self._guard.follow(None if candidate is None else candidate.trajectory.parts, cause)
            self._followed, self._adopted = self._guard.plan, False
            later = self._guard.next if self._guard.has_guess else None
            self._guess = None if later is None else Trajectory(*later)
            self._prepared = False
            return self._plan(candidate, status, cause, start, before)

    def _attempt(self, x: Array, window: Mapping[str, Array]) -> tuple[Candidate | None, Status]:
        """What the method comes to, if the measurement can be used, and how far it got."""
        self._conflict = []
        window = self._unwound(self._filled(window), self._guard.unwound(x))
        wanted = np.concatenate([window[name] for name in self.method.signals if name in window])
        if np.isfinite(wanted).all():
            self._wanted = window
        admitted = self._guard.admit(x, wanted, self.method.reach())
        if admitted is not Status.OPTIMAL:
            return None, admitted
        self.method.begin_sample(self._guard.surprised)
        x = self._guard.taken
        guess = self._guess
        if guess is None or not self._guard.has_guess:  # what was predicted is wrong
            return self._solved(x, window, None)
        candidate, cause = self._solved(x, window, guess)
        in_time = perf_counter() <= self.method.end
        if candidate is None and self.method.restarts and not guess.still and in_time:
            return self._solved(x, window, None)
        return candidate, cause

    def _solved(
        self, x: Array, window: Mapping[str, Array], prepared: Trajectory | None
    ) -> tuple[Candidate | None, Status]:
        """What the method comes to from the guess prepared, or from the state alone, and how far it got."""
        self._conflict = []
        guess = self._at_rest(x) if prepared is None else prepared
        if prepared is None and self.method.prepare(guess, self._guard.applied) is None and not self.method.restarts:
            return None, Status.SOLVER_FAILED
        candidate = self.method.solve(x, window, guess, self._guard.applied)
        if candidate is None:
            return None, Status.SOLVER_FAILED
        finite = candidate.trajectory.finite and bool(np.isfinite(candidate.constraints).all())
        if finite and candidate.status.applicable:
            self._conflict = self._broken(candidate)
            return (None, Status.SOLVER_FAILED) if self._conflict else (candidate, self._assessed(candidate))
        return None, Status.SOLVER_FAILED if candidate.status.solved else candidate.status

    def _filled(self, window: Mapping[str, Array]) -> Mapping[str, Array]:
        """The window; a number that is missing where it has no weight is that of the stage after."""
        filled = dict(window)
        for name in self.method.weighed:
            if not np.isfinite(window[name]).all():
                weights = self._problem.output_weights[:, self._problem.outputs.index(name)]
                values = np.append(window[name], 0.0)
                for k in reversed(range(len(weights) + 1)):
                    if not np.isfinite(values[k]) and (k == 0 or weights[k - 1] == 0.0):
                        values[k] = values[k + 1]
                filled[name] = values[:-1]
        return filled

    def _unwound(self, window: Mapping[str, Array], x: Array) -> Mapping[str, Array]:
        """The window; angles go on from where they began before, or from the measurement, without jumps of a turn."""
        unwound, states = dict(window), self._problem.model.states
        for name in (name for name in self.method.signals if name in states and name in window):
            i = states.index(name)
            if self._problem.sensors.turn[i] and np.isfinite(window[name]).all():
                before = self.begins.get(name, float(x[i]))
                start = before if np.isfinite(before) else window[name][0]
                unwound[name] = np.unwrap(np.r_[start, window[name]])[1:]
                self.begins[name] = unwound[name][0]
        return unwound

    def _assessed(self, candidate: Candidate) -> Status:
        """A candidate's status, lowered to SOFT_VIOLATED where soft constraints exceed 0."""
        soft = np.isfinite(self._problem.numbers.l1)
        violated = (
            candidate.status is Status.OPTIMAL and self.method.exceeded(candidate, SLACK_TOLERANCE)[:, soft].any()
        )
        return Status.SOFT_VIOLATED if violated else candidate.status

    def _broken(self, candidate: Candidate) -> list[tuple[int, int, int]]:
        """Hard constraints that a solution exceeds, since no input moves them where they were linearised."""
        if candidate.status is not Status.OPTIMAL:
            return []
        return [(PATH_CONSTRAINT, int(k) + 1, int(j)) for k, j in np.argwhere(self.method.broken(candidate))]

    def _plan(self, candidate: Candidate | None, status: Status, cause: Status, start: float, before: float) -> Plan:
        problem, applied = self._problem, self._guard.plan
        nothing = np.full((problem.horizon, len(problem.constraints)), np.nan)
        constraints, diagnostics = (
            (nothing, UNKNOWN) if candidate is None else (candidate.constraints, candidate.diagnostics)
        )
        parts = applied.u, applied.x, constraints, applied.inner[:, : len(problem.model.algebraic)], diagnostics
        numbers = np.concatenate([part.ravel() for part in parts])
        ranks = STATUSES.index(status), STATUSES.index(cause)
        feedback, conflict, health = perf_counter() - start, self._conflict or None, self._guard.health
        times = self._prepare_time, feedback, before + feedback
        said = health.tolist() if health.any() else None
        return Plan(numbers, Outcome(self._layout, *ranks, *times, conflict=conflict, health=said))
