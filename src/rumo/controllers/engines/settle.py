"""A step that is safeguarded: where the first iteration is not to be trusted, others follow.

At first full steps, while each is less than half the one before: Newton's method where it converges. Else from the
guess again, with steps cut so that each is worth it on the nonlinear problem, see `merit`. Where none is, or what
settles is worse than what the guess's inputs lead to, from there, with steps damped so that each is worth it where its
own inputs lead, see `damping`. As core/src/settle.c.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rumo.controllers.arguments import tracked
from rumo.controllers.engines.base import Candidate
from rumo.controllers.engines.damping import SHARE_HELD, damping_after, damping_for
from rumo.controllers.engines.merit import Promise, Worth, is_admissible, price_for, promise_of_step, worth_of_guess
from rumo.controllers.engines.roll_out import linearised, roll_out
from rumo.controllers.engines.trajectory import Trajectory
from rumo.signals import Array
from rumo.status import Status
from rumo.transcription import Stages

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
CUTS = 12
CUT_ITERATIONS = 0.75
"""The share of all iterations after which no other step is cut."""
WORSE = 1.01
"""A plan that costs so many times what the guess does is worse."""


def error_left(before: float, size: float) -> float:
    """What steps add up to that are still to come, if each is less than half the one before; NaN if this was not."""
    return max(size, LEAST_CONTRACTION * before) if size < CONVERGING * before else np.nan


class Settling:
    """The iterations of one sample: a measurement x (nx,), a reference by signal (N + 1,), inputs already decided."""

    def __init__(self, rti: NumpyRti, x: Array, window: Mapping[str, Array], applied: Array) -> None:
        self._rti, self._x, self._window, self._applied = rti, x, window, applied
        self._reference = tracked(rti.transcription.problem, window)[1:]
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
        start, cost = self._rti.about, self._worth().cost
        d = self._rti.transcription.problem.delay
        known = replace(start, x=np.vstack([self._x, start.x[1:]]), u=np.vstack([self._applied[:d], start.u[d:]]))
        settled, candidate = self._take_full_steps(candidate)
        settled = settled and not self._is_worse(candidate, known, cost)
        if settled or self._is_last:
            return candidate if settled else replace(candidate, status=Status.UNTRUSTED)
        return self._globalise(candidate) if self._rti.linearize(known, self._applied) else None

    def start(self, rest: Trajectory) -> bool:
        """Linearise at a state at rest or, if that costs no more, where its inputs lead; False if that has no value."""
        rti, self._alone = self._rti, True
        d = rti.transcription.problem.delay
        rest = replace(rest, u=np.vstack([self._applied[:d], rest.u[d:]]))
        at_rest = self._evaluated(rest)
        rolled = self._rolled_out(rest)
        if rolled is not None:
            guess, _, worth = rolled
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

    def _is_worse(self, candidate: Candidate, guess: Trajectory, cost: float) -> bool:
        """Whether what has settled is worse than where a guess's inputs lead, which cost this itself."""
        transcription, problem = self._rti.transcription, self._rti.transcription.problem
        nothing = (problem.block_move_weights * (SETTLED_STEP * problem.input_scales) ** 2).sum()
        now = self._promised(candidate).cost - nothing
        if not now > WORSE * cost:
            return False
        rolled = self._rolled_out(guess)
        if rolled is None:
            return False
        way, stages, worth = rolled
        return now > WORSE * worth.cost and is_admissible(transcription, way, stages.G, self._values(way))

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
        rti, first, cost = self._rti, self._rti.about, self._worth().cost
        rti.begin()
        candidate = self._iterate()
        if not rti.is_usable(candidate):
            return replace(before_it, status=Status.BUDGET_EXCEEDED) if rti.is_over else None
        settled, guess, candidate, price = self._take_cut_steps(candidate)
        settled = settled and not self._is_worse(candidate, first, cost)
        if not settled and not self._is_last:
            settled, led_on, guess, candidate = self._take_damped_steps((guess, first), candidate, price)
            if not led_on and not self._alone and not rti.is_over:
                return None
        return candidate if settled else self._shown(guess, candidate)

    def _take_cut_steps(self, candidate: Candidate) -> tuple[bool, Trajectory, Candidate, float]:
        """Iterations with cut steps, one of which has been made; whether they settle, where they come to, the price."""
        rti, before, price = self._rti, np.nan, 0.0
        most = CUT_ITERATIONS * max(rti.settings.settling_iterations, rti.settings.sqp_iterations)
        self._iterations += 1
        share = 1.0
        while not self.is_settled(candidate, before):
            short = share == 1.0 or rti.step_size <= SETTLED_STEP
            enough = self._is_last or (self._iterations > most and not short)
            share, guess = 0.0, rti.about
            if not enough:
                share, guess, price = self._step_taken(candidate, price)
            before = rti.step_size if share == 1.0 else np.nan
            if share < 1.0:
                rti.begin()
            better = self._iterate() if share > 0.0 and rti.linearize(guess, self._applied) else None
            if better is None or not rti.is_usable(better):
                return False, guess, candidate, price
            candidate = better
            self._iterations += 1
        return True, rti.about, candidate, price

    def _take_damped_steps(
        self, guesses: tuple[Trajectory, Trajectory], candidate: Candidate, price: float
    ) -> tuple[bool, bool, Trajectory, Candidate]:
        """The same with damped steps, from where inputs of a guess lead to where each step's do; whether any did."""
        rti, damping, first, before = self._rti, 0.0, 0.0, np.nan
        ways = [way for way in map(self._rolled_out, guesses) if way is not None]
        if not ways or not rti.linearize(min(ways, key=lambda way: way[2].merit(price))[0], self._applied):
            return False, False, guesses[0], candidate
        rti.begin()
        led_on = False
        while True:
            start, better = rti.about, self._iterate()
            if not rti.is_usable(better):
                break
            candidate = better
            self._iterations += 1
            if damping == 0.0 and self.is_settled(candidate, before):
                return True, True, start, candidate
            if self._is_last:
                break
            made = self._promise(candidate, price)
            price = made.price
            plan, size = candidate.trajectory, rti.step_size
            if first == 0.0:
                ranges = rti.transcription.problem.input_scales
                first = damping_for(made.less, np.diff(self._values(plan) - self._values(start), axis=0) / ranges)
            rolled = self._rolled_out(plan)
            more = np.inf if rolled is None else rolled[2].merit(price) - made.merit
            share = -more / made.less if made.promises else float(more < np.inf)
            held = share >= SHARE_HELD
            led_on |= held
            before = size if damping == 0.0 and held else np.nan
            if not before > 0.0:
                rti.begin()
            damping = damping_after(damping, first, share)
            if not held and damping == 0.0:
                break
            start = rolled[0] if rolled is not None and held else start
            if not rti.linearize(start, self._applied, damping):
                break
        return False, led_on, start, candidate

    def _promise(self, candidate: Candidate, price: float) -> Promise:
        """Of a step, at this price or at what it needs."""
        now, promised = self._worth(), self._promised(candidate)
        price = price_for(now, promised, price)
        return Promise(now.merit(price), now.merit(price) - promised.merit(price), price)

    def _worth(self) -> Worth:
        """Of what is linearised about."""
        rti, horizon = self._rti, self._rti.horizon
        values = self._values(rti.about)
        return worth_of_guess(rti.transcription, horizon.stages, horizon.c, horizon.reach, values, self._reference)

    def _promised(self, candidate: Candidate) -> Worth:
        """What a plan would be worth as linearised."""
        rti, plan = self._rti, candidate.trajectory
        step, values = (rti.about, plan), self._values(plan)
        return promise_of_step(
            rti.transcription, rti.horizon.stages, step, candidate.constraints, values, self._reference
        )

    def _step_taken(self, candidate: Candidate, price: float) -> tuple[float, Trajectory, float]:
        """The share of a step that is worth it, 0 if none is, where that leads, and the price of what is lacking."""
        rti, start, plan = self._rti, self._rti.about, candidate.trajectory
        made, share = self._promise(candidate, price), 1.0
        for _ in range(CUTS):
            if rti.is_over:
                break
            guess = _between(start, plan, share)
            worth, more = self._evaluated(guess), np.inf
            if worth is not None:
                more = worth.merit(made.price) - made.merit
                if not made.promises or more <= -SHARE_HELD * share * made.less:
                    return share, guess, made.price
            best = 0.5 * share**2 * made.less / (more + share * made.less)
            share = min(best, 0.5 * share) if best > 0.3 * share else 0.3 * share
        return 0.0, start, made.price

    def _evaluated(self, guess: Trajectory) -> Worth | None:
        """What a guess is worth; None where the model has no value."""
        seen = linearised(self._rti.transcription, guess)
        return None if seen is None else self._worth_at(guess, seen[0], seen[2])

    def _worth_at(self, guess: Trajectory, stages: Stages, c: Array) -> Worth:
        """Of a guess that is not what is linearised about: by its stages and Newton's corrections."""
        rti, values = self._rti, self._values(guess)
        return worth_of_guess(rti.transcription, stages, c, rti.reach_known, values, self._reference)

    def _values(self, guess: Trajectory) -> Array:
        """The input before the first block, and those of the blocks (nb + 1, nu)."""
        problem = self._rti.transcription.problem
        return np.vstack([self._applied[-1], problem.blocks.values(guess.u[problem.delay :])])

    def _rolled_out(self, guess: Trajectory) -> tuple[Trajectory, Stages, Worth] | None:
        """Where a guess's inputs lead, the stages there, and what that is worth; None if it comes to nothing."""
        rolled = roll_out(self._rti.transcription, guess)
        if rolled is None:
            return None
        way, stages, c = rolled
        return way, stages, self._worth_at(way, stages, c)

    def _shown(self, guess: Trajectory, candidate: Candidate) -> Candidate:
        """A guess as the plan, with constraints as they are there."""
        transcription = self._rti.transcription
        G = transcription.linearize(guess.x, guess.u, guess.inner, transcription.problem.parameters).G
        diagnostics = np.r_[candidate.diagnostics[:-2], np.nan, np.nan]
        return Candidate(guess, G, Status.UNTRUSTED, diagnostics)


def _between(start: Trajectory, plan: Trajectory, share: float) -> Trajectory:
    u, x, inner = (a + share * (b - a) for a, b in ((start.u, plan.u), (start.x, plan.x), (start.inner, plan.inner)))
    return Trajectory(u, x, inner)
