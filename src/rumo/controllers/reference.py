"""The real-time iteration in NumPy, line by line the paper: slow, readable, and the oracle of the compiled one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rumo.controllers.condensed import CondensedController
from rumo.controllers.fallback import Trajectory
from rumo.controllers.policy import Candidate
from rumo.controllers.rti import RealTimeIteration
from rumo.signals import Array, Values
from rumo.status import Status

# A guess farther from the dynamics than this share of what the inputs can do has strayed.
STRAYED = 0.03


class ReferenceRti(RealTimeIteration, CondensedController):
    """`RealTimeIteration(problem, backend="reference")`."""

    _backend = "reference"
    _settled = False  # whether guesses have satisfied the dynamics since the last one at rest

    def _prepare(self, guess: Trajectory) -> bool:
        if not self._linearize(guess) or self._condensed is None:
            return False
        # A plan made from a wild measurement would keep misleading its successors.
        strayed = self._condensed.straying >= STRAYED
        lost = self._settled and strayed and not guess.resting
        self._settled = not strayed
        return not lost and self._advance(guess.x[0])

    def _advance(self, predicted: Array) -> bool:
        """Iterate on the state that is expected, and what was wanted at the last sample."""
        for _ in range(self.preparation_iterations if self._expected is not None else 0):
            assert self._expected is not None
            candidate = self._iterate(predicted, self._expected)
            if not candidate.status.solved:
                break
            done = self._change(candidate.trajectory) < self.tolerance
            if not self._linearize(candidate.trajectory):
                return False
            if done:
                break
        return True

    def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Forget everything, see `Controller.reset`."""
        self._expected: dict[str, Array] | None = None  # reference at the next sample, as far as known
        super().reset(x, applied)

    def _attempt(self, x: Array, window: dict[str, Array]) -> tuple[Candidate | None, Status]:
        if np.isfinite(x).all() and all(np.isfinite(values).all() for values in window.values()):
            i, share = self._shift.stages, np.minimum(self._shift.shares, 1.0)
            self._expected = {name: r[i] + share * (r[i + 1] - r[i]) for name, r in window.items()}
        return super()._attempt(x, window)

    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        candidate = self._iterate(x, window)
        for _ in range(self.sqp_iterations - 1):
            if not candidate.status.solved or self._change(candidate.trajectory) < self.tolerance:
                break
            if not self._linearize(candidate.trajectory):
                break
            better = self._iterate(x, window)
            if not better.status.solved:
                break
            candidate = better
        return candidate

    def _change(self, new: Trajectory) -> float:
        """Largest change of an input over its range, or of a state over the reach of the inputs."""
        assert self._condensed is not None
        old, reach = self._about, self._condensed.reach
        inputs = np.abs(new.u - old.u).max(axis=0) / self.problem.input_scales
        states = np.abs(new.x - old.x).max(axis=0)[reach > 0.0] / reach[reach > 0.0]
        return float(max(inputs.max(), states.max(initial=0.0)))
