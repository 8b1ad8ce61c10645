"""A step that is safeguarded: where the first iteration is not to be trusted, others follow.

At first full steps, while each is less than half the one before: Newton's method where it converges. Else from the
guess again, with steps cut so that each is worth it on the nonlinear problem, see `merit`. As core/src/settle.c.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rumo.controllers.arguments import tracked
from rumo.controllers.engines.base import Candidate
from rumo.controllers.engines.merit import Worth, price_for, promise_of_step, worth_of_guess
from rumo.controllers.engines.stagewise import eliminate
from rumo.controllers.engines.trajectory import Trajectory
from rumo.signals import Array
from rumo.status import Status

if TYPE_CHECKING:
    from rumo.controllers.engines.numpy import NumpyRti

STRAYED = 0.03
"""A guess farther from the dynamics than this share of what the inputs can do has strayed, as in core/src/guard."""
SETTLED = 0.01
"""What may be left of the inputs' changes, over their ranges, once settled; or, where that is not known, the last."""
SETTLED_STEP = 1e-3
CONVERGING = 0.5
"""Iterations converge if each step is less than this share of the one before."""
LEAST_CONTRACTION = 0.05
"""One that is less may be luck."""
SHARE_HELD = 0.1
"""Of what a step promises, what it has to hold."""
CUTS = 12
NO_PROMISE = 1e-12
"""Promises that are rounding, over the merit."""
SWEEPS = 20
ROLLED_OUT = 1e-9
"""Newton's corrections that are none, over the largest size of a state."""


def error_left(before: float, size: float) -> float:
    """What steps add up to that are still to come, if each is less than half the one before; NaN if this was not."""
    return max(size, LEAST_CONTRACTION * before) if size < CONVERGING * before else np.nan


class Settling:
    """The iterations of one sample: a measurement x (nx,), a reference by signal (N + 1,), inputs already decided."""

    def __init__(self, rti: NumpyRti, x: Array, window: Mapping[str, Array], applied: Array) -> None:
        self._rti, self._x, self._window, self._applied = rti, x, window, applied
        self._reference = tracked(rti.transcription.problem, window)[1:]
        self._price = 0.0
        self._iterations = 1
        self._alone = False  # whether they begin with the state alone

    def is_settled(self, candidate: Candidate, before: float = np.nan) -> bool:
        """Whether no further iteration is needed; `before` is the size of the step before, NaN if that is not known."""
        rti, settings = self._rti, self._rti.settings
        size = rti.step_size
        if self._iterations < settings.sqp_iterations and not rti.change(candidate.trajectory) < settings.tolerance:
            return False
        if not rti.horizon.straying < STRAYED:
            return False
        if self._iterations == 1 and rti.wary:
            return False
        if self._iterations == 1 and size <= settings.trusted_step:
            return True
        if self._iterations > 1 and not rti.change(candidate.trajectory) < STRAYED:
            return False  # states may go on where all inputs are at bounds
        return size <= SETTLED_STEP or error_left(before, size) <= SETTLED

    def settle(self, candidate: Candidate) -> Candidate | None:
        """After a first iteration that is not to be trusted; None if nothing came of it."""
        if self._is_last:
            return replace(candidate, status=Status.UNTRUSTED)
        start = self._rti.about
        settled, candidate = self._take_full_steps(candidate)
        if settled or self._is_last:
            return candidate if settled else replace(candidate, status=Status.UNTRUSTED)
        d = self._rti.transcription.problem.delay
        known = replace(start, x=np.vstack([self._x, start.x[1:]]), u=np.vstack([self._applied[:d], start.u[d:]]))
        return self._globalise(candidate) if self._rti.linearize(known, self._applied) else None

    def start(self, rest: Trajectory) -> bool:
        """Linearise at a state at rest or, if that costs no more, where its inputs lead; False if that has no value."""
        rti, self._alone = self._rti, True
        d = rti.transcription.problem.delay
        rest = replace(rest, u=np.vstack([self._applied[:d], rest.u[d:]]))
        at_rest = self._evaluated(rest)
        rolled = self._rolled_out(rest)
        if rolled is not None:
            guess, worth = rolled
            if worth.cost <= (np.inf if at_rest is None else at_rest.cost) and rti.linearize(guess, self._applied):
                return True
        return rti.linearize(rest, self._applied)

    @property
    def _is_last(self) -> bool:
        rti, settings = self._rti, self._rti.settings
        enough = self._iterations >= settings.sqp_iterations and self._iterations > settings.settling_iterations
        return enough or rti.is_over

    def _take_full_steps(self, candidate: Candidate) -> tuple[bool, Candidate]:
        """Iterations with full steps; whether they come to something."""
        rti, before = self._rti, np.nan
        while not self.is_settled(candidate, before):
            size = rti.step_size
            converges = not size >= CONVERGING * before or size <= SETTLED_STEP
            if self._is_last or not converges or not rti.linearize(candidate.trajectory, self._applied):
                return False, candidate
            before = size
            better = self._iterate()
            if not rti.is_usable(better):
                return False, candidate
            candidate = better
            self._iterations += 1
        return True, candidate

    def _iterate(self) -> Candidate:
        """An iteration after the first."""
        rti = self._rti
        candidate = rti.iterate(self._x, self._window, self._applied)
        if candidate.status.solved:
            rti.moved_later = max(rti.moved_later, rti.step_size)
        return candidate

    def _globalise(self, before_it: Candidate) -> Candidate | None:
        """Iterations that are worth it, from a guess linearised about.

        Where there is no way on from a guess, there may be one from the state alone: None, so that it is tried.
        """
        rti, before = self._rti, np.nan
        rti.begin()
        candidate = self._iterate()
        if not rti.is_usable(candidate):
            return replace(before_it, status=Status.BUDGET_EXCEEDED) if rti.is_over else None
        self._iterations += 1
        while not self.is_settled(candidate, before):
            start = rti.about
            share, guess = (0.0, start) if self._is_last else self._step_taken(candidate)
            before = rti.step_size if share == 1.0 else np.nan
            if share < 1.0:
                rti.begin()
            better = None
            if share > 0.0 and rti.linearize(guess, self._applied):
                better = self._iterate()
            if better is None or not rti.is_usable(better):
                return self._shown(guess, candidate) if self._is_last or self._alone else None
            candidate = better
            self._iterations += 1
        return candidate

    def _step_taken(self, candidate: Candidate) -> tuple[float, Trajectory]:
        """The share of a step that is worth it, 0 if none is, and where that leads."""
        rti, start, plan = self._rti, self._rti.about, candidate.trajectory
        horizon, transcription = rti.horizon, rti.transcription
        values = self._values(start)
        now = worth_of_guess(transcription, horizon.stages, horizon.c, horizon.reach, values, self._reference)
        promised = promise_of_step(
            transcription, horizon.stages, (start, plan), candidate.constraints, self._values(plan), self._reference
        )
        self._price = price_for(now, promised, self._price)
        merit_now = now.merit(self._price)
        less = merit_now - promised.merit(self._price)
        promises = less > NO_PROMISE * abs(merit_now)
        share = 1.0
        for _ in range(CUTS):
            if rti.is_over:
                break
            guess = _between(start, plan, share)
            worth, more = self._evaluated(guess), np.inf
            if worth is not None:
                more = worth.merit(self._price) - merit_now
                if not promises or more <= -SHARE_HELD * share * less:
                    return share, guess
            best = 0.5 * share**2 * less / (more + share * less)
            share = min(best, 0.5 * share) if best > 0.3 * share else 0.3 * share
        return 0.0, start

    def _evaluated(self, guess: Trajectory) -> Worth | None:
        """What a guess is worth; None where the model has no value."""
        transcription = self._rti.transcription
        stages = transcription.linearize(guess.x, guess.u, guess.inner, transcription.problem.parameters)
        if not stages.finite:
            return None
        try:
            c = eliminate(stages)[2]
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(c).all():
            return None
        reach = self._rti.reach_known
        return worth_of_guess(transcription, stages, c, reach, self._values(guess), self._reference)

    def _values(self, guess: Trajectory) -> Array:
        """The input before the first block, and those of the blocks (nb + 1, nu)."""
        problem = self._rti.transcription.problem
        return np.vstack([self._applied[-1], problem.blocks.values(guess.u[problem.delay :])])

    def _rolled_out(self, rest: Trajectory) -> tuple[Trajectory, Worth] | None:
        """Where the inputs of a state at rest lead, by Newton's method for all intervals at once; None if it fails."""
        transcription, guess, nx = self._rti.transcription, rest, len(self._x)
        for _ in range(SWEEPS):
            stages = transcription.linearize(guess.x, guess.u, guess.inner, transcription.problem.parameters)
            try:
                A, _, c = eliminate(stages)
            except np.linalg.LinAlgError:
                return None
            if not (stages.finite and np.isfinite(c).all()):
                return None
            if (np.abs(c[:, :nx]).max(axis=0) <= ROLLED_OUT * np.maximum(np.abs(guess.x).max(axis=0), 1.0)).all():
                worth = self._evaluated(guess)
                return None if worth is None else (guess, worth)
            dw, before = np.empty_like(c), np.zeros(nx)
            for k in range(len(c)):
                dw[k] = A[k] @ before + c[k]
                before = dw[k, :nx]
            x = np.vstack([guess.x[:1], guess.x[1:] + dw[:, :nx]])
            guess = replace(guess, x=x, inner=guess.inner + dw[:, nx:])
        return None

    def _shown(self, guess: Trajectory, candidate: Candidate) -> Candidate:
        """A guess as the plan, with constraints as they are there."""
        transcription = self._rti.transcription
        G = transcription.linearize(guess.x, guess.u, guess.inner, transcription.problem.parameters).G
        diagnostics = np.r_[candidate.diagnostics[:-2], np.nan, np.nan]
        return Candidate(guess, G, Status.UNTRUSTED, diagnostics)


def _between(start: Trajectory, plan: Trajectory, share: float) -> Trajectory:
    u, x, inner = (a + share * (b - a) for a, b in ((start.u, plan.u), (start.x, plan.x), (start.inner, plan.inner)))
    return Trajectory(u, x, inner)
