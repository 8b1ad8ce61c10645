"""Where plans that are said to be solutions come from, and whether they are of what was given."""

from __future__ import annotations

from typing import Any

import numpy as np

from rumo.plan import DIAGNOSTICS
from soak.driven import Drive
from soak.stacked import turned
from soak.verdict import Verdict

WILD = 1e5
"""States so many times as large as usual are not judged: of sines of such numbers few digits are left."""
SHIFT = 1e-7
"""Of limits, over their scales, or over what the inputs' ranges do to them where that is less."""
STEP = DIAGNOSTICS.index("step")
HELD = 1.0
"""See `rumo_symptom` in rumo_core.h."""


class Told:
    """Plans of steps of a drive, with the solutions they come from; those that come from none are blamed."""

    def __init__(self, judge: Any, drive: Drive, steps: np.ndarray, verdict: Verdict) -> None:
        self.judge_, self.problem, self.drive, self.verdict = judge, drive.problem, drive, verdict
        self.steps = self._told(steps)

    def _told(self, steps: np.ndarray) -> np.ndarray:
        """Find where plans come from: the last solution or, if that was dropped, the one before.

        Where both lead to the same, it is the one whose step is as long as is told.
        """
        of_solution, of_plan = self.judge_.layouts
        linearised = self.drive.solutions[steps].reshape(2 * len(steps), -1)
        states = (
            of_plan.of(self.drive.plans[steps], "x"),
            of_solution.of(linearised, "x").reshape(len(steps), -1, len(self.drive.sizes)),
        )
        wild = ~(np.abs(np.concatenate(states, axis=1) / self.drive.sizes).max(axis=(1, 2)) < WILD)
        self.verdict.undecided += int(wild.sum())
        steps = steps[~wild]
        plans, solutions = self.drive.plans[steps], self.drive.solutions[steps]
        u, room = of_plan.of(plans, "u"), SHIFT * self.problem.input_scales
        last = (self.drive.solved[steps] - 1) % 2
        x, rows = of_plan.of(plans, "x"), np.arange(len(steps))
        origin, self.came_to, nearest = np.full(len(steps), -1), u.copy(), np.full(len(steps), np.inf)
        step_told = of_plan.of(plans, "diagnostics")[:, STEP]
        for candidate in (1 - last, last):
            chosen = solutions[rows, candidate]
            came_to, came_by = (of_solution.of(chosen, name) + of_solution.of(chosen, f"d{name}") for name in "ux")
            same = (came_by[:, 1:] == x[:, 1:]).all(axis=(1, 2)) & (of_solution.of(chosen, "measured") == x[:, 0]).all(
                axis=1
            )
            lost = 1e-15 * (np.abs(u) + np.abs(of_solution.of(chosen, "u")))
            same &= (np.abs(self._put_within(came_to, steps) - u) <= room + lost).all(axis=(1, 2))
            longest = np.abs(of_solution.of(chosen, "du") / self.problem.input_scales).max(axis=(1, 2))
            apart = np.nan_to_num(np.abs(longest - step_told), nan=np.finfo(float).max)
            nearer = same & (apart <= nearest)
            origin[nearer], self.came_to[nearer], nearest[nearer] = candidate[nearer], came_to[nearer], apart[nearer]
        self.verdict.blame(steps[origin < 0], "a plan comes from no solution")
        self.verdict.blame(steps[self.drive.solved[steps] == 0], "a plan was never solved")
        known = (origin >= 0) & (self.drive.solved[steps] > 0)
        steps, origin = steps[known], origin[known]
        self.guess, self.came_to = self.drive.solutions[steps, origin], self.came_to[known]
        last = self.drive.decided[steps, -1]
        numbers, d = self.problem.numbers, self.problem.delay
        inside = (last >= numbers.input_lower[d:].max(axis=0)) & (last <= numbers.input_upper[d:].min(axis=0))
        lost = 1e-15 * (np.abs(u[known]) + np.abs(of_solution.of(self.guess, "u")))
        cut = (np.abs(self.came_to - u[known]) > room + lost).any(axis=(1, 2))
        self.verdict.blame(steps[cut & inside.all(axis=1)], "a solution was out of bounds")
        return steps

    def _put_within(self, u: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Where the input before is out of bounds, so are some on the way back: put within moves and bounds."""
        d, numbers = self.problem.delay, self.problem.numbers
        put, before = u.copy(), self.drive.decided[steps, -1]
        for k in range(d, u.shape[1]):
            moved = np.clip(u[:, k], before + numbers.move_lower, before + numbers.move_upper)
            put[:, k] = before = np.clip(moved, numbers.input_lower[k], numbers.input_upper[k])
        return put

    def blame(self, which, why) -> None:
        """As `Verdict.blame`, by a mask of those solved."""
        self.verdict.blame(self.steps[which], why)

    def _read(self) -> None:
        of_solution, of_plan = self.judge_.layouts
        plans = self.drive.plans[self.steps]
        self.u = self.came_to
        self.x, self.z, self.G_told, self.diagnostics = (
            of_plan.of(plans, name) for name in ("x", "z", "constraints", "diagnostics")
        )
        self.u_g, self.x_g, inner, self.measured, self.decided, self.reference = (
            of_solution.of(self.guess, name) for name in ("u", "x", "inner", "measured", "decided", "reference")
        )
        self.w_g = np.concatenate([self.x_g[:, 1:], inner.transpose(0, 2, 1)], axis=2)
        self.size = len(self.problem.model.variables)
        self.du, self.dx = self.u - self.u_g, self.x - self.x_g
        steps = np.abs(self.du / self.problem.input_scales).max(axis=(1, 2))
        self.longest = np.maximum(1.0, steps)[:, None, None]
        ends = np.concatenate([self.x[:, 1:], self.z], axis=2)
        self.dxz = ends - self.w_g[:, :, : self.size]

    def _judge_what_was_told(self) -> None:
        """The first state is what was measured, but for turns, old and held-back readings; so is what is wanted."""
        drive, steps, sensors = self.drive, self.steps, self.problem.sensors
        apart = self.measured - drive.measured[steps]
        held = drive.health[steps, :, 2] == HELD
        other = ~held & (sensors.age == 0) & ~turned(apart, sensors.turn, 1e-6)
        self.blame(other.any(axis=1), "a measurement became another")
        given = drive.wanted[steps]
        turn = np.where(sensors.output_states >= 0, sensors.turn[sensors.output_states], 0.0)
        apart = self.reference - given
        self.blame((np.isfinite(given) & ~turned(apart, turn, 1e-6)).any(axis=(1, 2)), "a reference became another")
        self.blame((self.decided != drive.decided[steps]).any(axis=(1, 2)), "inputs decided before are others")
