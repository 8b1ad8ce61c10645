"""The real-time iteration, and the nonlinear program where a step of it is not to be trusted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

import numpy as np

from rumo.controllers.arguments import ReferenceWindow
from rumo.controllers.engines.core import CoreEngine
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.ipopt import Ipopt
from rumo.controllers.settings import NlpSettings, Settings
from rumo.forks import SharedLock
from rumo.plan import Plan
from rumo.signals import Array, Values
from rumo.status import Status
from rumo.transcription import Transcription

HANDED_OVER = (Status.UNTRUSTED, Status.BUDGET_EXCEEDED, Status.ILL_CONDITIONED, Status.SOLVER_FAILED)
"""Where the iteration came to nothing that can be trusted; what is wrong with measurement or reference stays wrong."""


class Rescued:
    """An engine beside which IPOPT solves the same sample, where a step of the engine's is not to be trusted.

    It starts from the engine's plan, with the measurement that the gate let pass and the same inputs decided. Its
    solution, if there is one before the time is over, is what the engine applies, follows and starts from next. Threads
    that share both wait until a step and its rescue are over.

    Parameters
    ----------
    engine : CoreEngine or Guarded
        Of the real-time iteration.
    settings : Settings
        What it was made with.
    nlp : NlpSettings
        Limits and accuracy of IPOPT.
    seconds : float
        For a step, IPOPT's solution included; that of the settings' QP options, if that is less.
    """

    def __init__(
        self,
        engine: CoreEngine | Guarded,
        transcription: Transcription,
        settings: Settings,
        nlp: NlpSettings,
        seconds: float,
    ) -> None:
        self._lock = SharedLock()
        self.engine = engine
        nlp = replace(nlp, gate=None)  # the engine has one
        self._nlp = Guarded(Ipopt(transcription, nlp, timed=True), nlp, "ipopt", read=False)
        self._most, self.backend = seconds, engine.backend
        self.configure(settings)

    def configure(self, settings: Settings) -> None:
        """See `Engine.configure`."""
        with self._lock:
            self.engine.configure(settings)
            self._seconds = min(self._most, settings.qp.time_limit)

    def update(self, transcription: Transcription) -> None:
        """See `Engine.update`."""
        with self._lock:
            self.engine.update(transcription)
            self._nlp.update(transcription)

    def reset(self, applied: Array) -> None:
        """See `Engine.reset`."""
        with self._lock:
            self.engine.reset(applied)

    def rest(self, x: Array) -> None:
        """See `Engine.rest`."""
        with self._lock:
            self.engine.rest(x)

    def start(self, x: Array, u: Array) -> None:
        """See `Engine.start`."""
        with self._lock:
            self.engine.start(x, u)

    @property
    def applied(self) -> Array:
        """See `Engine.applied`."""
        with self._lock:
            return self.engine.applied

    @applied.setter
    def applied(self, inputs: Array) -> None:
        with self._lock:
            self.engine.applied = inputs

    @property
    def counts(self) -> Counter[Status]:
        """See `Engine.counts`."""
        with self._lock:
            return self.engine.counts

    def prepare(self) -> None:
        """See `Engine.prepare`."""
        with self._lock:
            self.engine.prepare()

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.feedback`."""
        return self._complete(self.engine.feedback, x, reference)

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """See `Engine.step`."""
        return self._complete(self.engine.step, x, reference)

    def _complete(
        self, phases: Callable[[Values, ReferenceWindow], Plan], x: Values, reference: ReferenceWindow
    ) -> Plan:
        with self._lock:
            start, applied = perf_counter(), self.engine.applied
            plan = phases(x, reference)
            if plan.cause not in HANDED_OVER or perf_counter() - start >= self._seconds:
                return plan
            better = self._solved(plan, reference, applied, start + self._seconds)
            status = None if better is None else self.engine.adopt(self._nlp.trajectory, better.status)
            return plan.after(max(perf_counter() - start, plan.timings.waited), better, status)

    def _solved(self, plan: Plan, reference: ReferenceWindow, applied: Array, end: float) -> Plan | None:
        """The nonlinear program's plan, from the engine's; None if it is not solved by then."""
        x, nlp = self.engine.taken, self._nlp
        nlp.reset(applied)
        nlp.begins = dict(self.engine.begins)  # an angle's reference may be more than half a turn ahead
        if np.isfinite(plan.x.values).all():
            nlp.start(np.vstack([x, plan.x.values[1:]]), plan.u.values)
        nlp.seconds = end - perf_counter()
        better = nlp.step(x, reference)
        return better if better.trusted else None
